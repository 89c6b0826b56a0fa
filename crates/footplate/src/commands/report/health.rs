//! How a train fares: a few numbers, each judged, and the worst of them for the whole train.

use footplate_store::TrainFindings;
use footplate_store::score::Coverage;

use super::data::{Check, ForecastPoint, Health, State};
use crate::commands::web_page::Language;
use crate::layout_check::LengthWarning;

/// So many forecasts are "now" (chosen: two laps of the usual loop).
const NOW: usize = 20;
/// The error now, in units of the usual one, above which a look or a hand is needed (chosen: of 20 values the median
/// is 1.5 times too large by chance once in thirty, twice hardly ever).
const WORSE: [f64; 2] = [1.5, 2.0];
/// Share of detections that may be missed (the recordings that there are miss up to 3 in 100).
const MISSES: [f64; 2] = [0.05, 0.15];
/// Part of runs that may stay without a report: low steps stall.
const SILENT: [f64; 2] = [0.2, 0.5];
/// How far below 90 % the interval's share may lie before it is wrong and not only uncertain.
const COVERAGE_WRONG: f64 = 0.8;

pub(super) fn of(
    train: &TrainFindings,
    points: &[ForecastPoint],
    warning: Option<&LengthWarning>,
    language: Language,
) -> Health {
    let (silent, runs) = (train.silent_runs, train.runs);
    let checks = vec![
        lengths(warning, language),
        error(points, language),
        coverage(points, language),
        drift(points, language),
        misses(points, language),
        Check {
            name: language.pick("Runs without a report", "Fahrten ohne Meldung"),
            found: format!("{silent} {} {runs}", language.pick("of", "von")),
            state: graded(f64::from(silent) / f64::from(runs.max(1)), SILENT),
            says: language.pick(
                "the train stalled, or crept for as long as the run lasted",
                "der Zug blieb liegen oder kroch, solange die Fahrt dauerte",
            ),
        },
    ];
    let state = checks.iter().map(|check| check.state).max().unwrap_or(State::Green);
    let worst: Vec<String> = checks
        .iter()
        .filter(|check| check.state == state && state != State::Green)
        .map(|check| {
            // Nouns keep their capital in German.
            let name = match language {
                Language::English => check.name.to_lowercase(),
                Language::German => check.name.to_owned(),
            };
            format!("{name}: {}", check.found)
        })
        .collect();
    let usual = language.pick("nothing out of the usual", "nichts Ungewöhnliches");
    let summary = if worst.is_empty() { usual.to_owned() } else { worst.join("; ") };
    Health { state, summary, checks }
}

fn lengths(warning: Option<&LengthWarning>, language: Language) -> Check {
    let as_surveyed = language.pick("as in the layout", "wie in der Anlage");
    Check {
        name: language.pick("Lengths of the layout", "Längen der Anlage"),
        found: warning.map_or_else(|| as_surveyed.to_owned(), |warning| warning.differences.clone()),
        state: match warning.map(LengthWarning::is_serious) {
            None => State::Green,
            Some(false) => State::Amber,
            Some(true) => State::Red,
        },
        says: language.pick(
            "times from sensor to sensor against its lengths: where they differ, it may be another layout",
            "Zeiten von Kontakt zu Kontakt gegen ihre Längen: wo sie nicht passen, ist es vielleicht eine andere Anlage",
        ),
    }
}

fn graded(value: f64, [amber, red]: [f64; 2]) -> State {
    match value {
        value if value > red => State::Red,
        value if value > amber => State::Amber,
        _ => State::Green,
    }
}

fn error(points: &[ForecastPoint], language: Language) -> Check {
    let off = |points: &[&ForecastPoint]| {
        let mut off: Vec<f64> = points.iter().filter_map(|point| Some(point.late_mm?.abs())).collect();
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).copied()
    };
    let known: Vec<&ForecastPoint> = points.iter().filter(|point| point.late_mm.is_some()).collect();
    let (usual, now) = (off(&known), off(&known[known.len().saturating_sub(NOW)..]));
    let (found, state) = match usual.zip(now) {
        Some((usual, now)) => {
            let found = match language {
                Language::English => format!("{now:.1} mm now, {usual:.1} mm usually"),
                Language::German => format!("{now:.1} mm jetzt, {usual:.1} mm sonst"),
            };
            (found, graded(now / usual.max(1e-9), WORSE))
        }
        None => {
            let none =
                language.pick("nothing could be forecast yet", "noch konnte nichts vorhergesagt werden");
            (none.to_owned(), State::Amber)
        }
    };
    Check {
        name: language.pick("Prediction error", "Vorhersagefehler"),
        found,
        state,
        says: language.pick(
            "median distance off, of the last 20 forecasts and of all; twice the usual is wrong",
            "wie weit die mittlere daneben lag, der letzten 20 Vorhersagen und aller; das Doppelte ist falsch",
        ),
    }
}

