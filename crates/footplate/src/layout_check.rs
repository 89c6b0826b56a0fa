//! Recordings beside the layout that a person says they are of: refused if they are of another one.

use std::cell::OnceCell;
use std::rc::Rc;

use anyhow::bail;
use footplate_core::model::survey::{LayoutTest, SectionIndex, SurveyTest};
use footplate_core::track::{Hop, HopId, Layout, SequenceVerdict, StrayReport};
use footplate_core::{Event, EventKind, Length, SensorId};
use footplate_store::{BUILT_IN, Batch, Direction, Run, built_in};

use crate::commands::Outcome;
use crate::runtime::Recorder;

/// A length of another layout explains a path length if it is so near: curves and surveys account for it.
const EXPLAINED: Length = Length::from_mm(40.0);

/// Two lengths that are those of the other layout, and not of the one that was said, are no chance.
const FEWEST_EXPLAINED: usize = 2;

/// Trains of every scale run at 20 to 1500 mm/s. Speeds that are all outside of this (mm/s) are of another unit.
const PLAUSIBLE_MM_PER_S: std::ops::Range<f64> = 2.0..10_000.0;

/// Fewer speeds than these may be of a train that stood.
const FEWEST_SPEEDS: usize = 4;

/// Lengths that are all off by this many times what a layout says of them may be those of another (chosen: of 43
/// short recordings of simulated trains on their own layout five are off by 2 times, by its curves and its survey, none by 3).
const ANOTHER_LAYOUT: f64 = 3.0;

/// Lengths are compared first when a session has so many reports of sensors (chosen: a lap of two trains).
const COMPARED_FIRST: usize = 24;
/// ... and again when it has this part more, so that a long session does not compare all of its reports the more often.
const COMPARED_AGAIN: usize = 8;

/// More contradictions than these tell a person nothing new.
const MOST_SAID: usize = 4;

/// What a person has to know before any figure: the lengths may not be those of the layout.
#[derive(Debug)]
pub(crate) struct LengthWarning {
    pub(crate) english: String,
    pub(crate) german: String,
    /// The lengths without a sentence about them, for an alarm.
    pub(crate) differences: String,
    /// Whether the figures fall short: it may be another layout. Otherwise the survey is less accurate than it says, and the
    /// uncertainties say so.
    is_serious: bool,
}

impl LengthWarning {
    /// Whether it may be another layout.
    pub(crate) const fn is_serious(&self) -> bool {
        self.is_serious
    }

    /// What a command comes to that has this warning, or none.
    pub(crate) fn outcome(warning: Option<&Self>) -> Outcome {
        if warning.is_some_and(|warning| warning.is_serious) { Outcome::FallsShort } else { Outcome::Done }
    }
}

/// Checks runs against a layout; the warning goes into the headline of what is made of them.
///
/// # Errors
/// The times are not in seconds. Or the runs are of another layout: sensors follow each other that no rails join, or the lengths are those of another
/// built-in layout. The message names the sensors, and what to do.
pub(crate) fn check_runs<'r>(
    layout: &Layout,
    runs: impl Iterator<Item = &'r Run>,
) -> anyhow::Result<Option<LengthWarning>> {
    let sections = SectionIndex::of(layout);
    let lengths = tested(layout, &sections, runs)?;
    Ok(lengths_doubted(layout, &sections, &lengths))
}

/// Checks what a model is made of against its layout: recordings of a store as well as files.
///
/// # Errors
/// As for [`check_runs`], but for the unit of time.
pub(crate) fn check_batch(layout: &Layout, batch: &Batch) -> anyhow::Result<Option<LengthWarning>> {
    let lengths = batch.survey_test();
    refuse_another_layout(layout, &batch.sections, &batch.layout_test.sequence(), &lengths)?;
    Ok(lengths_doubted(layout, &batch.sections, &lengths))
}

/// What a person has to know of the lengths that trains were measured with.
pub(crate) fn lengths_warning(layout: &Layout, lengths: &SurveyTest) -> Option<LengthWarning> {
    lengths_doubted(layout, &SectionIndex::of(layout), lengths)
}

