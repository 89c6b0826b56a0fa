//! The station's list of locomotives: asked for by name, sent in frames of eight bytes, compressed.
//!
//! ```text
//! stream      length of the text (4, big endian), then the text compressed by zlib; padded with zeros to whole frames
//! text        `[lokomotive]` is its first line; a line `lokomotive` begins each, lines ` .uid=0x4005`, ` .adresse=0x5`, ` .name=BR 03` follow
//! ```
//!
//! The check sum in the stream's first frame is not looked at: zlib has one of its own over the text, and programs differ in whether the
//! padding counts.

use alloc::string::{String, ToString};
use alloc::vec::Vec;

use footplate_core::TrainId;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use super::frame::MOST_DATA;
use super::uid::Uid;

/// The name under which the list is asked for.
pub const LOCOMOTIVES_FILE: [u8; MOST_DATA] = *b"loks\0\0\0\0";

/// The first line of the list's text; other files begin with `[magnetartikel]`, `[fahrstrassen]` and the like.
const HEADING: &str = "[lokomotive]";

/// The longest stream and the longest text that are read: a hundred times what a station with a hundred locomotives sends.
const LONGEST_STREAM: usize = 256 * 1024;
const LONGEST_TEXT: usize = 4 * 1024 * 1024;

/// A locomotive of the station's list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedLocomotive {
    /// The number under which it is driven.
    pub uid: Uid,
    /// Its address, or the number of its registration.
    pub address: u16,
    /// What people call it.
    pub name: String,
}

/// The list, as far as it has come.
#[derive(Debug, Clone, Default)]
pub(super) struct Roster {
    stream: Vec<u8>,
    /// Bytes of the stream; `None`: none is coming.
    length: Option<usize>,
    has_begun: bool,
    list: Vec<ListedLocomotive>,
}

impl Roster {
    /// Whether the station has ever begun to send it.
    pub(super) const fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// A stream of a length begins.
    pub(super) fn begins(&mut self, length: u32) {
        self.stream.clear();
        self.has_begun = true;
        self.length = usize::try_from(length).ok().filter(|length| (1..=LONGEST_STREAM).contains(length));
    }

    /// Takes more of the stream; returns once whether it is complete and could be read. A list that could not be read leaves the
    /// earlier one as it is.
    pub(super) fn goes_on(&mut self, bytes: [u8; MOST_DATA]) -> Option<bool> {
        let length = self.length?;
        self.stream.extend(bytes);
        if self.stream.len() < length {
            return None;
        }
        self.length = None;
        let list = self.stream.get(..length).and_then(read_list);
        self.stream = Vec::new();
        let is_read = list.is_some();
        self.list = list.unwrap_or_else(|| core::mem::take(&mut self.list));
        Some(is_read)
    }

    pub(super) fn list(&self) -> &[ListedLocomotive] {
        &self.list
    }

    /// The number of a train: that of the only locomotive with its address.
    pub(super) fn uid(&self, train: TrainId) -> Option<Uid> {
        let mut found = self.list.iter().filter(|listed| listed.address == train.0);
        found.next().filter(|_| found.next().is_none()).map(|listed| listed.uid)
    }
}

/// Reads the list from a whole stream without its padding; `None` if it is damaged, or another of the station's files.
pub fn read_list(stream: &[u8]) -> Option<Vec<ListedLocomotive>> {
    let (_, compressed) = stream.split_first_chunk::<4>()?;
    let text = decompress_to_vec_zlib_with_limit(compressed, LONGEST_TEXT).ok()?;
    let text = String::from_utf8_lossy(&text);
    if text.lines().next()?.trim_end() != HEADING {
        return None;
    }
    let mut list = Vec::new();
    let (mut uid, mut address, mut name) = (None, None, String::new());
    for line in text.lines().chain(["lokomotive"]) {
        if line == "lokomotive" {
            if let (Some(uid), Some(address)) = (uid.take(), address.take()) {
                list.push(ListedLocomotive { uid: Uid(uid), address, name: core::mem::take(&mut name) });
            }
            name.clear();
        } else if let Some((key, value)) = line.trim_end().split_once('=') {
            match key {
                " .uid" => uid = number(value),
                " .adresse" => address = number(value).and_then(|number| u16::try_from(number).ok()),
                " .name" => name = value.to_string(),
                _ => {}
            }
        }
    }
    Some(list)
}

fn number(value: &str) -> Option<u32> {
    match value.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => value.parse().ok(),
    }
}

/// The check sum of a stream: CCITT's polynomial 0x1021, from 0xFFFF, over the stream and its padding.
pub fn check_sum(stream: &[u8]) -> u16 {
    let padding = stream.len().next_multiple_of(MOST_DATA) - stream.len();
    let bytes = stream.iter().copied().chain(core::iter::repeat_n(0, padding));
    bytes.fold(0xFFFF, |sum: u16, byte| {
        (0..8).fold(
            sum ^ u16::from(byte) << 8,
            |sum, _| if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x1021 },
        )
    })
}

#[cfg(test)]
mod tests {
    use miniz_oxide::deflate::compress_to_vec_zlib;

    use super::*;

    const TEXT: &str = "[lokomotive]\nversion\n .minor=3\nsession\n .id=7\nlokomotive\n .name=BR 03\n .uid=0x4005\n .adresse=0x5\n .typ=mfx\n\
                        lokomotive\n .uid=0xc018\n .name=Re 420\n .adresse=0x18\n .typ=dcc\n .funktionen\n ..nr=0\nlokomotive\n .name=V 5\n .uid=0x5\n .adresse=0x5\n";

    fn stream() -> Vec<u8> {
        let length = u32::try_from(TEXT.len()).unwrap_or_default().to_be_bytes();
        length.into_iter().chain(compress_to_vec_zlib(TEXT.as_bytes(), 6)).collect()
    }

    #[test]
    fn a_list_is_read_frame_by_frame() {
        let stream = stream();
        let mut roster = Roster::default();
        roster.begins(u32::try_from(stream.len()).unwrap_or_default());
        let last = stream.chunks(MOST_DATA).filter_map(|chunk| {
            let mut frame = [0; MOST_DATA];
            frame.iter_mut().zip(chunk).for_each(|(place, byte)| *place = *byte);
            roster.goes_on(frame)
        });
        assert_eq!(last.collect::<Vec<bool>>(), [true]);
        let names: Vec<&str> = roster.list().iter().map(|listed| listed.name.as_str()).collect();
        assert_eq!(names, ["BR 03", "Re 420", "V 5"]);
        assert_eq!(roster.uid(TrainId(24)), Some(Uid(0xC018)));
        assert_eq!(roster.uid(TrainId(5)), None, "two locomotives have the address");
    }

    #[test]
    fn a_damaged_list_is_none() {
        let mut stream = stream();
        let middle = stream.len() / 2;
        stream.remove(middle);
        assert_eq!(read_list(&stream), None);
        assert_eq!(read_list(&[]), None);
        let mut roster = Roster::default();
        roster.begins(u32::MAX);
        assert_eq!(roster.goes_on([0; MOST_DATA]), None);
    }

    #[test]
    fn the_check_sum_is_that_of_the_polynomial() {
        // "123456789" without padding is 0x29B1 (catalogue of parametrised CRC algorithms); here it is padded with seven zeros.
        let unpadded = b"123456789".iter().fold(0xFFFF_u16, |sum, byte| {
            (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| {
                if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x1021 }
            })
        });
        assert_eq!(unpadded, 0x29B1);
        assert_eq!(check_sum(b"123456789"), check_sum(b"123456789\0\0\0\0\0\0\0"));
    }
}
