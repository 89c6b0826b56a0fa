//! Square matrices whose side is a constant, row after row in files.

use alloc::vec::Vec;

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

pub(super) fn serialize<const L: usize, S: Serializer>(
    matrix: &[[f64; L]; L],
    to: S,
) -> Result<S::Ok, S::Error> {
    matrix.as_flattened().serialize(to)
}

pub(super) fn deserialize<'de, const L: usize, D: Deserializer<'de>>(
    from: D,
) -> Result<[[f64; L]; L], D::Error> {
    let flat = Vec::<f64>::deserialize(from)?;
    let mut matrix = [[0.0; L]; L];
    if flat.len() != L * L {
        return Err(D::Error::invalid_length(flat.len(), &"as many numbers as the square of its side"));
    }
    matrix.as_flattened_mut().copy_from_slice(&flat);
    Ok(matrix)
}
