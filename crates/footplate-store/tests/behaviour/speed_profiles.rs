//! Speed profiles of other programs are read with their faults, kept, and written back without losing a byte that is not ours.
//!
//! Roster entries of JMRI here have the form of real ones (Iron-Spike/N-Scale-JMRI, JMRI 4.22) with numbers of our own: the real files
//! carry no licence. They are read where `FOOTPLATE_DATA` says.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use footplate_core::model::{MotionModel, StepUse};
use footplate_core::{Approach, SpeedStep, TrainId};
use footplate_store::{
    HoldOut, LARGEST_PROFILE, ModelRow, MotionReplay, ProfileContext, ProfileNote, SpeedProfile, built_in,
    parse_profile, write_profile_table, write_roster_entry,
};

use crate::stores::{Shelf, minute};

fn context() -> ProfileContext {
    ProfileContext { highest: SpeedStep::new(14).unwrap(), scale: None, loco: None, full_velocity: None }
}

fn testdata(name: &str) -> Vec<u8> {
    fs::read(format!("{}/../../testdata/profiles/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn read(bytes: &[u8]) -> Result<SpeedProfile, String> {
    parse_profile("any.xml", bytes, &context()).map_err(|error| error.to_string())
}

/// The roster entries of real users, if they are at hand.
fn real_entries() -> Vec<PathBuf> {
    let Some(data) = std::env::var_os("FOOTPLATE_DATA") else {
        eprintln!("LEFT OUT: FOOTPLATE_DATA names no folder with roster entries of JMRI");
        return Vec::new();
    };
    let entries = fs::read_dir(PathBuf::from(data).join("jmri-roster")).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "xml"));
    files.sort();
    assert!(!files.is_empty());
    files
}

fn rows() -> Vec<ModelRow> {
    let mut model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).unwrap());
    for step in [5, 8, 11, 14] {
        model.note_use(SpeedStep::new(step).unwrap(), StepUse::Moves);
    }
    let rows = ModelRow::of_model(&model);
    assert_eq!(rows.len(), 4);
    rows
}

#[test]
fn a_roster_entry_is_read_and_what_cannot_be_is_named() {
    let profile = read(&testdata("jmri_learnt.xml")).unwrap();
    assert_eq!(profile.train, Some(TrainId(5012)));
    // Of eight entries one has no speed at all, one is 34 m/s, and one is at rest.
    assert_eq!(profile.speeds.len(), 5);
    assert_eq!(profile.speeds[1].reverse_mm_s, None, "0.0 is not measured");
    let too_fast = |note: &&ProfileNote| matches!(note, ProfileNote::TooFast { line: 39, speed_mm_s } if *speed_mm_s == 34_480.0);
    assert_eq!(profile.notes.iter().filter(too_fast).count(), 1, "{:?}", profile.notes);
    assert!(profile.notes.iter().any(|note| matches!(note, ProfileNote::AtStop { .. })));
    // CV 3 is 4, less 1 by CV 23; CV 4 was never read.
    assert_eq!((profile.speeding_up_s, profile.slowing_down_s), (Some(1.5), None));
}

#[test]
fn an_export_changes_nothing_but_its_own_places_and_is_read_back() {
    let rows = rows();
    let mut entries: Vec<Vec<u8>> = ["jmri_learnt.xml", "jmri_without_profile.xml"].map(testdata).into();
    entries.extend(real_entries().iter().map(|path| fs::read(path).unwrap()));
    for entry in entries {
        for line_end in ["\n", "\r\n"] {
            let text =
                String::from_utf8(entry.clone()).unwrap().replace("\r\n", "\n").replace('\n', line_end);
            let written = write_roster_entry("entry.xml", text.as_bytes(), &rows).unwrap();
            let back = parse_profile("entry.xml", &written, &context()).unwrap();
            assert_eq!(back.speeds.len(), rows.len());
            for (entry, row) in back.speeds.iter().zip(&rows) {
                assert!((entry.forward_mm_s.unwrap() - row.speed_mm_s).abs() < 0.006);
                assert!((entry.uncertainty_mm_s.unwrap() - row.uncertainty_mm_s).abs() < 0.006);
            }
            // Writing again changes nothing at all, so nothing piles up.
            assert_eq!(write_roster_entry("entry.xml", &written, &rows).unwrap(), written);
            // Every line that is not a speed of the old profile is there, in its order.
            let written = String::from_utf8(written).unwrap();
            assert_eq!(written.contains("\r\n"), line_end == "\r\n");
            let mut lines = written.lines();
            let speeds = ["<speed>", "</speed>", "<step>", "<forward>", "<reverse>", "<attributepairs />"];
            for line in text.lines().filter(|line| !speeds.iter().any(|own| line.contains(own))) {
                assert!(lines.any(|found| found == line), "lost: {line}");
            }
        }
    }
}

