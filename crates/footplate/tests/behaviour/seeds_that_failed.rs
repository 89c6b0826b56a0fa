//! Simulations that failed once do not fail again: every line of `testdata/seeds.txt` is run.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::program::footplate;

/// As many as the processors of the machine that checks every change: one after another they take as long as all other tests.
const AT_ONCE: usize = 2;
const SEEDS: &str = include_str!("../../../../testdata/seeds.txt");

/// The arguments of a line and the reason why it stands there; nothing for an empty one.
fn entry(line: &str) -> Option<(Vec<&str>, &str)> {
    let (command, reason) = line.split_once('#').unwrap_or((line, ""));
    let arguments: Vec<&str> = command.split_whitespace().collect();
    (!arguments.is_empty()).then_some((arguments, reason.trim()))
}

#[test]
fn seeds_that_failed_once_do_not_fail_again() {
    let lines: Vec<_> =
        (1..).zip(SEEDS.lines()).filter_map(|(number, line)| Some((number, entry(line)?))).collect();
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let run_some = || {
        while let Some((number, (arguments, reason))) = lines.get(next.fetch_add(1, Ordering::Relaxed)) {
            assert!(!reason.is_empty(), "testdata/seeds.txt, line {number}: says no reason after `#`");
            let run = footplate(arguments);
            if run.status != 0 {
                let command = arguments.join(" ");
                let what = format!("line {number}, {reason}: footplate {command}\n{}", run.errors);
                failed.lock().expect("no panic").push(what);
            }
        }
    };
    thread::scope(|scope| (0..AT_ONCE).for_each(|_| drop(scope.spawn(run_some))));
    let failed = failed.into_inner().expect("no panic");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_line_is_a_command_and_a_reason() {
    let line = "simulate driving --seed 7 --law lag   # ran past the end of the track";
    let arguments = vec!["simulate", "driving", "--seed", "7", "--law", "lag"];
    assert_eq!(entry(line), Some((arguments, "ran past the end of the track")));
    assert_eq!((entry("# only a remark"), entry("")), (None, None));
}
