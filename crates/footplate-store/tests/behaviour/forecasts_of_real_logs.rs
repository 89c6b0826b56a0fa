//! How near forecasts come on the recordings of real trains: true numbers, not that two walks agree.

use footplate_core::model::MotionModel;
use footplate_core::tracking::{ForecastPhase, Predictor};
use footplate_core::{DecoderSteps, SpeedStep, TrainId};
use footplate_store::score::{
    Comparison, Forecasters, ReferenceForecaster, ReplayContext, ScoredHit, ScoredRecording, score_recording,
};
use footplate_store::{Run, TrainAtStart, built_in};

use crate::recordings::{ALL, real};

fn scored(files: &[&str]) -> Vec<ScoredRecording> {
    let layout = built_in("track-a").unwrap().layout;
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    let score = |file: &&str| {
        score_recording(context, &real(file), None, &mut Forecasters::of_layout(&layout)).unwrap()
    };
    files.iter().map(score).collect()
}

fn of_phase(logs: &[ScoredRecording], phase: ForecastPhase) -> Comparison {
    let hits: Vec<&ScoredHit> =
        logs.iter().flat_map(|log| &log.hits).filter(|hit| hit.phase() == Some(phase)).collect();
    Comparison::of(hits.iter().copied())
}

#[test]
fn steady_forecasts_are_as_near_as_the_poll_lets_them_be() {
    let all = scored(&ALL);
    // Given 473 reports of trains that run steadily over hops they passed before, half are forecast to 7.7 mm,
    let steady = of_phase(&all, ForecastPhase::Steady);
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
    let first = of_phase(&all, ForecastPhase::FirstLap);
    assert!(first.ours.bias_mm.unwrap().abs() < 3.0, "{:?}", first.ours);
}

#[test]
fn little_is_left_to_learn_of_a_long_log() {
    // Given the one log with more than 40 steady reports, whose runs are steady from the beginning,
    let steady = of_phase(&scored(&ALL[8..]), ForecastPhase::Steady);
    assert!(steady.ours.scored > 390, "{:?}", steady.ours);
    // then knowing all of it beforehand would help by no more than 15 %.
    let ratio = steady.reference(ReferenceForecaster::Oracle).unwrap().ratio().unwrap();
    assert!(ratio <= 1.15, "{ratio}");
}

#[test]
fn a_model_of_126_steps_keeps_them_when_runs_are_fitted() {
    let layout = built_in("track-a").unwrap().layout;
    let (train, every) = (TrainId(24), DecoderSteps::All.highest());
    let mut predictor = Predictor::new(&layout);
    predictor.know(MotionModel::unknown(train, every));
    predictor.begin_run(train, DecoderSteps::Fourteen.highest());
    predictor.end_run();
    assert_eq!(predictor.train(train).unwrap().model().highest(), every);
}

#[test]
fn a_run_is_of_the_only_train_that_moves_beside_trains_at_rest_and_in_live_sessions() {
    let layout = built_in("track-a").unwrap().layout;
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    let score = |change: &dyn Fn(&mut Run)| {
        let mut recording = real(ALL[0]);
        recording.runs.iter_mut().for_each(change);
        let (only, mut forecasters) = (Some(TrainId(1)), Forecasters::of_layout(&layout));
        let scored = score_recording(context, &recording, only, &mut forecasters).unwrap();
        assert_eq!(scored.runs, recording.runs.len());
        scored.hits.len()
    };
    let stands = |train| TrainAtStart { train: TrainId(train), step: SpeedStep::STAND };
    // By awk: 100 sensor rows of train 1 that differ from the row before, some of them bounces.
    let alone = score(&|_| {});
    assert!((80..=100).contains(&alone), "{alone}");
    assert_eq!(score(&|run| run.trains.push(stands(58))), alone, "train 58 stands beside it");
    // A live session names no trains when it begins; the first command shows which one moves.
    let live = score(&|run| {
        assert!(run.trains.iter().all(|at_start| at_start.step == SpeedStep::STAND));
        run.trains.clear();
    });
    assert_eq!(live, alone, "a live session");
}
