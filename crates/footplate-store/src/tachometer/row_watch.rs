//! What is looked at in every row, whatever the form of its file.

use super::block::TachometerBlock;
use super::columns::{Slot, TachometerColumns};
use super::error::TachometerError;
use super::note::{RowPlace, TachometerNote};
use super::swap_watch::SwapWatch;
use super::time_watch::{TimeFaults, TimeWatch};

/// Looks at every row.
#[derive(Debug, Default)]
pub(super) struct RowWatch {
    times: TimeWatch,
    swap: SwapWatch,
}

impl RowWatch {
    /// Takes in a row of a block, and notes there what is odd.
    #[inline]
    pub(super) fn see(
        &mut self,
        file: &str,
        columns: &TachometerColumns,
        block: &mut TachometerBlock,
        row: usize,
        place: RowPlace,
    ) -> Result<(), TachometerError> {
        let time = block.times.get(row).copied().unwrap_or_default();
        if let Some(oddity) = self.times.see(block.run(row), time) {
            block.notes.push(TachometerNote { place: Some(place), oddity });
        }
        match self.swap.see(block, row) {
            Some(wheel) => Err(swapped(file, columns, wheel)),
            None => Ok(()),
        }
    }

    /// At the end of the recording.
    pub(super) fn end(&self, file: &str, columns: &TachometerColumns) -> Result<(), TachometerError> {
        self.swap.end().map_or(Ok(()), |wheel| Err(swapped(file, columns, wheel)))
    }

    pub(super) fn faults(&self) -> TimeFaults {
        self.times.faults()
    }
}

fn swapped(file: &str, columns: &TachometerColumns, wheel: usize) -> TachometerError {
    let is_count = |slot: &Slot| matches!(slot, Slot::Pulses(of) | Slot::Counter(of) if *of == wheel);
    let at = columns.slots.iter().position(is_count);
    let column = at.and_then(|at| columns.names.get(at)).cloned().unwrap_or_default();
    TachometerError::Swapped { file: file.to_owned(), column }
}
