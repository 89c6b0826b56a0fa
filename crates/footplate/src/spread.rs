//! Work that is spread over the cores of the machine, with results in order whichever finishes first.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::progress::with_progress;

/// Does `work` for each of the jobs, on so many threads at once or on one for each core, and shows how far it is; the results
/// stand in the order of the jobs.
///
/// # Errors
/// That of the work: the first, and no more work is begun.
pub(crate) fn each<J: Sync, T: Send, E: Send>(
    what: &'static str,
    jobs: &[J],
    threads: Option<NonZeroUsize>,
    work: impl Fn(&J) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let all_cores = || thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    with_progress(what, jobs.len(), |done| {
        spread(jobs.len(), threads.unwrap_or_else(all_cores), |at| {
            let result = work(&jobs[at])?;
            done.fetch_add(1, Ordering::Relaxed);
            Ok(result)
        })
    })
}

/// Does `work` for every number below `count`; the results stand in the order of the numbers. After an error no more
/// work is begun, and of several errors the first counts.
///
/// # Errors
/// That of the work.
fn spread<T: Send, E: Send>(
    count: usize,
    threads: NonZeroUsize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let next = AtomicUsize::new(0);
    let share = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if at >= count {
                return done;
            }
            let result = work(at);
            if result.is_err() {
                next.store(count, Ordering::Relaxed);
            }
            done.push((at, result));
        }
    };
    let mut done: Vec<(usize, Result<T, E>)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.get().min(count)).map(|_| scope.spawn(share)).collect();
        let finished = workers.into_iter().map(|worker| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        finished.flatten().collect()
    });
    done.sort_unstable_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(threads: usize) -> Result<Vec<usize>, usize> {
        spread(100, NonZeroUsize::new(threads).unwrap(), |at| Ok(at * at))
    }

    #[test]
    fn results_stand_in_order_however_many_work() {
        let expected: Vec<usize> = (0..100).map(|at| at * at).collect();
        for threads in [1, 2, 7, 200] {
            assert_eq!(squares(threads), Ok(expected.clone()));
        }
    }

    #[test]
    fn the_first_error_counts() {
        let odd = |at: usize| if at % 2 == 1 && at > 4 { Err(at) } else { Ok(()) };
        assert_eq!(spread(100, NonZeroUsize::MIN, odd), Err(5));
    }
}