/// How the lengths of a layout compare with its runs.
fn tested<'r>(
    layout: &Layout,
    sections: &SectionIndex,
    runs: impl Iterator<Item = &'r Run>,
) -> anyhow::Result<SurveyTest> {
    let mut test = LayoutTest::default();
    let mut speeds = Vec::new();
    for run in runs {
        speeds.extend(mean_speeds(layout, run));
        test.take_run(layout, sections, run.moving().len(), run.events.iter().map(|raw| &raw.event));
    }
    let (order, lengths) = (test.sequence(), test.lengths(sections));
    // Times in another unit make no lengths of another layout.
    if let Some(contradiction) = speeds_contradict(layout, speeds)
        && order == SequenceVerdict::Fits
    {
        bail!(contradiction);
    }
    refuse_another_layout(layout, sections, &order, &lengths)?;
    Ok(lengths)
}

/// Fails if sensors follow each other that no rails join, or if lengths are those of another built-in layout.
fn refuse_another_layout(
    layout: &Layout,
    sections: &SectionIndex,
    order: &SequenceVerdict,
    lengths: &SurveyTest,
) -> anyhow::Result<()> {
    if let Some(contradiction) = order_contradicts(layout, order) {
        bail!(contradiction);
    }
    let odd = odd_hops(layout, sections, lengths);
    if let Some(other) = layout_with(layout, &odd) {
        let [said, ..] = lengths_said(layout, &odd);
        bail!(
            "the recordings are not of layout `{}` but of `{other}`: {said}; give --layout {other}",
            layout.name()
        );
    }
    Ok(())
}

/// The mean speeds of a run between neighbouring sensors, in mm/s; none on a layout with unknown lengths.
fn mean_speeds(layout: &Layout, run: &Run) -> impl Iterator<Item = f64> {
    let mut before = None;
    run.events.iter().filter(|_| layout.is_measured()).filter_map(move |raw| {
        let EventKind::Sensor(report) = raw.event.kind else { return None };
        let (from, left) = before.replace((report.sensor, raw.event.time))?;
        let mut hops = hops_after(layout, from);
        let hop = hops.find(|hop| hop.sensor.is_some_and(|passed| layout.may_mean(report.sensor, passed)))?;
        let took = (raw.event.time - left).as_s();
        (took > 0.0 && hop.length > Length::ZERO).then(|| hop.length.as_mm() / took)
    })
}

/// The message where times and lengths make no speed of a model train, not even the fastest or the slowest tenth.
fn speeds_contradict(layout: &Layout, mut speeds: Vec<f64>) -> Option<String> {
    speeds.sort_by(f64::total_cmp);
    let tenth = speeds.len() / 10;
    let slow = *speeds.get(tenth).filter(|_| speeds.len() >= FEWEST_SPEEDS)?;
    // Trains that rest between sensors are slower than any step; others of the same recording are not.
    let fast = *speeds.iter().rev().nth(tenth)?;
    (fast < PLAUSIBLE_MM_PER_S.start || slow > PLAUSIBLE_MM_PER_S.end).then(|| {
        format!(
            "the recordings are not in seconds, or layout `{}` is not in millimetres: trains would run at {slow:.3} to \
             {fast:.3} mm/s from sensor to sensor; correct the unit",
            layout.name()
        )
    })
}

/// The serious warning of a session that runs, once there is one.
pub(crate) type LiveWarning = Rc<OnceCell<LengthWarning>>;

/// Watches a session: ends it if the reports are not of the layout on which trains are driven, and warns of its lengths.
pub(crate) struct LayoutWatch<'l> {
    layout: &'l Layout,
    sections: SectionIndex,
    test: LayoutTest,
    reports: usize,
    /// The reports with which lengths are compared next.
    compares_at: usize,
    warning: LiveWarning,
    /// Who writes the entries down, before they are judged.
    recorder: Option<&'l mut dyn Recorder>,
}

impl<'l> LayoutWatch<'l> {
    /// A session with so many trains begins; all of them are at rest.
    pub(crate) fn new(layout: &'l Layout, trains: usize, recorder: Option<&'l mut dyn Recorder>) -> Self {
        let mut test = LayoutTest::default();
        test.begin_run_at_rest(trains);
        let sections = SectionIndex::of(layout);
        let (reports, compares_at) = (0, COMPARED_FIRST);
        Self { layout, sections, test, reports, compares_at, warning: LiveWarning::default(), recorder }
    }

    /// Where a serious warning will be.
    pub(crate) fn warning(&self) -> LiveWarning {
        Rc::clone(&self.warning)
    }

    fn compare_lengths(&mut self) {
        self.compares_at = self.reports + COMPARED_FIRST.max(self.reports / COMPARED_AGAIN);
        if self.warning.get().is_none()
            && let Some(warning) = self.lengths_doubted().filter(|warning| warning.is_serious)
        {
            self.warning.get_or_init(|| warning);
        }
    }

