//! Baselines and hindsight say what a person works out by hand on a loop of three contacts.

use std::path::Path;

use footplate_core::tracking::Verdict;
use footplate_core::{TimeSpan, Timestamp, TrainId};
use footplate_store::score::{
    Forecasters, ReferenceForecaster, ReplayContext, ReplayError, ScoredHit, score_recording,
};
use footplate_store::{LogContext, Recording, parse_layout, parse_sensor_log};

/// 2000 mm around: 400, 600 and 1000.
const LOOP: &str = r#"
format = 1
name = "loop"
length_uncertainty_mm = 10
length_origin = "chosen for the test"
sensors = [{ names = ["A1", "A2"] }, { names = ["B1", "B2"] }, { names = ["C1", "C2"] }]
edges = [
  { from = "A1", to = "B1", mm = 400 },
  { from = "B1", to = "C1", mm = 600 },
  { from = "C1", to = "A1", mm = 1000 },
]
"#;

fn score(log: &str) -> Result<Vec<ScoredHit>, ReplayError> {
    let layout = parse_layout("loop", LOOP.as_bytes()).unwrap().layout;
    let context = LogContext { sensors: &layout, train: None };
    let recording: Recording = parse_sensor_log(Path::new("log.csv"), log.as_bytes(), context).unwrap();
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    score_recording(context, &recording, None, &mut Forecasters::of_layout(&layout)).map(|scored| scored.hits)
}

/// A log of train 24 that has been running at step 8 for long.
fn running(passages: &[(f64, &str)]) -> String {
    let rows = passages.iter().map(|(time, name)| format!("{time:.6},sensor,{name},,\n"));
    format!("t_s,kind,name,train,step\n0,running,,24,8\n{}", rows.collect::<String>())
}

/// How late a hit was by a reference, in ms.
fn late(hit: &ScoredHit, reference: ReferenceForecaster) -> Option<f64> {
    hit.late_by(reference).map(TimeSpan::as_ms)
}

#[test]
fn baselines_learn_from_the_first_lap_on_as_worked_out_by_hand() {
    // Given a lap at 400 mm/s and a second one in which 400 mm take 1.1 s instead of 1.0 s,
    let hits =
        score(&running(&[(0.0, "A1"), (1.0, "B1"), (2.5, "C1"), (5.0, "A1"), (6.1, "B1"), (7.6, "C1")]))
            .unwrap();
    let [first @ .., second_b, second_c] = hits.as_slice() else { panic!("{hits:?}") };
    // then nobody expects anything of the first lap,
    for hit in first {
        assert!(footplate_store::score::BASELINES.iter().all(|reference| hit.late_by(*reference).is_none()));
    }
    let expect = |hit: &ScoredHit, reference: ReferenceForecaster, ms: f64| {
        let found = late(hit, reference).unwrap();
        assert!((found - ms).abs() < 0.01, "{reference}: {found} instead of {ms}");
    };
    // everybody expects 1.0 s of the next hop, by 2000 mm in 5 s or by the hop itself,
    for reference in footplate_store::score::BASELINES {
        expect(second_b, reference, 100.0);
    }
    // and has learnt differently from its 363.64 mm/s: table and lap nothing, so 600 mm take 1.5 s from 6.1 s;
    expect(second_c, ReferenceForecaster::ConstantTable, 0.0);
    expect(second_c, ReferenceForecaster::LastLap, 0.0);
    // 400 − 36.364/256 = 399.858 mm/s: 1.500 53 s (in whole µm/s),
    expect(second_c, ReferenceForecaster::SlowAverage, -0.53);
    // 400 − 3.636 = 396.364 mm/s: 1.513 76 s,
    expect(second_c, ReferenceForecaster::MiddleAverage, -13.76);
    // 400 − 18.182 = 381.818 mm/s: 1.571 43 s.
    expect(second_c, ReferenceForecaster::FastAverage, -71.43);
}

#[test]
fn in_hindsight_an_even_run_holds_no_surprise() {
    let passages = [(0.0, "A1"), (1.0, "B1"), (2.5, "C1"), (5.0, "A1"), (6.0, "B1"), (7.5, "C1")];
    let hits = score(&running(&passages)).unwrap();
    for hit in &hits[1..] {
        assert!(late(hit, ReferenceForecaster::HindsightTable).unwrap().abs() < 3.0, "{hit:?}");
        assert!(late(hit, ReferenceForecaster::Oracle).unwrap().abs() < 40.0, "half a poll at most: {hit:?}");
    }
    assert_eq!(hits[0].late_by(ReferenceForecaster::HindsightTable), None);
}

#[test]
fn the_first_of_a_run_is_a_hit_without_a_forecast() {
    let two = "run,t_s,kind,name,train,step\n1,0,running,,24,8\n1,1,sensor,A1,,\n1,2,sensor,B1,,\n\
               2,0,running,,24,8\n2,1,sensor,A1,,\n2,2,sensor,B1,,\n";
    let hits = score(two).unwrap();
    let verdicts: Vec<_> = hits.iter().map(|hit| (hit.run.0, hit.line, hit.hit.verdict)).collect();
    assert_eq!(
        verdicts,
        [(1, 3, Verdict::First), (1, 4, Verdict::Learnt), (2, 6, Verdict::First), (2, 7, Verdict::Learnt)]
    );
    // The step was unknown in run 1 and known in run 2.
    let forecast: Vec<_> = hits.iter().map(|hit| hit.hit.forecast.is_some()).collect();
    assert_eq!(forecast, [false, false, false, true]);
    assert_eq!(hits[3].reported(), Timestamp::from_s(2.0));
}

#[test]
fn reports_that_no_train_can_be_named_for_are_refused() {
    let none = score("t_s,kind,name,train,step\n0,sensor,A1,,\n").unwrap_err();
    assert_eq!(
        none.to_string(),
        "run 1: no row names a train; begin it with a `running` row that names the train and its step"
    );
    let two =
        score("t_s,kind,name,train,step\n0,running,,24,8\n0,running,,58,8\n1,sensor,A1,,\n").unwrap_err();
    let ReplayError::ManyTrains { trains, .. } = &two else { panic!("{two}") };
    assert_eq!(trains, &[TrainId(24), TrainId(58)]);
    assert!(two.to_string().starts_with("run 1: trains 24, 58 run at once"), "{two}");
}
