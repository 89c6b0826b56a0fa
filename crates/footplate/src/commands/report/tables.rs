//! The numbers of a train as tables, for those who print the page or run no scripts.

use footplate_core::Approach;
use footplate_core::calibration::Direction;
use footplate_store::{PollingForm, Quantity, StopForm, TrainForm};

use super::data::{Check, Health};
use crate::commands::web_page::markup::{Table, text};

pub(super) fn health(health: &Health) -> String {
    let mut table = Table::new("How it fares", &["check", "found", "state", "meaning"], &[false; 4]);
    for check in &health.checks {
        let Check { name, found, state, says } = check;
        let badge = format!("<span class=\"state {}\">{}</span>", state.class(), state.word());
        table.row_of_markup(&[text(name), text(found), badge, text(says)]);
    }
    table.end()
}

pub(super) fn speeds(train: &TrainForm) -> String {
    let columns = ["step", "reached from", "speed", "hops", "runs"];
    let mut table = Table::new("Speed by throttle step", &columns, &[true, false, true, true, true]);
    for speed in &train.speeds {
        let Quantity { measurements, .. } = speed.speed;
        table.row(&[
            speed.step.to_string(),
            approach(speed.approach).to_owned(),
            quantity(&speed.speed),
            measurements.to_string(),
            speed.runs.to_string(),
        ]);
    }
    table.end()
}

pub(super) fn laws(train: &TrainForm) -> String {
    if train.laws.is_empty() {
        return "<p>No law of speed change yet: it takes three changes with three contacts each.</p>\n"
            .to_owned();
    }
    let columns =
        ["getting", "law", "pace", "begins after the command", "changes", "held-out error", "verdict"];
    let numbers = &[false, false, true, true, true, true, false];
    let mut table = Table::new("Laws of speed change", &columns, numbers);
    for law in &train.laws {
        let direction = match law.direction {
            Direction::Up => "faster",
            Direction::Down => "slower",
        };
        let verdict = match (law.fits, law.agreed) {
            (true, true) => "explains the contacts",
            (true, false) => "explains them; another law forecasts better by a tenth",
            (false, _) => "no law explains the contacts: the best of those there are",
        };
        table.row(&[
            direction.to_owned(),
            law.best.name.clone(),
            quantity(&law.best.pace),
            quantity(&law.best.delay),
            law.changes.to_string(),
            format!("{:.0} mm", law.best.held_out_mm),
            verdict.to_owned(),
        ]);
    }
    table.end()
}

pub(super) fn stops(stops: &StopForm) -> String {
    let columns = ["step", "from", "distance", "time", "stops", "off the law"];
    let mut table = Table::new("Stops, counted from the command", &columns, &[true; 6]);
    for step in &stops.steps {
        table.row(&[
            step.step.to_string(),
            format!("{:.0} mm/s", step.speed_mm_per_s),
            quantity(&step.distance),
            step.time.as_ref().map_or_else(|| "–".to_owned(), quantity),
            step.distance.measurements.to_string(),
            step.residual_mm.map_or_else(|| "–".to_owned(), |residual| format!("{} mm", signed(residual, 0))),
        ]);
    }
    let law = stops.law.as_ref().map_or_else(String::new, |law| {
        format!(
            "<p>Law: <i>d</i> = <i>τ v</i> + <i>v</i>²/2<i>a</i> with <i>τ</i> = {}, <i>a</i> = {}; it misses the \
             steps by {:.0} mm (rms).</p>\n",
            text(&quantity(&law.delay)),
            text(&quantity(&law.deceleration)),
            law.rms_mm
        )
    });
    table.end() + &law
}

pub(super) fn lengths(train: &TrainForm) -> String {
    let columns = ["from", "to", "surveyed", "to add"];
    let mut table =
        Table::new("Between contacts: the survey, and what to add", &columns, &[false, false, true, true]);
    for section in &train.sections {
        let correction = &section.correction;
        table.row(&[
            section.from.clone(),
            section.to.clone(),
            format!("{:.0} mm", section.surveyed_mm),
            format!("{} ± {:.1} mm", signed(correction.value, 1), correction.uncertainty),
        ]);
    }
    table.end()
}

pub(super) fn suspicious(train: &TrainForm) -> String {
    if train.suspicious.is_empty() {
        return "<p>No measurement was suspicious.</p>\n".to_owned();
    }
    let columns = ["where", "run", "contact", "late", "in way", "chance"];
    let numbers = &[false, true, false, true, true, true];
    let mut table = Table::new("Suspicious measurements, taken out of the fit", &columns, numbers);
    for suspicion in &train.suspicious {
        table.row(&[
            format!("{}:{}", suspicion.recording, suspicion.line),
            suspicion.run.to_string(),
            suspicion.sensor.clone(),
            format!("{} ms", signed(suspicion.late_ms, 0)),
            format!("{} mm", signed(suspicion.late_mm, 0)),
            format!("1 in {:.0e}", 1.0 / suspicion.probability.max(1e-300)),
        ]);
    }
    table.end()
}

pub(super) fn polling(recordings: &[PollingForm]) -> String {
    let columns = ["recording", "idle period", "after a report", "jitter"];
    let mut table =
        Table::new("Recordings, and the rhythm of their polls", &columns, &[false, true, true, true]);
    for polling in recordings {
        table.row(&[
            polling.recording.clone(),
            polling.period.as_ref().map_or_else(|| "no rhythm".to_owned(), quantity),
            format!("{:.2} ms", polling.after_report_ms),
            format!("{:.2} ms", polling.jitter_ms),
        ]);
    }
    table.end()
}

pub(super) const fn approach(approach: Approach) -> &'static str {
    match approach {
        Approach::Below => "below",
        Approach::Above => "above",
        Approach::Unknown => "not recorded",
    }
}

/// `179 ± 12 mm/s²`: two digits of the uncertainty, at most three behind the point.
fn quantity(quantity: &Quantity) -> String {
    let digits = [10.0, 1.0, 0.1].iter().take_while(|place| quantity.uncertainty < **place).count();
    format!("{:.digits$} ± {:.digits$} {}", quantity.value, quantity.uncertainty, quantity.unit)
}

/// With its sign, a true minus.
fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "−")
}