fn coverage(points: &[ForecastPoint], language: Language) -> Check {
    let known = points.iter().filter_map(|point| point.late_ms.zip(point.half_90_ms));
    let (inside, of) =
        known.fold((0, 0), |(inside, of), (late, half)| (inside + usize::from(late.abs() <= half), of + 1));
    let coverage = Coverage { level: 0.9, inside, of };
    let (found, state) = if of == 0 {
        let none = language.pick("no forecast with an interval", "keine Vorhersage mit Intervall");
        (none.to_owned(), State::Amber)
    } else {
        let (low, high) = coverage.plausible();
        let state = match (low <= 0.9 && 0.9 <= high, coverage.fraction() < COVERAGE_WRONG) {
            (true, _) => State::Green,
            (false, false) => State::Amber,
            (false, true) => State::Red,
        };
        let part = 100.0 * coverage.fraction();
        let found = match language {
            Language::English => format!("{part:.0} % of {of} reports"),
            Language::German => format!("{part:.0} % von {of} Meldungen"),
        };
        (found, state)
    };
    Check {
        name: language.pick("Inside the 90 % interval", "Im 90-%-Intervall"),
        found,
        state,
        says: language.pick(
            "good when the count is in keeping with 90 % by chance",
            "gut, wenn die Zahl durch Zufall zu 90 % passt",
        ),
    }
}

fn drift(points: &[ForecastPoint], language: Language) -> Check {
    let alarms = points.iter().filter(|point| point.drift).count();
    let recent = points[points.len().saturating_sub(NOW)..].iter().any(|point| point.drift);
    let state = match (recent, alarms) {
        (true, _) => State::Red,
        (false, 1..) => State::Amber,
        (false, 0) => State::Green,
    };
    let found = match (alarms, language) {
        (0, _) => language.pick("none", "keine").to_owned(),
        (_, Language::English) => {
            format!("{alarms}, {} among the last 20", if recent { "some" } else { "none" })
        }
        (_, Language::German) => {
            format!("{alarms}, {} unter den letzten 20", if recent { "auch" } else { "keine" })
        }
    };
    Check {
        name: language.pick("Drift alarms", "Alarme wegen Abdrift"),
        found,
        state,
        says: language.pick(
            "forecasts went wrong to one side for long",
            "Vorhersagen lagen lange nach einer Seite daneben",
        ),
    }
}

fn misses(points: &[ForecastPoint], language: Language) -> Check {
    let missed: usize = points.iter().map(|point| point.missed).sum();
    Check {
        name: language.pick("Detections missed", "Ausgebliebene Meldungen"),
        found: format!("{missed} {} {}", language.pick("of", "von"), missed + points.len()),
        state: graded(missed as f64 / (missed + points.len()).max(1) as f64, MISSES),
        says: language
            .pick("sensors on the path that never reported", "Rückmelder auf dem Weg, die sich nie meldeten"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(late_mm: f64, missed: usize, drift: bool) -> ForecastPoint {
        ForecastPoint {
            recording: String::new(),
            run: 1,
            line: 2,
            sensor: "A1".into(),
            step: 8,
            phase: Some("steady"),
            missed,
            drift,
            late_ms: Some(late_mm),
            half_90_ms: Some(9.0),
            late_mm: Some(late_mm),
            half_90_mm: Some(9.0),
        }
    }

    #[test]
    fn an_error_that_doubles_is_wrong() {
        let mut points: Vec<ForecastPoint> = (0..100).map(|_| point(4.0, 0, false)).collect();
        assert_eq!(error(&points, Language::English).state, State::Green);
        points.extend((0..20).map(|_| point(-7.0, 0, false)));
        assert_eq!(
            (error(&points, Language::English).state, error(&points, Language::English).found.as_str()),
            (State::Amber, "7.0 mm now, 4.0 mm usually")
        );
        points.extend((0..20).map(|_| point(8.5, 0, false)));
        assert_eq!(error(&points, Language::English).state, State::Red);
        assert_eq!(error(&[], Language::English).state, State::Amber);
    }

    #[test]
    fn coverage_is_judged_by_its_own_chance() {
        // 9 of 10 and 4 of 5 are both in keeping with 90 %; 70 of 100 is not.
        let points = |inside: usize, of: usize| -> Vec<ForecastPoint> {
            (0..of).map(|place| point(if place < inside { 1.0 } else { 20.0 }, 0, false)).collect()
        };
        let states = [(9, 10), (4, 5), (83, 100), (70, 100), (0, 0)]
            .map(|(inside, of)| coverage(&points(inside, of), Language::English).state);
        assert_eq!(states, [State::Green, State::Green, State::Amber, State::Red, State::Amber]);
    }

    #[test]
    fn an_alarm_is_red_as_long_as_it_is_fresh() {
        let mut points = vec![point(1.0, 0, true)];
        assert_eq!(drift(&points, Language::English).state, State::Red);
        points.extend((0..20).map(|_| point(1.0, 1, false)));
        assert_eq!(drift(&points, Language::English).state, State::Amber);
        assert_eq!(
            (misses(&points, Language::English).found.as_str(), misses(&points, Language::English).state),
            ("20 of 41", State::Red)
        );
    }
}
