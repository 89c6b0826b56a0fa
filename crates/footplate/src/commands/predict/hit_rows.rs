//! Every hit on a line: what was forecast, what came, how far off it was.

use std::io::Write;

use footplate_core::track::Layout;
use footplate_core::tracking::Verdict;
use footplate_store::score::ScoredHit;
use footplate_store::score::ScoredRecording;

use super::figures::PHASES;

/// The level of the interval that a row shows.
const SHOWN_LEVEL: f64 = 0.9;

/// Writes all hits of a recording.
pub(super) fn write(
    output: &mut dyn Write,
    layout: &Layout,
    recording: &ScoredRecording,
) -> std::io::Result<()> {
    writeln!(output, "{}", recording.name)?;
    writeln!(
        output,
        " run train step  sensor  phase     forecast s  reported s   late ms  late mm  90 % ±ms"
    )?;
    for hit in &recording.hits {
        writeln!(output, "{}", row(layout, hit).trim_end())?;
    }
    writeln!(output)
}

fn row(layout: &Layout, hit: &ScoredHit) -> String {
    let sensor = layout.sensor_name(hit.hit.passage.sensor);
    let head = format!("{:>4} {:>5} {:>4}  {sensor:<7}", hit.run, hit.train, hit.step().get());
    let reported = hit.reported().as_s();
    let (Some(forecast), Some(late)) = (hit.hit.forecast, hit.late()) else {
        return format!("{head} {:<9} {:>10}  {reported:>10.3} {:>29}  {}", "", "–", "", notes(layout, hit));
    };
    let phase = PHASES.iter().find(|(phase, ..)| *phase == forecast.phase).map_or("", |(_, name, _)| name);
    let (low, high) = forecast.interval(SHOWN_LEVEL);
    format!(
        "{head} {phase:<9} {:>10.3}  {reported:>10.3} {:>9.1} {:>8.1} {:>9.1}{} {}",
        forecast.time.as_s(),
        late.as_ms(),
        hit.distance_mm(late).unwrap_or_default(),
        (high - low).as_ms() / 2.0,
        if (low..=high).contains(&hit.reported()) { ' ' } else { '!' },
        notes(layout, hit),
    )
}

/// What is not as it mostly is.
fn notes(layout: &Layout, hit: &ScoredHit) -> String {
    let verdict = match hit.hit.verdict {
        Verdict::First => Some("first".to_owned()),
        Verdict::Learnt if hit.hit.forecast.is_none() => Some("step not met before".to_owned()),
        Verdict::Learnt => None,
        Verdict::Rejected => Some("rejected".to_owned()),
        Verdict::Reopened => Some("learning anew".to_owned()),
    };
    let other = hit.hit.named.filter(|named| *named != hit.hit.passage.sensor);
    let instead = other.map(|named| format!("not {}", layout.sensor_name(named)));
    let drift = hit.hit.drift.map(|drift| format!("{drift:?}").to_lowercase());
    let drift = drift.map(|side| format!("drifts {side}"));
    verdict.into_iter().chain(instead).chain(drift).collect::<Vec<_>>().join(", ")
}
