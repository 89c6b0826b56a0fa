//! Recordings of another layout than a person says are refused by every command that reads them.

use std::path::Path;

use crate::program::footplate;

#[test]
fn a_log_of_track_a_is_refused_as_one_of_track_b() {
    let log =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs/eadanila_2020_track_a.csv");
    let log = log.to_str().unwrap();
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