    /// What all lengths of the session come to.
    pub(crate) fn lengths_doubted(&self) -> Option<LengthWarning> {
        lengths_doubted(self.layout, &self.sections, &self.test.lengths(&self.sections))
    }
}

impl Recorder for LayoutWatch<'_> {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        if let Some(recorder) = &mut self.recorder {
            recorder.record(events)?;
        }
        for event in events {
            self.test.take(self.layout, &self.sections, event);
            self.reports += usize::from(matches!(event.kind, EventKind::Sensor(_)));
        }
        if self.reports >= self.compares_at {
            self.compare_lengths();
        }
        match order_contradicts(self.layout, &self.test.sequence()) {
            Some(contradiction) => bail!(contradiction),
            None => Ok(()),
        }
    }

    fn record_direction(&mut self, direction: Direction) {
        if let Some(recorder) = &mut self.recorder {
            recorder.record_direction(direction);
        }
    }
}

/// What a person reads where sensors follow each other that no rails join.
fn order_contradicts(layout: &Layout, verdict: &SequenceVerdict) -> Option<String> {
    let SequenceVerdict::Contradicts { stray, reports } = verdict else { return None };
    let times: u32 = stray.iter().map(|one| one.times).sum();
    let said: Vec<String> = stray.iter().take(MOST_SAID).map(|one| stray_said(layout, one)).collect();
    let more = if stray.len() > MOST_SAID { ", and others" } else { "" };
    Some(format!(
        "the reports are not of layout `{}`: {times} of {reports} sensors cannot follow the one before: {}{more}; give the \
         layout that was recorded with --layout, or correct its edges",
        layout.name(),
        said.join(", ")
    ))
}

fn stray_said(layout: &Layout, stray: &StrayReport) -> String {
    let times = if stray.times == 1 { "once".to_owned() } else { format!("{} times", stray.times) };
    let Some(after) = stray.after else {
        return format!("sensor {} is not on it ({times})", stray.seen);
    };
    let next: Vec<&str> = followers(layout, after);
    let name = layout.sensor_name(after);
    let only = if next.is_empty() {
        "the track ends there".to_owned()
    } else {
        format!("next is {}", next.join(" or "))
    };
    format!("{} after {name} {times} ({only})", layout.sensor_name(stray.seen))
}

/// The hops from a sensor, in both directions where it does not report the direction.
fn hops_after(layout: &Layout, sensor: SensorId) -> impl Iterator<Item = Hop<'_>> {
    let nodes = layout.meanings(sensor).filter_map(|meant| layout.sensor_node(meant));
    nodes.flat_map(|node| layout.hops_from(node))
}

/// The sensors that may come right after one.
fn followers(layout: &Layout, sensor: SensorId) -> Vec<&str> {
    let hops = hops_after(layout, sensor);
    let mut names: Vec<&str> = hops.filter_map(|hop| Some(layout.sensor_name(hop.sensor?))).collect();
    names.dedup();
    names
}

/// Hops that are not as long as the layout says: the length there, and the path length.
fn odd_hops(layout: &Layout, sections: &SectionIndex, lengths: &SurveyTest) -> Vec<(HopId, Length, Length)> {
    let hop_of = |section| layout.hops().find(|hop| sections.section(hop.id) == Some(section));
    let odd = lengths.odd.iter();
    odd.filter_map(|odd| {
        Some((hop_of(odd.section)?.id, Length::from_m(odd.surveyed), Length::from_m(odd.path_length)))
    })
    .collect()
}

/// What a person reads where lengths are not those of the layout, but no other is known that has them.
fn lengths_doubted(layout: &Layout, sections: &SectionIndex, lengths: &SurveyTest) -> Option<LengthWarning> {
    if lengths.is_passed() {
        return None;
    }
    let name = layout.name();
    let odd = odd_hops(layout, sections, lengths);
    if odd.is_empty() {
        let (factor, scale) = (lengths.factor, 100.0 * lengths.scale);
        return Some(LengthWarning {
            english: format!(
                "the lengths of layout `{name}` are off by about {factor:.0} times what it says (length_uncertainty_mm): they \
                 are estimated together with speeds, which may all be off by {scale:.0} %; is it the right layout?"
            ),
            german: format!(
                "die Längen der Anlage `{name}` sind um etwa das {factor:.0}-Fache dessen falsch, was sie angibt \
                 (length_uncertainty_mm): sie werden zusammen mit den Tempi geschätzt, die alle um {scale:.0} % falsch sein \
                 können; ist es die richtige Anlage?"
            ),
            differences: format!("{factor:.0} × length_uncertainty_mm"),
            is_serious: factor >= ANOTHER_LAYOUT,
        });
    }
    let [english, german, differences] = lengths_said(layout, &odd);
    Some(LengthWarning {
        english: format!("lengths that are not those of layout `{name}`: {english}; is it the right layout?"),
        german: format!(
            "Längen, die nicht die der Anlage `{name}` sind: {german}; ist es die richtige Anlage?"
        ),
        differences,
        is_serious: true,
    })
}

