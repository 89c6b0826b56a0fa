//! Places for phones: those that say something have one each; the connections that do not are few, and make room for newer ones.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

/// Phones at the same time: more than a club has operators.
const MOST_PHONES: usize = 32;
/// Connections that have said nothing yet. A phone says its name at once.
const MOST_SILENT: usize = 32;

/// The place of a phone, as long as it is kept.
pub(super) type Place = OwnedSemaphorePermit;

/// All places, and the connections without one.
pub(super) struct Places {
    free: Arc<Semaphore>,
    /// By number, those that came first in front.
    silent: Mutex<VecDeque<(u64, Arc<Notify>)>>,
}

impl Places {
    pub(super) fn new() -> Self {
        Self { free: Arc::new(Semaphore::new(MOST_PHONES)), silent: Mutex::default() }
    }

    /// Notes a connection, which has said nothing yet, and returns what wakes it if it must make room. The one that has been silent for
    /// longest must if they are too many.
    pub(super) fn add(&self, number: u64) -> Arc<Notify> {
        let mut silent = self.silent.lock().unwrap_or_else(PoisonError::into_inner);
        let leaves = Arc::new(Notify::new());
        silent.push_back((number, Arc::clone(&leaves)));
        if silent.len() > MOST_SILENT
            && let Some((_, first)) = silent.pop_front()
        {
            first.notify_one();
        }
        leaves
    }

    /// A place for a connection that has said something; `None` if all are taken.
    pub(super) fn take(&self, number: u64) -> Option<Place> {
        self.forget(number);
        Arc::clone(&self.free).try_acquire_owned().ok()
    }

    /// A connection is no longer silent, or has ended.
    pub(super) fn forget(&self, number: u64) {
        self.silent.lock().unwrap_or_else(PoisonError::into_inner).retain(|(silent, _)| *silent != number);
    }
}
