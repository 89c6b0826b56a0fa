//! The write-ahead log beside a store, frame by frame: what SQLite does not read of it.
//!
//! SQLite reads a log up to the first frame whose checksum differs, and takes that for its end, because a power cut leaves such a
//! frame (SQLite file format, section 4). A frame's checksum begins with the one that the frame before it carries, so that frames
//! behind a damaged one can still be checked. A commit is on the disk before the next one is written. So if two or more commits
//! are not read, the first of them was acknowledged and is lost. A single one may have been cut off by a power cut.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::error::StoreError;

const HEADER: usize = 32;
const FRAME_HEADER: usize = 24;
/// The first four bytes of a log, without the last bit, which is set if checksums are made of big-endian words.
const MAGIC: u32 = 0x377f_0682;
/// Where the header of a log has its salts, and where that of a frame has them.
const SALTS: std::ops::Range<usize> = 16..24;
const FRAME_SALTS: std::ops::Range<usize> = 8..16;
/// How often a log is read until two readings agree: another process may be writing to it (chosen).
const READINGS: usize = 8;

/// The part of a log that SQLite does not read although it belongs to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnreadLog {
    file: PathBuf,
    /// The frame at which reading ends, from 1; 0 is the header.
    bad_frame: u64,
    frames: u64,
    /// The commits that end at this frame or behind it.
    commits: u64,
}

impl UnreadLog {
    /// The unread part of the log beside a store; `None` if there is no log or no commit is unread.
    pub(super) fn beside(store: &Path) -> Result<Option<Self>, StoreError> {
        let log = path_of(store);
        let read = || Self::read(&log, page_size_of(store), None);
        let mut last = read();
        for _ in 1..READINGS {
            if matches!(last, Ok(None)) {
                break;
            }
            let next = read();
            if matches!((&last, &next), (Ok(last), Ok(next)) if last == next) {
                break;
            }
            last = next;
        }
        match last {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            unread => unread.map_err(|source| StoreError::System { file: log, doing: "read", source }),
        }
    }

    /// The newest image of each page in the whole frames of all commits of a log, by its number: of those that SQLite reads and of
    /// those that it does not.
    pub(super) fn committed_pages(store: &Path) -> Result<BTreeMap<u32, Vec<u8>>, StoreError> {
        let log = path_of(store);
        let mut pages = BTreeMap::new();
        match Self::read(&log, page_size_of(store), Some(&mut pages)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(StoreError::System { file: log, doing: "read", source: error })
            }
            _ => Ok(pages),
        }
    }

    /// Whether commits are lost that had been acknowledged.
    pub(super) const fn is_loss(&self) -> bool {
        self.commits > 1
    }

    /// Reads a log, and the pages in it on request.
    fn read(
        log: &Path,
        page_size: usize,
        mut pages: Option<&mut BTreeMap<u32, Vec<u8>>>,
    ) -> std::io::Result<Option<Self>> {
        let mut file = BufReader::new(File::open(log)?);
        let mut header = [0; HEADER];
        if !is_filled(&mut file, &mut header)? {
            return Ok(None);
        }
        let order = Order::of(&header);
        let mut is_read = u32_at(&header, 0) & !1 == MAGIC
            && order.sum([0, 0], header.get(..24).unwrap_or_default()) == pair_at(&header, 24);
        let mut salts = is_read.then(|| header.get(SALTS).map(<[u8]>::to_vec)).flatten();
        let mut before = pair_at(&header, 24);
        let mut unread = Self { file: log.to_owned(), bad_frame: 0, frames: 0, commits: 0 };
        // Those of the commit that has not ended yet.
        let mut pending = BTreeMap::new();
        let mut frame = vec![0; FRAME_HEADER + page_size];
        while is_filled(&mut file, &mut frame)? {
            unread.frames += 1;
            // Without a header the first frame tells whose log it is.
            let own = salts.get_or_insert_with(|| frame.get(FRAME_SALTS).unwrap_or_default().to_vec());
            let is_ours = frame.get(FRAME_SALTS) == Some(own.as_slice());
            let (head, page) = frame.split_at(FRAME_HEADER);
            let sum = order.sum(order.sum(before, head.get(..8).unwrap_or_default()), page);
            before = pair_at(head, 16);
            let is_whole = is_ours && sum == before;
            if is_read && !is_whole {
                (is_read, unread.bad_frame) = (false, unread.frames);
            }
            if is_whole && pages.is_some() {
                pending.insert(u32_at(head, 0), page.to_vec());
            }
            // The second word is the size of the database in pages, behind a commit only.
            if is_ours && u32_at(head, 4) > 0 {
                unread.commits += u64::from(!is_read);
                let committed = std::mem::take(&mut pending);
                if let Some(pages) = &mut pages {
                    pages.extend(committed);
                }
            }
        }
        Ok((unread.commits > 0).then_some(unread))
    }
}

impl std::fmt::Display for UnreadLog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { file, bad_frame, frames, commits, .. } = self;
        let file = file.display();
        if !self.is_loss() {
            return write!(
                f,
                "the last commit in {file} is not whole: the power was cut while it was written, or it was damaged later"
            );
        }
        match bad_frame {
            0 => write!(f, "the header of {file} is damaged: its {commits} commits cannot be read"),
            _ => write!(
                f,
                "frame {bad_frame} of {frames} in {file} is damaged: the last {commits} commits cannot be read"
            ),
        }
    }
}

/// The log of a store.
pub(super) fn path_of(store: &Path) -> PathBuf {
    let mut name = store.as_os_str().to_owned();
    name.push("-wal");
    PathBuf::from(name)
}

/// The size of the pages of a store, as its header states it.
fn page_size_of(store: &Path) -> usize {
    /// Where the header has it, and what new stores have.
    const AT: std::ops::Range<usize> = 16..18;
    const USUAL: usize = 4_096;
    let mut header = [0; 18];
    let is_read = File::open(store).and_then(|mut file| file.read_exact(&mut header)).is_ok();
    let stated = header.get(AT).and_then(|bytes| bytes.try_into().ok()).map_or(0, u16::from_be_bytes);
    let stated = usize::from(stated);
    if is_read && stated.is_power_of_two() && stated >= 512 { stated } else { USUAL }
}

/// Fills a buffer, or returns false if the file ends before.
fn is_filled(file: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<bool> {
    match file.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// The order of the bytes in the words that checksums are made of.
#[derive(Clone, Copy)]
enum Order {
    Big,
    Little,
}

impl Order {
    fn of(header: &[u8]) -> Self {
        if u32_at(header, 0) & 1 == 1 { Self::Big } else { Self::Little }
    }

    /// The checksum of more bytes (SQLite file format, section 4.2).
    fn sum(self, before: [u32; 2], bytes: &[u8]) -> [u32; 2] {
        let word = |bytes: &[u8]| {
            let bytes = bytes.try_into().unwrap_or_default();
            match self {
                Self::Big => u32::from_be_bytes(bytes),
                Self::Little => u32::from_le_bytes(bytes),
            }
        };
        bytes.chunks_exact(8).fold(before, |[mut first, mut second], words| {
            let (one, other) = words.split_at(4);
            first = first.wrapping_add(word(one)).wrapping_add(second);
            second = second.wrapping_add(word(other)).wrapping_add(first);
            [first, second]
        })
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map_or(0, u32::from_be_bytes)
}

fn pair_at(bytes: &[u8], at: usize) -> [u32; 2] {
    [u32_at(bytes, at), u32_at(bytes, at + 4)]
}