/// Path lengths beside those of the layout: in English, in German, and in neither.
fn lengths_said(layout: &Layout, odd: &[(HopId, Length, Length)]) -> [String; 3] {
    let said = odd.iter().take(MOST_SAID).filter_map(|(hop, surveyed, found)| {
        let hop = layout.hop(*hop)?;
        let (from, to) = (layout.node_name(hop.from), layout.node_name(hop.to));
        let (surveyed, found) = (surveyed.as_mm(), found.as_mm());
        Some([
            format!("{from} to {to} takes as long as {found:.0} mm, not {surveyed:.0}"),
            format!("{from} bis {to} dauert so lange wie {found:.0} mm, nicht {surveyed:.0}"),
            format!("{from} → {to}: {found:.0} ≠ {surveyed:.0} mm"),
        ])
    });
    let said: Vec<[String; 3]> = said.collect();
    [0, 1, 2].map(|form| said.iter().map(|one| one[form].as_str()).collect::<Vec<_>>().join(", "))
}

/// Another built-in layout with the path lengths.
pub(crate) fn layout_with(layout: &Layout, hops: &[(HopId, Length, Length)]) -> Option<&'static str> {
    BUILT_IN.iter().copied().filter(|name| *name != layout.name()).find(|name| {
        let Ok(other) = built_in(name) else { return false };
        // Early in a session one or the other length is still wrong.
        let explained = hops.iter().filter(|(hop, surveyed, path_length)| {
            let Some(hop) = layout.hop(*hop) else { return false };
            let ends = [hop.from, hop.to].map(|node| other.layout.node_named(layout.node_name(node)));
            let [Some(from), Some(to)] = ends else { return false };
            let there = other.layout.hops_from(from).find(|other| other.to == to);
            let is_nearer =
                |there: Length| (there - *path_length).abs() < 0.5 * (*surveyed - *path_length).abs();
            there.is_some_and(|there| {
                (there.length - *path_length).abs() <= EXPLAINED && is_nearer(there.length)
            })
        });
        explained.count() >= FEWEST_EXPLAINED
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use footplate_store::{LogContext, parse_sensor_log};

    use super::*;

    fn check(log: &str, layout: &str) -> anyhow::Result<SurveyTest> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs").join(log);
        let layout = built_in(layout)?.layout;
        let mut input = std::io::BufReader::new(std::fs::File::open(&path)?);
        let recording = parse_sensor_log(&path, &mut input, LogContext { sensors: &layout, train: None })?;
        tested(&layout, &SectionIndex::of(&layout), recording.runs.iter())
    }

    #[test]
    fn real_logs_of_track_a_are_of_track_a() {
        for train in ["train1", "train24", "train74", "train78"] {
            for what in ["run", "stop"] {
                let log = format!("choochoos_2020_track_a_{train}_{what}.csv");
                let lengths = check(&log, "track-a").unwrap_or_else(|refusal| panic!("{log}: {refusal}"));
                assert!(lengths.odd.len() <= 1, "{log}: {lengths:?}");
            }
        }
        assert!(check("eadanila_2020_track_a.csv", "track-a").unwrap().is_passed());
    }

    #[test]
    fn a_log_of_track_a_is_refused_on_track_b_by_the_two_lengths_that_differ() {
        // Track B has the same sensors and turnouts, joined alike; two distances of this lap are 87 and 95 mm shorter.
        let refusal = check("eadanila_2020_track_a.csv", "track-b").unwrap_err().to_string();
        assert!(
            refusal.starts_with("the recordings are not of layout `track-b` but of `track-a`"),
            "{refusal}"
        );
        for named in ["C13 to E7", "D9 to E12", "give --layout track-a"] {
            assert!(refusal.contains(named), "{named}: {refusal}");
        }
    }
}
