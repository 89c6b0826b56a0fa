//! Any names for the columns of a recording, and any recording under them: refused in words, or read.

use footplate_store::{ColumnMapping, TachometerBlock, TachometerReader, parse_vehicle};

use crate::odometer::VEHICLE;

/// Parts the names from the recording.
const PART: &[u8] = b"\n---\n";

pub(crate) fn fuzz(bytes: &[u8]) {
    let at = bytes.windows(PART.len()).position(|part| part == PART);
    let (names, rows) = at.map_or((bytes, bytes), |at| (&bytes[..at], &bytes[at + PART.len()..]));
    let mut mapping = ColumnMapping::default();
    if mapping.take_bytes("names.toml", names).is_err() {
        for pair in String::from_utf8_lossy(names).lines() {
            let _ = mapping.take_pair(pair);
        }
    }
    let vehicle = parse_vehicle("train.toml", VEHICLE.as_bytes()).expect("the design's example").vehicle;
    let input = Box::new(std::io::Cursor::new(rows.to_vec()));
    let Ok(mut reader) = TachometerReader::mapped_stream("run.csv", input, &mapping, &vehicle) else {
        return;
    };
    let mut block = TachometerBlock::default();
    while reader.read_block(&mut block).unwrap_or(false) {}
}
