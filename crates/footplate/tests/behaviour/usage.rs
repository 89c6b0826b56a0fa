//! Wrong usage ends with status 2 and says what would be right; a reader that has seen enough is no error.

use std::process::{Command, Stdio};

use crate::program::footplate;

#[test]
fn an_unknown_verb_is_wrong_usage() {
    let run = footplate(&["depart"]);
    assert_eq!(run.status, 2);
    assert!(run.errors.starts_with("error: unrecognized subcommand 'depart'"), "{}", run.errors);
    assert_eq!(run.output, "");
}

#[test]
fn help_shows_the_verbs_and_an_example_for_each() {
    let help = footplate(&["--help"]);
    assert_eq!(help.status, 0);
    let verbs = help.output.lines().skip_while(|line| *line != "Commands:").skip(1);
    let verbs: Vec<_> = verbs
        .map_while(|line| line.strip_prefix("  ")?.split_whitespace().next())
        .filter(|v| *v != "help")
        .collect();
    assert!(verbs.contains(&"completions"), "{}", help.output);
    for verb in verbs {
        let help = footplate(&[verb, "--help"]);
        assert_eq!(help.status, 0);
        assert!(help.output.contains("Example"), "footplate {verb} --help has no example");
    }
}

#[test]
fn completions_name_the_verbs() {
    let run = footplate(&["completions", "bash"]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    assert!(run.output.contains("footplate__subcmd__completions"), "{}", run.output);
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let mut run = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(["completions", "zsh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(run.stdout.take());
    let run = run.wait_with_output().expect("the program ends");
    assert_eq!(String::from_utf8_lossy(&run.stderr), "");
    assert!(run.status.success());
}

#[test]
fn a_value_that_means_nothing_is_refused_with_what_would() {
    for (arguments, says) in [
        (&["doctor", "--link", "sim:track-a", "--seconds", "1e6"][..], "use a time from 1 to 100000 s"),
        (&["simulate", "traffic", "--hours", "nan"], "`nan` is not a number of hours from 0.05 to 10000"),
        (&["simulate", "traffic", "--hours", "0"], "`0` is not a number of hours from 0.05 to 10000"),
    ] {
        let run = footplate(arguments);
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{arguments:?}");
        assert!(run.errors.contains(says), "{arguments:?}: {}", run.errors);
    }
}
