//! Numbers written as their bits: some of them are infinite, which no text of JSON can say.

use alloc::vec::Vec;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Writes the bits of each number.
pub(super) fn serialize<S: Serializer>(numbers: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    let bits: Vec<u64> = numbers.iter().map(|number| number.to_bits()).collect();
    bits.serialize(serializer)
}

/// Reads what [`serialize`] writes.
pub(super) fn deserialize<'d, D: Deserializer<'d>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let bits = Vec::<u64>::deserialize(deserializer)?;
    Ok(bits.into_iter().map(f64::from_bits).collect())
}
