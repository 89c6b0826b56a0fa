//! The files of a store on a disk that fails, as SQLite sees them: a file system of its own, which SQLite uses in this process from
//! the first story on.
//!
//! Writes are cut short, waits for the disk (`fsync`) fail, and the power goes off between any two of them. The files are real, so
//! that whatever reads a store beside SQLite reads what is left.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Error as IoError, ErrorKind, Read, Result as IoResult, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use anyhow::Context;
use footplate_eval::seeds::Choice;
use sqlite_vfs::wip::{WalIndex, WalIndexLock};
use sqlite_vfs::{DatabaseHandle, LockKind, OpenAccess, OpenKind, OpenOptions, Vfs};

/// The unit that a disk writes as a whole.
const SECTOR: usize = 512;
/// SQLite's shared index of a log, in parts of this size.
const REGION: usize = 32_768;

/// What a disk refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// There is room for so many bytes: the write that needs more is cut short.
    Full(usize),
    /// The wait for the disk fails after so many that succeed. Of what it waited for, some sectors are never written unless they are
    /// written again: an operating system forgets them.
    Unsynced(usize),
    /// After so many operations nothing reaches the files any more: the process has died, or the computer.
    Over(usize),
}

/// All stores that are open, by the paths of their main files.
static DISKS: LazyLock<Mutex<BTreeMap<String, Weak<Mutex<Disk>>>>> = LazyLock::new(Mutex::default);

/// Whether SQLite uses this file system.
static IS_REGISTERED: LazyLock<Result<(), String>> =
    LazyLock::new(|| sqlite_vfs::register("failing", Files, true).map_err(|error| error.to_string()));

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The disk under one store.
#[derive(Clone)]
pub(super) struct StoreDisk {
    /// Where the store is.
    pub(super) path: PathBuf,
    disk: Arc<Mutex<Disk>>,
}

impl StoreDisk {
    /// The disk under the store at a path, which may not exist yet. The seed decides what is lost on it.
    ///
    /// # Errors
    /// SQLite does not take the file system.
    pub(super) fn under(path: &Path, seed: u64) -> anyhow::Result<Self> {
        IS_REGISTERED.clone().map_err(anyhow::Error::msg).context("SQLite takes no other file system")?;
        let disk = disk_of(&path.to_string_lossy());
        locked(&disk).choice = Choice::new(seed);
        Ok(Self { path: path.to_owned(), disk })
    }

    /// From now on it refuses this.
    pub(super) fn fails(&self, fault: Option<Fault>) {
        let mut disk = locked(&self.disk);
        (disk.fault, disk.has_refused) = (fault, false);
    }

    /// Whether it has refused anything since.
    #[cfg(test)]
    pub(super) fn has_refused(&self) -> bool {
        locked(&self.disk).has_refused
    }

    /// The power goes off and on again, after everything is closed: any sector that was not waited for is as it was before.
    ///
    /// # Errors
    /// The files cannot be written.
    pub(super) fn lose_power(&self) -> IoResult<()> {
        let mut disk = locked(&self.disk);
        for (path, sectors) in std::mem::take(&mut disk.unsynced) {
            let Ok(file) = File::options().write(true).open(&path) else { continue };
            for (nth, sector) in sectors {
                if sector.is_forgotten || is_lost(&mut disk.choice) {
                    write_at(&file, &sector.durable, nth * SECTOR as u64)?;
                }
            }
        }
        disk.restart();
        Ok(())
    }

    /// The process has died and its files are closed: what it wrote is there.
    pub(super) fn restart(&self) {
        locked(&self.disk).restart();
    }
}

/// A sector that differs from what the disk would have after a power cut.
struct Unsynced {
    durable: [u8; SECTOR],
    /// Whether the operating system took it for written, and it was not.
    is_forgotten: bool,
}

/// State of a disk.
struct Disk {
    fault: Option<Fault>,
    choice: Choice,
    has_refused: bool,
    /// By path and number.
    unsynced: BTreeMap<String, BTreeMap<u64, Unsynced>>,
    /// Locks of the main file, by the handles that hold them.
    locks: BTreeMap<u64, LockKind>,
    /// The same of each slot of the log's index.
    index_locks: BTreeMap<(u8, u64), WalIndexLock>,
    regions: BTreeMap<u32, Box<[u8; REGION]>>,
    handles: u64,
}

impl Disk {
    const fn new() -> Self {
        Self {
            fault: None,
            choice: Choice::new(0),
            has_refused: false,
            unsynced: BTreeMap::new(),
            locks: BTreeMap::new(),
            index_locks: BTreeMap::new(),
            regions: BTreeMap::new(),
            handles: 0,
        }
    }

    /// Memory is gone with the processes that used the files.
    fn restart(&mut self) {
        (self.fault, self.has_refused) = (None, false);
        self.regions.clear();
        self.locks.clear();
        self.index_locks.clear();
    }

    fn refuse(&mut self, kind: ErrorKind) -> IoError {
        self.has_refused = true;
        kind.into()
    }