#[test]
fn a_table_of_our_own_is_read_back() {
    let rows = rows();
    let profile = parse_profile("own.csv", write_profile_table(&rows).as_bytes(), &context()).unwrap();
    assert_eq!(profile.speeds.len(), rows.len());
    for (entry, row) in profile.speeds.iter().zip(&rows) {
        assert!((entry.throttle - row.throttle).abs() < 1e-12);
        assert!((entry.uncertainty_mm_s.unwrap() - row.uncertainty_mm_s).abs() < 0.006);
    }
}

#[test]
fn measuring_tracks_of_rocrail_need_a_scale_and_one_locomotive() {
    let rows = testdata("mvtrack.csv");
    let with = |scale, loco: Option<&str>| {
        let context = ProfileContext { scale, loco: loco.map(str::to_owned), ..context() };
        parse_profile("mvtrack.csv", &rows, &context)
    };
    assert!(with(None, None).unwrap_err().to_string().contains("--scale 87"));
    assert!(with(Some(87.0), None).unwrap_err().to_string().contains("V200, BR 64"));
    let profile = with(Some(87.0), Some("V200")).unwrap();
    // 94 km/h in H0: 94/3.6/87 m/s.
    assert!((profile.speeds[0].forward_mm_s.unwrap() - 300.13).abs() < 0.01);
    assert_eq!((profile.speeds.len(), profile.speeds[1].forward_mm_s), (3, None));
}

#[test]
fn errors_name_the_place_the_value_and_what_would_be_right() {
    let entry = |speeds: &str| {
        format!(
            "<locomotive-config>\n<locomotive id=\"a\">\n<speedprofile><speeds>{speeds}</speeds></speedprofile></locomotive>\n\
             </locomotive-config>"
        )
    };
    let speed = |step: &str, forward: &str| {
        entry(&format!("<speed><step>{step}</step><forward>{forward}</forward></speed>"))
    };
    for (text, says) in [
        (
            speed("1001", "5"),
            "any.xml, line 3, column 36: <step> is `1001`; it should be a throttle setting from 0 to 1000",
        ),
        (speed("500", "-5"), "<forward> is `-5`; it should be a speed in mm/s, 0 or more"),
        (speed("500", "NaN"), "<forward> is `NaN`"),
        (speed("500", "inf"), "<forward> is `inf`"),
        (speed("500", "1e309"), "<forward> is `1e309`"),
        (speed("", "5"), "<step> is ``"),
        (entry("<speed><forward>5</forward></speed>"), "<speed> lacks <step>"),
        (speed("500", "1e308"), "every speed is above 3000 mm/s"),
        (speed("500", "0.0"), "no speed was measured in this profile"),
        ("<roster-config/>".to_owned(), "<roster-config> is not the roster entry of a locomotive"),
        ("<locomotive-config/>".to_owned(), "<locomotive-config> lacks <locomotive>"),
        ("<locomotive-config>\n<locomotive>\n".to_owned(), "any.xml, line 3, column 1"),
        ("<locomotive-config>\n<locomotive".to_owned(), "any.xml, line 2, column 12"),
        ("step,speed\n1,2\n".to_owned(), "not a speed profile; give a roster entry of JMRI"),
        (
            "step,forward_mm_s\n15,20\n".to_owned(),
            "line 2, column 1 (step): `15` should be a step from 0 to 14",
        ),
        (
            "step,forward_mm_s\n5,fast\n".to_owned(),
            "line 2, column 2 (forward_mm_s): `fast` should be a speed in mm/s",
        ),
        (String::new(), "the file is empty"),
    ] {
        let refused = read(text.as_bytes()).unwrap_err();
        assert!(refused.contains(says), "{refused}\nshould say\n{says}");
    }
    // UTF-16, as a text editor may have saved it.
    assert!(read(b"\xff\xfe<\0").unwrap_err().contains("save the file as UTF-8"));
}

