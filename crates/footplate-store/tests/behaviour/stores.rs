//! Makes stores in folders of their own, with real recordings in them.

use std::path::PathBuf;

use footplate_core::Timestamp;
use footplate_store::{ContentHash, Import, RecordingKey, Store};
use tempfile::TempDir;

use crate::recordings::{bytes_of, real};

/// A store that vanishes with its folder.
pub(crate) struct Shelf {
    folder: TempDir,
}

impl Shelf {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.file("railway.db")
    }

    pub(crate) fn store(&self) -> Store {
        Store::open_or_create(&self.path()).unwrap()
    }
}

/// The minute `minutes` of a morning in November 2026.
pub(crate) fn minute(minutes: i64) -> Timestamp {
    Timestamp::from_ns((1_795_248_000 + 60 * minutes) * 1_000_000_000)
}

pub(crate) fn import(store: &mut Store, file: &str, now: Timestamp) -> Import {
    store.import(&real(file), ContentHash::of(&bytes_of(file)), "track-a", now).unwrap()
}

pub(crate) fn import_new(store: &mut Store, file: &str, now: Timestamp) -> RecordingKey {
    match import(store, file, now) {
        Import::New { recording } => recording,
        there @ Import::AlreadyThere { .. } => panic!("{file}: {there:?}"),
    }
}
