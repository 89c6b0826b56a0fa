//! The fingerprint of a file, by which a recording that was imported before is known again.

use std::fmt;
use std::io::{self, Read};

use sha2::{Digest, Sha256};

/// The SHA-256 of a content; `sha256sum` prints the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// Of these bytes.
    pub fn of(content: &[u8]) -> Self {
        Self(Sha256::digest(content).into())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Passes on what is read and takes its fingerprint meanwhile, so that a file is read once.
#[derive(Debug)]
pub struct HashingReader<R> {
    input: R,
    hasher: Sha256,
}

impl<R: Read> HashingReader<R> {
    /// Reads from `input`.
    pub fn new(input: R) -> Self {
        Self { input, hasher: Sha256::new() }
    }

    /// The fingerprint of all that `input` had, what was not read yet included.
    pub fn finish(mut self) -> io::Result<ContentHash> {
        io::copy(&mut self, &mut io::sink())?;
        Ok(ContentHash(self.hasher.finalize().into()))
    }
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        self.hasher.update(buffer.get(..count).unwrap_or_default());
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-2, appendix B.1.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn the_fingerprint_is_the_standards() {
        assert_eq!(ContentHash::of(b"abc").to_string(), ABC);
    }

    #[test]
    fn a_file_read_in_part_has_the_fingerprint_of_the_whole() {
        let mut reader = HashingReader::new(&b"abc"[..]);
        reader.read_exact(&mut [0; 1]).unwrap();
        assert_eq!(reader.finish().unwrap().to_string(), ABC);
    }
}
