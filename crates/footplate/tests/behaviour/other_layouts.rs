//! Recordings of another layout than a person says are refused by every command that reads them.

use std::path::Path;

use crate::program::{folder, footplate, testdata};

#[test]
fn a_log_of_track_a_is_refused_as_one_of_track_b() {
    let log = &testdata("sensor-logs/eadanila_2020_track_a.csv");
    let page = Path::new(env!("CARGO_TARGET_TMPDIR")).join("other_layouts.html");
    let out = page.to_str().unwrap();
    for command in [
        vec!["predict", log, "--summary"],
        vec!["calibrate", "--from", log],
        vec!["report", log, "--out", out],
    ] {
        let run = footplate(&[&command[..], &["--layout", "track-b"]].concat());
        assert_eq!(run.status, 2, "{command:?}: {}", run.errors);
        for said in ["not of layout `track-b` but of `track-a`", "C13 to E7", "give --layout track-a"] {
            assert!(run.errors.contains(said), "{command:?}: {}", run.errors);
        }
        assert_eq!(run.output, "", "{command:?}");
    }
    assert!(!page.exists());
}

#[test]
fn a_log_that_is_too_short_to_refuse_is_marked_before_any_figure() {
    // Five laps of track A, on which one of the two distances that differ is certain.
    let log = &testdata("sensor-logs/choochoos_2020_track_a_train1_run.csv");
    let page = Path::new(env!("CARGO_TARGET_TMPDIR")).join("short_log.html");
    let out = page.to_str().unwrap();
    let said = "lengths that are not those of layout `track-b`: D9 to E12 takes as long as 377 mm, not 282";
    for (command, begins) in [
        (vec!["predict", log, "--summary"], "WARNING: "),
        (vec!["calibrate", "--from", log], "WARNING: "),
        (vec!["predict", log, "--summary", "--json"], "{"),
        (vec!["calibrate", "--from", log, "--json"], "{"),
        (vec!["report", log, "--out", out], "WARNING: "),
    ] {
        let run = footplate(&[&command[..], &["--layout", "track-b"]].concat());
        assert_eq!(run.status, 1, "{command:?}: {}", run.errors);
        assert!(run.output.starts_with(begins) && run.output.contains(said), "{command:?}: {}", run.output);
        assert!(!run.errors.contains(said), "said once: {}", run.errors);
    }
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains(&format!("<p class=\"warning\" role=\"alert\">{said}")));
}

#[test]
fn a_train_that_is_driven_on_another_layout_says_so_while_it_runs() {
    // Track B has the sensors and turnouts of track A, on which the simulated trains run; two lengths of this lap differ by 87 and 95 mm.
    let script = folder("driven_elsewhere").join("laps.txt");
    std::fs::write(&script, "turnout all straight\nspeed 24 10\nwait 120s\nstop 24\n").unwrap();
    for (layout, status) in [("track-a", 0), ("track-b", 1)] {
        let script = script.to_str().unwrap();
        let run = footplate(&[
            "drive",
            "--link",
            "sim:track-a?seed=7",
            "--layout",
            layout,
            "--train",
            "24",
            "--script",
            script,
        ]);
        assert_eq!(run.status, status, "{layout}: {}{}", run.output, run.errors);
        let lines: Vec<&str> = run.output.lines().chain(run.errors.lines()).collect();
        let said = lines
            .iter()
            .filter(|line| line.contains("lengths that are not those of layout `track-b`"))
            .count();
        assert_eq!(said, usize::from(layout == "track-b"), "said once: {lines:#?}");
    }
}

#[test]
fn a_store_of_another_layout_is_marked_as_its_files_are_and_no_train_is_called_good() {
    let log = &testdata("sensor-logs/choochoos_2020_track_a_train1_run.csv");
    let folder = folder("stored_elsewhere");
    let (store, page) = (folder.join("railway.db"), folder.join("train1.html"));
    let [store, page] = [&store, &page].map(|path| path.to_str().unwrap());
    let import = footplate(&["store", "import", log, "--store", store, "--layout", "track-b"]);
    assert_eq!(import.status, 0, "{}", import.errors);
    let said = "lengths that are not those of layout `track-b`: D9 to E12 takes as long as 377 mm, not 282";
    for command in [
        vec!["calibrate", "--store", store],
        vec!["report", "--store", store, "--out", page],
        vec!["report", log, "--out", page],
    ] {
        let run = footplate(&[&command[..], &["--layout", "track-b"]].concat());
        assert_eq!(run.status, 1, "{command:?}: {}", run.errors);
        assert!(run.output.contains(said), "{command:?}: {}", run.output);
        if command[0] == "report" {
            let judged = "train 1: wrong, lengths of the layout: D9 → E12: 377 ≠ 282 mm";
            assert!(run.output.contains(judged), "{command:?}: {}", run.output);
            assert!(!run.output.contains("good"), "{command:?}: {}", run.output);
        }
    }
    let script = folder.join("quit.txt");
    std::fs::write(&script, "quit\n").unwrap();
    let link = ["drive", "--link", "sim:track-a?seed=7", "--layout", "track-b", "--store", store];
    let run = footplate(&[&link[..], &["--script", script.to_str().unwrap()]].concat());
    assert!(run.errors.contains(said), "{}{}", run.output, run.errors);
}
