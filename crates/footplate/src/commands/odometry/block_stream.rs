//! Blocks of rows, read on a thread of their own while those before them are worked on.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use footplate_store::{TachometerBlock, TachometerError, TachometerReader};

/// One block is read, one waits, one is worked on.
const BLOCKS: usize = 3;

/// Gives every block of a recording to `work`, in order.
///
/// # Errors
/// What is wrong with the recording, once everything before it has been worked on; or what `work` says.
pub(super) fn each_block(
    reader: TachometerReader,
    mut work: impl FnMut(&TachometerBlock) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let (full, to_work) = sync_channel(BLOCKS);
    let (empty, to_fill) = sync_channel(BLOCKS);
    for _ in 0..BLOCKS {
        let _ = empty.send(TachometerBlock::default());
    }
    // Both ends of the channels are moved in and dropped when `work` has failed, so that the reader ends, too.
    thread::scope(move |scope| {
        scope.spawn(move || fill(reader, &to_fill, &full));
        for block in to_work {
            let block = block?;
            work(&block)?;
            // The reader may have ended.
            let _ = empty.send(block);
        }
        Ok(())
    })
}

/// Fills blocks until the recording ends, something is wrong with it, or its reader has gone.
fn fill(
    mut reader: TachometerReader,
    to_fill: &Receiver<TachometerBlock>,
    full: &SyncSender<Result<TachometerBlock, TachometerError>>,
) {
    for mut block in to_fill {
        let result = match reader.read_block(&mut block) {
            Ok(true) => Ok(block),
            Ok(false) => return,
            Err(error) => Err(error),
        };
        let is_last = result.is_err();
        if full.send(result).is_err() || is_last {
            return;
        }
    }
}
