//! The numbers of a train as tables, for those who print the page or run no scripts.

use footplate_core::Approach;
use footplate_core::model::report::Direction;
use footplate_store::{PollingForm, TrainFindings};

use super::data::{Check, Health, State};
use crate::commands::web_page::Language;
use crate::commands::web_page::markup::{Table, text};

/// A state as a word in its colour.
pub(super) fn badge(state: State, language: Language) -> String {
    format!("<span class=\"state {}\">{}</span>", state.class(), state.word(language))
}

pub(super) fn health(health: &Health, language: Language) -> String {
    let columns =
        language.pick("check | found | state | meaning", "Prüfung | gefunden | Zustand | Bedeutung");
    let mut table = Table::new(language.pick("How it fares", "Wie es ihm geht"), columns, &[false; 4]);
    for check in &health.checks {
        let Check { name, found, state, says } = check;
        table.row_of_markup(&[text(name), text(found), badge(*state, language), text(says)]);
    }
    table.end()
}

pub(super) fn speeds(train: &TrainFindings, language: Language) -> String {
    let columns = language.pick(
        "step | reached from | speed | detections | stopping distance | scatter | stops",
        "Stufe | erreicht von | Tempo | Meldungen | Anhalteweg | Streuung | Halte",
    );
    let caption = language.pick("Speed and stop by throttle step", "Tempo und Halt je Fahrstufe");
    let mut table = Table::new(caption, columns, &[true, false, true, true, true, true, true]);
    for step in train.steps.iter().filter(|step| step.is_measured()) {
        table.row(&[
            step.step.to_string(),
            approach(step.approach, language).to_owned(),
            step.speed.to_string(),
            step.speed.measurements.to_string(),
            step.stop.to_string(),
            format!("{:.0} mm", step.stop_scatter_mm),
            step.stop.measurements.to_string(),
        ]);
    }
    table.end()
}

pub(super) fn laws(train: &TrainFindings, language: Language) -> String {
    if train.laws.is_empty() {
        let none = language.pick(
            "No law of speed change yet: it needs three changes with three sensor reports each.",
            "Noch kein Gesetz für Tempowechsel: es braucht drei Wechsel mit je drei Kontakten.",
        );
        return format!("<p>{none}</p>\n");
    }
    let columns = language.pick(
        "getting | law | pace | begins after the command | changes | held-out error | verdict",
        "wird | Gesetz | Maß | beginnt nach dem Befehl | Wechsel | Fehler an Zurückgehaltenem | Urteil",
    );
    let numbers = &[false, false, true, true, true, true, false];
    let mut table =
        Table::new(language.pick("Laws of speed change", "Gesetze der Tempowechsel"), columns, numbers);
    for law in &train.laws {
        let direction = match law.direction {
            Direction::Up => language.pick("faster", "schneller"),
            Direction::Down => language.pick("slower", "langsamer"),
        };
        let verdict = match (law.fits, law.agreed) {
            (true, true) => language.pick("explains the sensor reports", "erklärt die Kontakte"),
            (true, false) => language.pick(
                "explains them; another law forecasts better by a tenth",
                "erklärt sie; ein anderes sagt um ein Zehntel besser vorher",
            ),
            (false, _) => language.pick(
                "no law explains the sensor reports: the best available",
                "keines erklärt die Kontakte: das beste von allen",
            ),
        };
        table.row(&[
            direction.to_owned(),
            law.best.name.clone(),
            law.best.pace.to_string(),
            law.best.delay.to_string(),
            law.changes.to_string(),
            format!("{:.0} mm", law.best.held_out_mm),
            verdict.to_owned(),
        ]);
    }
    table.end()
}

