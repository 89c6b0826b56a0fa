//! Simulations that failed once do not fail again: every line of `testdata/seeds.txt` is run.

use crate::program::footplate;

const SEEDS: &str = include_str!("../../../../testdata/seeds.txt");

/// The arguments of a line and the reason why it stands there; nothing for an empty one.
fn entry(line: &str) -> Option<(Vec<&str>, &str)> {
    let (command, reason) = line.split_once('#').unwrap_or((line, ""));
    let arguments: Vec<&str> = command.split_whitespace().collect();
    (!arguments.is_empty()).then_some((arguments, reason.trim()))
}

#[test]
fn seeds_that_failed_once_do_not_fail_again() {
    let mut failed = Vec::new();
    for (number, line) in (1..).zip(SEEDS.lines()) {
        let Some((arguments, reason)) = entry(line) else { continue };
        assert!(!reason.is_empty(), "testdata/seeds.txt, line {number}: says no reason after `#`");
        let run = footplate(&arguments);
        if run.status != 0 {
            failed.push(format!(
                "line {number}, {reason}: footplate {}\n{}",
                arguments.join(" "),
                run.errors
            ));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_line_is_a_command_and_a_reason() {
    let line = "simulate driving --seed 7 --law lag   # ran past the end of the track";
    let arguments = vec!["simulate", "driving", "--seed", "7", "--law", "lag"];
    assert_eq!(entry(line), Some((arguments, "ran past the end of the track")));
    assert_eq!((entry("# only a remark"), entry("")), (None, None));
}
