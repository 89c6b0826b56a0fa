//! Whether the times of a recording stand in the column of another name.

use footplate_core::Timestamp;

use super::block::{MISSING, TachometerBlock};

/// So many rows are looked at; fewer than the least say nothing.
const ROWS: u32 = 16;
const LEAST_ROWS: u32 = 4;
/// Counts of a running train differ by one from period to period, and go down as often as up; a clock that is set goes
/// back once.
const LEAST_BACK: u32 = 2;
/// At least one step in so many is none forward.
const STEPS_A_FAULT: u32 = 4;

/// Looks at the first rows: times that go up and down beside counts that only go up have changed places.
#[derive(Debug, Default)]
pub(super) struct SwapWatch {
    rows: u32,
    last: Option<(Timestamp, [i64; 2])>,
    /// Steps without progress of time, and those of them that go back.
    not_on: u32,
    back: u32,
    /// Steps in which a count did not grow.
    not_grown: [u32; 2],
}

impl SwapWatch {
    /// Takes in a row of a block; the wheelset whose counts look like times once that is clear.
    #[inline]
    pub(super) fn see(&mut self, block: &TachometerBlock, row: usize) -> Option<usize> {
        // Each run has its own time; the first is enough.
        if self.rows >= ROWS || block.run(row) > 0 { None } else { self.look(block, row) }
    }

    #[cold]
    fn look(&mut self, block: &TachometerBlock, row: usize) -> Option<usize> {
        let time = block.times.get(row).copied().unwrap_or_default();
        let counts = [0, 1].map(|wheel| block.counts[wheel].get(row).copied().unwrap_or(MISSING));
        if let Some((last_time, last_counts)) = self.last.replace((time, counts)) {
            self.not_on += u32::from(time <= last_time);
            self.back += u32::from(time < last_time);
            for ((not_grown, count), last) in self.not_grown.iter_mut().zip(counts).zip(last_counts) {
                *not_grown += u32::from(count <= last || last == MISSING);
            }
        }
        self.rows += 1;
        if self.rows == ROWS { self.verdict() } else { None }
    }

    /// What the rows up to now say, at the end of a recording that has no more.
    pub(super) fn end(&self) -> Option<usize> {
        if self.rows < ROWS { self.verdict() } else { None }
    }

    fn verdict(&self) -> Option<usize> {
        let steps = self.rows.saturating_sub(1);
        let times_are_counts =
            self.rows >= LEAST_ROWS && self.back >= LEAST_BACK && STEPS_A_FAULT * self.not_on >= steps;
        self.not_grown.iter().position(|not_grown| times_are_counts && *not_grown == 0)
    }
}
