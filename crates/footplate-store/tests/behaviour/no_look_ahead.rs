//! A forecast knows nothing that came after it, nor what light gates saw.

use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_store::score::{
    BASELINES, Forecasters, ReplayContext, ScoredHit, ScoredRecording, score_recording,
};
use footplate_store::{Recording, built_in};

use crate::recordings::{ALL, real};

/// How many beginnings of each log are tried.
const CUTS: usize = 12;

fn track_a() -> Layout {
    built_in("track-a").unwrap().layout
}

fn score(layout: &Layout, recording: &Recording) -> ScoredRecording {
    let context = ReplayContext { layout, turnouts: &[] };
    score_recording(context, recording, None, &mut Forecasters::of_layout(layout)).unwrap()
}

/// The recording as it was after so many events.
fn beginning(recording: &Recording, mut events: usize) -> Recording {
    let mut beginning = recording.clone();
    beginning.runs.retain_mut(|run| {
        let left = events;
        run.events.truncate(left);
        events -= run.events.len();
        left > 0
    });
    beginning
}

/// Everything that was said before the report; the oracle and the hindsight table look ahead by definition.
fn said(hit: &ScoredHit) -> impl PartialEq + std::fmt::Debug {
    (hit.run, hit.line, hit.train, hit.hit, BASELINES.map(|baseline| hit.late_by(baseline)))
}

#[test]
fn the_hits_of_a_beginning_are_the_beginning_of_the_hits() {
    let layout = track_a();
    for file in ALL {
        let recording = real(file);
        let whole = score(&layout, &recording);
        let events: usize = recording.runs.iter().map(|run| run.events.len()).sum();
        for cut in (1..=CUTS).map(|part| events * part / (CUTS + 1)) {
            let beginning = beginning(&recording, cut);
            let last = beginning.runs.iter().flat_map(|run| &run.events).map(|raw| raw.line).max();
            let part = score(&layout, &beginning);
            let told = whole.hits.iter().filter(|hit| Some(hit.line) <= last);
            assert_eq!(part.hits.len(), told.clone().count(), "{file} cut at {cut}");
            for (one, other) in part.hits.iter().zip(told) {
                assert_eq!(said(one), said(other), "{file} cut at {cut}");
            }
        }
    }
}

#[test]
fn the_same_recording_gives_the_same_hits_twice() {
    let layout = track_a();
    for file in ALL {
        let recording = real(file);
        assert_eq!(score(&layout, &recording), score(&layout, &recording), "{file}");
    }
}

#[test]
fn gates_are_a_truth_that_the_estimator_never_sees() {
    let layout = track_a();
    let mut recording = real(ALL[8]);
    let with = score(&layout, &recording);
    // Two laps in each of 29 runs.
    assert_eq!(with.gates.len(), 2 * 29);
    recording.runs.iter_mut().for_each(|run| run.gates.clear());
    let without = score(&layout, &recording);
    assert_eq!(with.hits, without.hits);
    assert!(without.gates.is_empty());
}

#[test]
fn a_train_can_be_scored_alone() {
    let layout = track_a();
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    let only = Some(TrainId(58));
    let scored = score_recording(context, &real(ALL[8]), only, &mut Forecasters::of_layout(&layout)).unwrap();
    assert_eq!((scored.runs, scored.trains()), (6, vec![TrainId(58)]));
}