    /// Counts an operation, unless nothing reaches the files any more.
    fn operate(&mut self) -> IoResult<()> {
        match &mut self.fault {
            Some(Fault::Over(0)) => Err(self.refuse(ErrorKind::BrokenPipe)),
            Some(Fault::Over(left)) => {
                *left -= 1;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// How much of a write is done.
    fn taken(&mut self, asked: usize) -> usize {
        match &mut self.fault {
            Some(Fault::Full(room)) => {
                let taken = asked.min(*room);
                *room -= taken;
                taken
            }
            _ => asked,
        }
    }

    fn write(&mut self, path: &str, file: &File, bytes: &[u8], at: u64) -> IoResult<()> {
        self.operate()?;
        let taken = self.taken(bytes.len());
        let written = bytes.get(..taken).unwrap_or_default();
        let sectors = self.unsynced.entry(path.to_owned()).or_default();
        for nth in at / SECTOR as u64..(at + taken as u64).div_ceil(SECTOR as u64) {
            if let Some(sector) = sectors.get_mut(&nth) {
                sector.is_forgotten = false;
                continue;
            }
            let mut durable = [0; SECTOR];
            read_at(file, &mut durable, nth * SECTOR as u64)?;
            sectors.insert(nth, Unsynced { durable, is_forgotten: false });
        }
        write_at(file, written, at)?;
        if taken < bytes.len() { Err(self.refuse(ErrorKind::WriteZero)) } else { Ok(()) }
    }

    fn sync(&mut self, path: &str) -> IoResult<()> {
        self.operate()?;
        let sectors = self.unsynced.entry(path.to_owned()).or_default();
        match &mut self.fault {
            Some(Fault::Unsynced(0)) => {
                for sector in sectors.values_mut() {
                    sector.is_forgotten |= is_lost(&mut self.choice);
                }
                return Err(self.refuse(ErrorKind::Other));
            }
            Some(Fault::Unsynced(left)) => *left -= 1,
            _ => {}
        }
        sectors.retain(|_, sector| sector.is_forgotten);
        Ok(())
    }
}

/// Whether a sector that was not waited for is not written.
fn is_lost(choice: &mut Choice) -> bool {
    choice.between(0.0, 1.0) < 0.5
}

/// Fills a buffer from a file; what lies behind its end is zeros. Returns how much the file had.
fn read_at(mut file: &File, buffer: &mut [u8], at: u64) -> IoResult<usize> {
    file.seek(SeekFrom::Start(at))?;
    let mut found = Vec::with_capacity(buffer.len());
    file.take(buffer.len() as u64).read_to_end(&mut found)?;
    let (filled, rest) = buffer.split_at_mut(found.len());
    filled.copy_from_slice(&found);
    rest.fill(0);
    Ok(found.len())
}

fn write_at(mut file: &File, bytes: &[u8], at: u64) -> IoResult<()> {
    file.seek(SeekFrom::Start(at))?;
    file.write_all(bytes)
}

/// The disk under a file of a store.
fn disk_of(path: &str) -> Arc<Mutex<Disk>> {
    let main = path.strip_suffix("-wal").or_else(|| path.strip_suffix("-journal")).unwrap_or(path);
    let mut disks = locked(&DISKS);
    if let Some(disk) = disks.get(main).and_then(Weak::upgrade) {
        return disk;
    }
    disks.retain(|_, disk| disk.strong_count() > 0);
    let disk = Arc::new(Mutex::new(Disk::new()));
    disks.insert(main.to_owned(), Arc::downgrade(&disk));
    disk
}

/// The file system.
struct Files;

impl Vfs for Files {
    type Handle = Handle;

    fn open(&self, path: &str, options: OpenOptions) -> IoResult<Handle> {
        let mut how = File::options();
        how.read(true).write(options.access != OpenAccess::Read);
        match options.access {
            OpenAccess::Create => how.create(true),
            OpenAccess::CreateNew => how.create_new(true),
            OpenAccess::Read | OpenAccess::Write => &mut how,
        };
        let (file, disk) = (how.open(path)?, disk_of(path));
        let mut state = locked(&disk);
        state.handles += 1;
        let number = state.handles;
        drop(state);
        let is_main = options.kind == OpenKind::MainDb;
        Ok(Handle { path: path.to_owned(), file, disk, number, is_main })
    }

    fn delete(&self, path: &str) -> IoResult<()> {
        let disk = disk_of(path);
        let mut disk = locked(&disk);
        disk.operate()?;
        disk.unsynced.remove(path);
        fs::remove_file(path)
    }

    fn exists(&self, path: &str) -> IoResult<bool> {
        fs::exists(path)
    }

    fn temporary_name(&self) -> String {
        let nth = locked(&DISKS).len();
        std::env::temp_dir()
            .join(format!("footplate-{}-{nth}", std::process::id()))
            .to_string_lossy()
            .into_owned()
    }

    fn random(&self, buffer: &mut [i8]) {
        // A log's salt: any will do, and the same one is the same story.
        buffer.iter_mut().zip(1..).for_each(|(byte, nth)| *byte = nth);
    }

    fn sleep(&self, duration: Duration) -> Duration {
        std::thread::sleep(duration);
        duration
    }
}

/// An open file.
struct Handle {
    path: String,
    file: File,
    disk: Arc<Mutex<Disk>>,
    number: u64,
    is_main: bool,
}

impl Handle {
    /// The strictest lock that another handle holds.
    fn strictest_other(&self, disk: &Disk) -> Option<LockKind> {
        let others = disk.locks.iter().filter(|(number, _)| **number != self.number);
        others.map(|(_, lock)| *lock).max_by_key(|lock| *lock as i32)
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        let mut disk = locked(&self.disk);
        disk.locks.remove(&self.number);
        disk.index_locks.retain(|(_, number), _| *number != self.number);
        if self.is_main && disk.locks.is_empty() {
            disk.regions.clear();
        }
    }
}

impl DatabaseHandle for Handle {
    type WalIndex = Index;

    fn size(&self) -> IoResult<u64> {
        Ok(self.file.metadata()?.len())
    }

    fn read_exact_at(&mut self, buffer: &mut [u8], offset: u64) -> IoResult<()> {
        let filled = read_at(&self.file, buffer, offset)?;
        if filled < buffer.len() { Err(ErrorKind::UnexpectedEof.into()) } else { Ok(()) }
    }

    fn write_all_at(&mut self, bytes: &[u8], offset: u64) -> IoResult<()> {
        locked(&self.disk).write(&self.path, &self.file, bytes, offset)
    }

    fn sync(&mut self, _: bool) -> IoResult<()> {
        locked(&self.disk).sync(&self.path)
    }

    fn set_len(&mut self, size: u64) -> IoResult<()> {
        let mut disk = locked(&self.disk);
        disk.operate()?;
        if let Some(sectors) = disk.unsynced.get_mut(&self.path) {
            sectors.retain(|nth, _| nth * (SECTOR as u64) < size);
        }
        self.file.set_len(size)
    }

    fn lock(&mut self, lock: LockKind) -> IoResult<bool> {
        let mut disk = locked(&self.disk);
        let other = self.strictest_other(&disk).unwrap_or(LockKind::None);
        let own = disk.locks.get(&self.number).copied().unwrap_or(LockKind::None);
        let is_taken = match lock {
            LockKind::None => {
                disk.locks.remove(&self.number);
                return Ok(true);
            }
            LockKind::Shared => {
                own == LockKind::None && matches!(other, LockKind::Pending | LockKind::Exclusive)
            }
            LockKind::Reserved | LockKind::Pending => !matches!(other, LockKind::None | LockKind::Shared),
            LockKind::Exclusive => other != LockKind::None,
        };
        if !is_taken {
            disk.locks.insert(self.number, lock);
        }
        Ok(!is_taken)
    }

    fn reserved(&mut self) -> IoResult<bool> {
        Ok(locked(&self.disk).locks.values().any(|lock| !matches!(lock, LockKind::None | LockKind::Shared)))
    }

    fn current_lock(&self) -> IoResult<LockKind> {
        Ok(locked(&self.disk).locks.get(&self.number).copied().unwrap_or(LockKind::None))
    }

    fn wal_index(&self, _: bool) -> IoResult<Index> {
        Ok(Index { disk: Arc::clone(&self.disk), number: self.number })
    }
}

/// The index of a log, which the connections to a store share.
struct Index {
    disk: Arc<Mutex<Disk>>,
    number: u64,
}

impl WalIndex for Index {
    fn map(&mut self, region: u32) -> IoResult<[u8; REGION]> {
        Ok(**locked(&self.disk).regions.entry(region).or_insert_with(|| Box::new([0; REGION])))
    }

    fn lock(&mut self, slots: Range<u8>, lock: WalIndexLock) -> IoResult<bool> {
        let mut disk = locked(&self.disk);
        let is_free = disk.index_locks.iter().all(|((slot, number), held)| {
            !slots.contains(slot)
                || *number == self.number
                || match lock {
                    WalIndexLock::None => true,
                    WalIndexLock::Shared => *held != WalIndexLock::Exclusive,
                    WalIndexLock::Exclusive => false,
                }
        });
        for slot in slots.filter(|_| is_free) {
            match lock {
                WalIndexLock::None => disk.index_locks.remove(&(slot, self.number)),
                _ => disk.index_locks.insert((slot, self.number), lock),
            };
        }
        Ok(is_free)
    }

    fn delete(self) -> IoResult<()> {
        locked(&self.disk).regions.clear();
        Ok(())
    }

    fn pull(&mut self, region: u32, data: &mut [u8; REGION]) -> IoResult<()> {
        if let Some(shared) = locked(&self.disk).regions.get(&region) {
            *data = **shared;
        }
        Ok(())
    }

    fn push(&mut self, region: u32, data: &[u8; REGION]) -> IoResult<()> {
        locked(&self.disk).regions.insert(region, Box::new(*data));
        Ok(())
    }
}
