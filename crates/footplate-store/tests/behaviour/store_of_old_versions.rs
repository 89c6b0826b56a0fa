//! A store that an older Footplate made opens, and has everything in it that it had.

use std::fs;
use std::path::Path;

use footplate_core::TrainId;
use footplate_store::{CalibrationKind, Run, StoredRun};

use crate::recordings::{ALL, real};
use crate::stores::{Shelf, minute};

/// The committed stores, one of every version. A new version adds its own and leaves these alone.
const OLD: [&str; 1] = ["store-1.sqlite"];

#[test]
fn every_old_store_opens_with_all_it_had() {
    for file in OLD {
        let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/compat").join(file);
        let shelf = Shelf::new();
        fs::copy(committed, shelf.path()).unwrap();
        let store = shelf.store();
        store.check().unwrap();
        let late = minute(1_000_000);
        let recordings = store.recordings(late).unwrap();
        let counts: Vec<_> =
            recordings.iter().map(|recording| (recording.events, recording.excluded)).collect();
        assert_eq!(counts, [(91, 1), (580, 0)], "{file}");
        let light_gates = store.runs(recordings[1].key, late).unwrap();
        assert_eq!(light_gates.iter().map(StoredRun::accepted).collect::<Vec<Run>>(), real(ALL[8]).runs);
        assert_eq!(
            store.calibration(CalibrationKind::Recordings, TrainId(24), late).unwrap().unwrap().body,
            r#"{"train":24}"#
        );
    }
}
