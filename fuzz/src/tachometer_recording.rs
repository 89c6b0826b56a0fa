//! Any bytes as a tachometer recording: they are refused with the name of the file, or read alike in one piece and in
//! many.

use std::io::{self, Read};

use footplate_core::odometry::wheels::Period;
use footplate_store::{TachometerBlock, TachometerReader};

pub(crate) fn fuzz(bytes: &[u8]) {
    let whole = read(bytes, usize::MAX);
    assert_eq!(whole, read(bytes, 7));
    if let Err(message) = whole {
        assert!(message.starts_with("run.csv"), "{message}");
    }
}

/// All periods of a recording that comes in pieces of so many bytes, or why there are none.
fn read(bytes: &[u8], piece: usize) -> Result<Vec<Period>, String> {
    let input = Pieces { bytes: bytes.to_vec(), at: 0, piece };
    let mut reader = TachometerReader::of_stream("run.csv", Box::new(input)).map_err(|e| e.to_string())?;
    let mut block = TachometerBlock::default();
    let mut periods = Vec::new();
    while reader.read_block(&mut block).map_err(|e| e.to_string())? {
        periods.extend((0..block.len()).map(|row| block.period(row)));
    }
    Ok(periods)
}

struct Pieces {
    bytes: Vec<u8>,
    at: usize,
    piece: usize,
}

impl Read for Pieces {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let count = rest.len().min(self.piece).min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.at += count;
        Ok(count)
    }
}