#[test]
fn hostile_files_are_refused_without_taking_memory() {
    let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbbbbbb\"><!ENTITY c \"&b;&b;&b;&b;\">]><locomotive-config>&c;</locomotive-config>";
    assert!(read(bomb.as_bytes()).unwrap_err().contains("any.xml, line 1"));
    assert!(read(&"<a>".repeat(1_000_000).into_bytes()).is_err());
    let deep = "<a>".repeat(150_000) + &"</a>".repeat(150_000);
    let deep = format!("<locomotive-config><locomotive>{deep}</locomotive></locomotive-config>");
    assert!(read(deep.as_bytes()).is_err());
    assert!(read(&vec![b'<'; LARGEST_PROFILE + 1]).unwrap_err().contains("longer than"));
    let many = "<speed><step>1</step><forward>5</forward></speed>".repeat(1_002);
    let many = format!(
        "<locomotive-config><locomotive><speedprofile><speeds>{many}</speeds></speedprofile></locomotive></locomotive-config>"
    );
    assert!(read(many.as_bytes()).unwrap_err().contains("more than 1001 speeds"));
}

#[test]
fn a_kept_profile_is_where_a_train_begins_until_it_is_withdrawn() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    let layout = built_in("track-a").unwrap().layout;
    let (train, highest) = (TrainId(24), SpeedStep::new(14).unwrap());
    let table = "step,forward_mm_s,reverse_mm_s\n5,78,80\n8,221,218\n11,411,405\n14,625,622\n";
    let profile = parse_profile("24.csv", table.as_bytes(), &context()).unwrap();
    store.keep_profile(train, Some(&profile), minute(1)).unwrap();
    store.keep_profile(train, None, minute(3)).unwrap();
    let mut speed_at = |at| {
        let replay = MotionReplay::of_store(&layout, &mut store, train, highest, minute(at)).unwrap();
        assert!(replay.is_empty());
        (replay.profile.is_some(), replay.fit.model().speed(SpeedStep::new(11).unwrap(), Approach::Below))
    };
    let [before, with, after] = [0, 2, 4].map(&mut speed_at);
    assert_eq!([before.0, with.0, after.0], [false, true, false]);
    assert!(
        (with.1.value.as_mm_per_s() - 410.0).abs() < 15.0 && with.1.uncertainty < 0.5 * before.1.uncertainty
    );
    assert_eq!(with.1.count, 0, "nothing was measured here");
    assert_eq!(before.1, after.1);
    // The same model as a preview shows.
    let preview = profile.beginning(train, highest).speed(SpeedStep::new(11).unwrap(), Approach::Below);
    assert!((preview.value - with.1.value).as_mm_per_s().abs() < 1e-6);
    assert_eq!(store.profile(train, minute(2)).unwrap().unwrap().speeds, profile.speeds);
}

#[test]
fn half_of_real_profiles_is_predicted_by_the_other_half() {
    // Tables of the teams for the trains of our recordings (testdata/published-tables), one profile for each team and train.
    let mut tables: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    let published = fs::read_to_string(format!(
        "{}/../../testdata/published-tables/speeds.csv",
        env!("CARGO_MANIFEST_DIR")
    ))
    .unwrap();
    for line in published.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        if fields[2] != "above" && fields[7] == "measured" {
            let row = format!("{},{}\n", fields[1], fields[3]);
            tables.entry((fields[4].to_owned(), fields[0].to_owned())).or_default().push(row);
        }
    }
    let mut total = HoldOut::default();
    for rows in tables.values().filter(|rows| rows.len() >= 4) {
        let table = format!("step,forward_mm_s\n{}", rows.concat());
        let Ok(profile) = parse_profile("team.csv", table.as_bytes(), &context()) else { continue };
        total.add(&HoldOut::of(&profile, SpeedStep::new(14).unwrap()));
    }
    println!("published tables: {total:?}");
    assert!(total.predicted >= 50, "{total:?}");
    let share = total.inside as f64 / total.predicted as f64;
    assert!((0.9..=1.0).contains(&share), "{total:?}");
    for path in real_entries() {
        let profile = parse_profile("entry.xml", &fs::read(&path).unwrap(), &context()).unwrap();
        println!("{}: {:?}", path.display(), HoldOut::of(&profile, SpeedStep::new(126).unwrap()));
    }
}
