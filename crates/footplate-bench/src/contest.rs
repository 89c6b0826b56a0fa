//! Operations that do the same, timed in turns.
//!
//! A machine changes its clock and its neighbours within seconds. Operations that are compared therefore take
//! short turns, A B C A B C, and what is quoted is the median of the ratios within each turn. Times are
//! processor time: a neighbour on the same core takes none of it, though it may slow the clock and the caches.

use rustix::time::{ClockId, clock_gettime};

use crate::operation::Operation;

/// Processor time of one turn of one operation: long against reading the clock, short against what changes.
const TURN_S: f64 = 0.02;

/// Turns of each operation.
const TURNS: usize = 31;

/// Seconds of processor time that this process has used.
fn processor_time() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Nanoseconds that one of `count` runs takes.
fn nanoseconds(operation: &mut Operation, count: usize) -> f64 {
    let start = processor_time();
    operation.run(count);
    (processor_time() - start) * 1e9 / count as f64
}

/// How many runs fill a turn.
fn count_for_a_turn(operation: &mut Operation) -> usize {
    let mut count = 64;
    loop {
        let turn = nanoseconds(operation, count) * count as f64 * 1e-9;
        if turn > 0.5 * TURN_S {
            return (count as f64 * TURN_S / turn) as usize + 1;
        }
        count *= 2;
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Runs the operations of each group in turns and prints their times, and their ratio to the first of the group.
///
/// Takes its choice from the command line: only groups whose name contains the first argument that is not an
/// option (`cargo bench` adds some of its own).
pub fn run(mut operations: Vec<Operation>) {
    let chosen = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    operations.retain(|operation| chosen.as_ref().is_none_or(|part| operation.group.contains(part.as_str())));
    println!("{:<44} {:>28} {:>14}", "", "ns: min / median / max", "ratio");
    let mut rest = operations.as_mut_slice();
    while let Some(first) = rest.first() {
        let group = first.group;
        let members = rest.iter().take_while(|operation| operation.group == group).count();
        let (together, after) = rest.split_at_mut(members);
        println!("{group}");
        run_group(together);
        rest = after;
    }
}

fn run_group(operations: &mut [Operation]) {
    let counts: Vec<usize> = operations.iter_mut().map(count_for_a_turn).collect();
    let mut times = vec![Vec::with_capacity(TURNS); operations.len()];
    for _ in 0..TURNS {
        for ((operation, &count), times) in operations.iter_mut().zip(&counts).zip(&mut times) {
            times.push(nanoseconds(operation, count));
        }
    }
    for (operation, own) in operations.iter().zip(&times) {
        let ratios = own.iter().zip(&times[0]).map(|(own, first)| own / first).collect();
        let least = own.iter().copied().fold(f64::INFINITY, f64::min);
        let most = own.iter().copied().fold(0.0, f64::max);
        let figures = format!("{least:.2} / {:.2} / {most:.2}", median(own.clone()));
        println!("  {:<42} {figures:>28} {:>13.2}x", operation.means, median(ratios));
    }
}
