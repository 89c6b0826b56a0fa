//! How near forecasts come on the recordings of real trains: true numbers, not that two walks agree.

use footplate_core::tracking::Phase;
use footplate_store::built_in;
use footplate_store::score::{
    Comparison, Forecasters, ReferenceForecaster, ReplayContext, ScoredHit, ScoredRecording, score_recording,
};

use crate::recordings::{ALL, real};

fn scored(files: &[&str]) -> Vec<ScoredRecording> {
    let layout = built_in("track-a").unwrap().layout;
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    let score = |file: &&str| {
        score_recording(context, &real(file), None, &mut Forecasters::of_layout(&layout)).unwrap()
    };
    files.iter().map(score).collect()
}

fn of_phase(logs: &[ScoredRecording], phase: Phase) -> Comparison {
    let hits: Vec<&ScoredHit> =
        logs.iter().flat_map(|log| &log.hits).filter(|hit| hit.phase() == Some(phase)).collect();
    Comparison::of(hits.iter().copied())
}

#[test]
fn steady_forecasts_are_as_near_as_the_poll_lets_them_be() {
    let all = scored(&ALL);
    // Given 473 reports of trains that run steadily over hops they passed before, half are forecast to 7.7 mm,
    let steady = of_phase(&all, Phase::Steady);
    assert!(steady.ours.scored >= 450, "{:?}", steady.ours);
    assert!(steady.ours.median_abs_mm.unwrap() <= 7.7, "{:?}", steady.ours);
    // the mean, at a poll, is below that of repeating the last lap,
    let lap = steady.reference(ReferenceForecaster::LastLap).unwrap();
    let at_poll = steady.reference(ReferenceForecaster::AtPoll).unwrap();
    assert!(at_poll.score.mean_abs_mm < lap.score.mean_abs_mm, "{:?} {:?}", at_poll.score, lap.score);
    // and intervals hold as often as they say.
    let [half, ninety, all_but_one] = steady.ours.coverage.unwrap();
    for (coverage, stated) in [(half, 0.5), (ninety, 0.9), (all_but_one, 0.99)] {
        let (low, high) = coverage.plausible();
        assert!(low <= stated && stated <= high, "{coverage:?}");
    }
    // First laps are not forecast late or early as a whole.
    let first = of_phase(&all, Phase::FirstLap);
    assert!(first.ours.bias_mm.unwrap().abs() < 3.0, "{:?}", first.ours);
}

#[test]
fn little_is_left_to_learn_of_a_long_log() {
    // Given the one log with more than 40 steady reports, whose runs are steady from the beginning,
    let steady = of_phase(&scored(&ALL[8..]), Phase::Steady);
    assert!(steady.ours.scored > 390, "{:?}", steady.ours);
    // then knowing all of it beforehand would help by no more than 15 %.
    let ratio = steady.reference(ReferenceForecaster::Oracle).unwrap().ratio().unwrap();
    assert!(ratio <= 1.15, "{ratio}");
}
