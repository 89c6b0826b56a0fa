//! A Parquet recording of which any bytes were changed: it is read, or refused with the name of the file.
//!
//! The input is a list of changes, four bytes each, to a recording with all columns that we write: bytes of nothing never get
//! past the magic number.

use std::sync::LazyLock;

use footplate_store::{TableForm, TachometerBlock, TachometerReader, TachometerWriter, WrittenColumns};

/// A row or two of everything.
const ROWS: &str = include_str!("../../testdata/tachometer/everything.csv");

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let columns = WrittenColumns {
        counters: [false; 2],
        directions: true,
        edges: true,
        effort: true,
        acceleration: true,
        balise: true,
        truth: true,
        ..WrittenColumns::default()
    };
    let mut writer = TachometerWriter::new(Vec::new(), TableForm::Parquet, columns).expect("memory");
    let input = std::io::Cursor::new(ROWS.as_bytes());
    let mut reader = TachometerReader::of_stream("everything.csv", Box::new(input)).expect("our own example");
    let mut block = TachometerBlock::default();
    while reader.read_block(&mut block).expect("our own example") {
        for row in 0..block.len() {
            writer.push("run", &block.period(row), &block.truth(row)).expect("memory");
        }
    }
    writer.finish().expect("memory")
});

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut file = WHOLE.clone();
    for change in bytes.chunks_exact(4) {
        let at = usize::from(u16::from_le_bytes([change[0], change[1]])) % file.len().max(1);
        match change[2] % 5 {
            _ if file.is_empty() => break,
            0 => file[at] = change[3],
            1 => file[at] ^= 1 << (change[3] % 8),
            2 => file[at] = file[at].wrapping_add(change[3]),
            3 => drop(file.drain(at..(at + usize::from(change[3] % 16)).min(file.len()))),
            _ => file.insert(at, change[3]),
        }
    }
    let input = std::io::Cursor::new(file);
    let read = TachometerReader::of_stream("run.parquet", Box::new(input)).and_then(|mut reader| {
        let mut block = TachometerBlock::default();
        while reader.read_block(&mut block)? {}
        Ok(())
    });
    if let Err(error) = read {
        assert!(error.to_string().starts_with("run.parquet"), "{error}");
    }
}