pub(super) fn stops(train: &TrainFindings, language: Language) -> String {
    if train.stops.is_empty() {
        let none =
            language.pick("No stop was measured with a tape.", "Kein Halt wurde mit dem Maßband gemessen.");
        return format!("<p>{none}</p>\n");
    }
    let columns =
        language.pick("step | from | distance | time | where | run", "Stufe | aus | Weg | Zeit | wo | Fahrt");
    let caption = language.pick(
        "Stops measured with a tape, counted from the command",
        "Mit dem Maßband gemessene Halte, vom Befehl an gezählt",
    );
    let mut table = Table::new(caption, columns, &[true, true, true, true, false, true]);
    for stop in &train.stops {
        table.row(&[
            stop.step.to_string(),
            format!("{:.0} mm/s", stop.speed_mm_per_s),
            format!("{:.0} ± {:.0} mm", stop.distance_mm, stop.uncertainty_mm),
            stop.time_s.map_or_else(|| "–".to_owned(), |time| format!("{time:.2} s")),
            stop.recording.clone(),
            stop.run.to_string(),
        ]);
    }
    table.end()
}

pub(super) fn lengths(train: &TrainFindings, language: Language) -> String {
    let columns = language.pick("from | to | surveyed | to add", "von | bis | vermessen | dazu");
    let caption = language.pick(
        "Between sensors: surveyed lengths and corrections",
        "Zwischen Kontakten: die Vermessung, und was dazukommt",
    );
    let mut table = Table::new(caption, columns, &[false, false, true, true]);
    for section in &train.sections {
        let correction = &section.add;
        table.row(&[
            section.from.clone(),
            section.to.clone(),
            format!("{:.0} mm", section.surveyed_mm),
            format!("{} ± {:.1} mm", signed(correction.value, 1), correction.uncertainty),
        ]);
    }
    table.end()
}

pub(super) fn suspicious(train: &TrainFindings, language: Language) -> String {
    if train.suspicious.is_empty() {
        let none = language.pick("No measurement was suspicious.", "Keine Messung war verdächtig.");
        return format!("<p>{none}</p>\n");
    }
    let columns = language.pick(
        "where | run | sensor | late | distance | chance",
        "wo | Fahrt | Rückmelder | später | als Weg | Zufall",
    );
    let numbers = &[false, true, false, true, true, true];
    let caption = language.pick(
        "Suspicious measurements, of little weight in the fit",
        "Verdächtige Messungen, mit wenig Gewicht im Abgleich",
    );
    let mut table = Table::new(caption, columns, numbers);
    for suspicion in &train.suspicious {
        table.row(&[
            format!("{}:{}", suspicion.recording, suspicion.line),
            suspicion.run.to_string(),
            suspicion.sensor.clone(),
            format!("{} ms", signed(suspicion.late_ms, 0)),
            format!("{} mm", signed(suspicion.late_mm, 0)),
            format!("1 {} {:.0e}", language.pick("in", "zu"), 1.0 / suspicion.probability.max(1e-300)),
        ]);
    }
    table.end()
}

pub(super) fn polling(recordings: &[PollingForm], language: Language) -> String {
    let columns = language.pick(
        "recording | idle period | after a report | jitter",
        "Aufzeichnung | Periode im Leerlauf | nach einer Meldung | Schwankung",
    );
    let caption = language
        .pick("Recordings, and the rhythm of their polls", "Aufzeichnungen, und der Rhythmus ihrer Abfragen");
    let mut table = Table::new(caption, columns, &[false, true, true, true]);
    for polling in recordings {
        table.row(&[
            polling.recording.clone(),
            polling
                .period
                .as_ref()
                .map_or_else(|| language.pick("no rhythm", "kein Rhythmus").to_owned(), ToString::to_string),
            format!("{:.2} ms", polling.after_report_ms),
            format!("{:.2} ms", polling.jitter_ms),
        ]);
    }
    table.end()
}

const fn approach(approach: Approach, language: Language) -> &'static str {
    match approach {
        Approach::Below => language.pick("below", "unten"),
        Approach::Above => language.pick("above", "oben"),
        Approach::Unknown => language.pick("not recorded", "nicht festgehalten"),
    }
}

/// With its sign, a true minus.
fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "−")
}
