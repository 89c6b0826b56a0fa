//! Random worlds through every odometer: tables by phase, and the worst ten with seed and mechanism.

use std::collections::BTreeSet;
use std::io::{self, Write};

use footplate_core::TimeSpan;
use footplate_sim::line::{LineLevel, LineWorld};
use footplate_store::odometry::{OdometryScore, WheelPhase, WorldOdometer, WorldScores};
use serde_json::{Map, Value, json};

use super::families_page::{one, rounded_down};
use super::family::Spread;
use super::mechanism::mechanism;
use super::score_figures::score_json;
use crate::seeds::{FRESH, seeds_sentence};

/// Number of the worst worlds that are named.
const WORST: usize = 10;
/// The interval should have its normal width so soon after both slipped.
const NORMAL_WITHIN: TimeSpan = TimeSpan::from_ms(3000);
/// The rms should be at most so many times that of the oracle ...
const AT_MOST_ORACLE: f64 = 1.5;
const OURS: WorldOdometer = WorldOdometer::Recommended;

/// One world with the scores of every odometer.
pub struct ScoredWorld {
    seed: u64,
    level: LineLevel,
    notes: String,
    claims_hold: bool,
    is_sound: bool,
    scores: WorldScores,
}

impl ScoredWorld {
    /// Runs and scores the world of a seed, as known to an operator of this level.
    ///
    /// # Errors
    /// When its vehicle is one that no railway has.
    pub fn new(seed: u64, level: LineLevel) -> anyhow::Result<Self> {
        let world = LineWorld::draw(seed);
        let run = world.run(level);
        let scores = WorldScores::of(&run)?;
        let (notes, claims_hold) = (world.notes(), world.claims_hold(&run));
        Ok(Self { seed, level, notes, claims_hold, is_sound: world.is_sound(), scores })
    }

    /// Whether its claims hold, and no sensor and no recorder has a fault.
    const fn is_as_claimed(&self) -> bool {
        self.is_sound && self.claims_hold
    }

    /// Whether the truth left a guaranteed interval although all claims hold.
    fn broke(&self) -> bool {
        let [_, left] = self.scores.runs_and_left();
        let inside = self.scores.whole(OURS).speed_inside_pct;
        self.claims_hold && (left > 0 || inside.is_some_and(|pct| pct < 100.0))
    }

    /// The worst come first: broken guarantees, then the largest error.
    fn badness(&self) -> (bool, f64) {
        (self.broke(), self.scores.worst().map_or(0.0, |worst| worst.error_m_s.abs()))
    }
}

/// All worlds of one level or several.
pub struct WorldsPage {
    worlds: Vec<ScoredWorld>,
    /// What was asked for, as on the command line.
    asked: String,
}

const HEAD: &str = "\
# The odometer on random worlds

Speed, distance and their intervals on random worlds: train, rail, driver, slide protection and faults are
drawn from ranges that the [simulator's page](../theory/line_simulator.md#random-worlds) states. An operator of level
*L0* knows teeth, diameters and limits; *L1* adds the recorded command; *L2* adds brake, slide protection and gradients.
";

const LEGEND: &str = "\
Shares are over all periods. *Guaranteed %* and *99.99 %* are the shares whose true speed lies within the interval, rounded
down; *m/s* beside a phase is the mean width of that interval. *Normal width* is the median width while both have rolled for
20 s, and *normal again* the time after a slip of both until the interval is no wider than 1.5 times that median of its world.
The *oracle* knows which wheelset slips and which sensor is wrong, and when. *Times oracle* and *times raw mean* are our rms
divided by theirs, over all periods together and in the median world. The first is bold where it is more than asked: 1.5 times
the oracle; 1.05 times the raw mean where that is right (rolling, rolling again, standing), half of it where wheels slip.
*ETCS* is the share of periods whose speed is off by more than ETCS allows, ours before those of others; *hindsight* is an
odometer that knows the true speed but while both slip, and then the speed at which that began and the mean acceleration until
one of them rolls again. A train rolls *again* for 20 s after a wheelset slipped.
";

const PHASES: &str = "\
| level | phase | periods | rms m/s | oracle | times oracle | raw mean | times raw mean | raw max | paper | guaranteed m/s | guaranteed % \
| 99.99 % m/s | 99.99 % | ETCS % | raw mean | raw max | paper | hindsight |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

impl WorldsPage {
    /// Of worlds that were asked for like this on the command line.
    pub fn new(worlds: Vec<ScoredWorld>, asked: String) -> Self {
        Self { worlds, asked }
    }

    /// The tables under a heading, with what the figures mean.
    ///
    /// # Errors
    /// Those of the output.
    pub fn write_markdown(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{HEAD}\nMade by `footplate simulate line {}`.\n", self.asked)?;
        writeln!(output, "{}\n\n{LEGEND}", seeds_sentence(self.asked.contains(FRESH)))?;
        self.write_text(output)
    }

    /// The tables alone.
    ///
    /// # Errors
    /// Those of the output.
    pub fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        let levels: Vec<LineLevel> =
            LineLevel::ALL.into_iter().filter(|level| self.of(*level, |_| true).is_some()).collect();
        writeln!(
            output,
            "| level | claims | worlds | guaranteed % | distance inside | 99.99 % | distance 99.99 % | normal width m/s \
             | guaranteed m/s | normal again s | within 3 s % |\n\
             | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for level in &levels {
            for (claims, hold) in [("hold", true), ("do not", false)] {
                if let Some(scores) = self.of(*level, |world| world.claims_hold == hold) {
                    write_intervals(output, *level, claims, &scores)?;
                }
            }
        }
        write!(output, "\n## Worlds whose claims hold, without faults of sensors and recorder\n\n{PHASES}")?;
        for level in &levels {
            write_phases(output, *level, &self.these(*level, ScoredWorld::is_as_claimed))?;
        }
        write!(output, "\n## All worlds\n\n{PHASES}")?;
        for level in &levels {
            write_phases(output, *level, &self.these(*level, |_| true))?;
        }
        let names: Vec<&str> = levels.iter().map(|level| level.name()).collect();
        writeln!(
            output,
            "\n## The worst\n\nWhere the truth left a guaranteed interval although all claims hold, and then where the speed \
             was farthest off, each world once with its worst level. The *mechanism* is what wheels, rail and train really did at \
             that moment, and what they were taken for.\n\n\
             | seed | rms m/s {} | level | worst error m/s | at s | phase | guaranteed % | mechanism | world |\n\
             | ---: | ---: | --- | ---: | ---: | --- | ---: | --- | --- |",
            names.join(" / ")
        )?;
        self.worst().into_iter().try_for_each(|world| self.write_world(output, world))
    }

    /// Whether the truth left a guaranteed interval more often than it may, in worlds whose claims hold.
    pub fn falls_short(&self, least_inside_pct: f64) -> bool {
        LineLevel::ALL.into_iter().filter_map(|level| self.of(level, |world| world.claims_hold)).any(
            |scores| {
                let [_, left] = scores.runs_and_left();
                left > 0 || scores.whole(OURS).speed_inside_pct.is_some_and(|pct| pct < least_inside_pct)
            },
        )
    }

    fn worst(&self) -> Vec<&ScoredWorld> {
        let mut worlds: Vec<&ScoredWorld> = self.worlds.iter().collect();
        worlds.sort_by(|one, other| {
            let (mine, others) = (one.badness(), other.badness());
            others.0.cmp(&mine.0).then(others.1.total_cmp(&mine.1))
        });
        let mut named = BTreeSet::new();
        worlds.retain(|world| named.insert(world.seed));
        worlds.truncate(WORST);
        worlds
    }

    fn write_world(&self, output: &mut dyn Write, world: &ScoredWorld) -> io::Result<()> {
        let whole = world.scores.whole(OURS);
        let Some(worst) = world.scores.worst() else { return Ok(()) };
        let levels = self.worlds.iter().filter(|other| other.seed == world.seed);
        let rms: Vec<String> = levels.map(|level| one(level.scores.whole(OURS).speed_rms_m_s, 2)).collect();
        writeln!(
            output,
            "| {} | {} | {} | {:+.2} | {:.1} | {} | {} | {} | {} |",
            world.seed,
            rms.join(" / "),
            world.level.name(),
            worst.error_m_s,
            worst.time.as_s(),
            worst.phase.title(),
            rounded_down(whole.speed_inside_pct),
            mechanism(&worst),
            world.notes,
        )
    }

    fn these(&self, level: LineLevel, are_in: impl Fn(&ScoredWorld) -> bool) -> Vec<&ScoredWorld> {
        self.worlds.iter().filter(|world| world.level == level && are_in(world)).collect()
    }

    fn of(&self, level: LineLevel, are_in: impl Fn(&ScoredWorld) -> bool) -> Option<WorldScores> {
        together(&self.these(level, are_in))
    }

    /// Everything for machines.
    pub fn as_json(&self) -> Value {
        let levels = LineLevel::ALL.into_iter().filter_map(|level| {
            let scores = self.of(level, |_| true)?;
            Some((level.name().to_owned(), as_json(&scores)))
        });
        let sound = LineLevel::ALL.into_iter().filter_map(|level| {
            let scores = self.of(level, ScoredWorld::is_as_claimed)?;
            Some((level.name().to_owned(), as_json(&scores)))
        });
        let worlds = self.worlds.iter().map(|world| {
            let mut value = as_json(&world.scores);
            let worst = world.scores.worst();
            if let Value::Object(entries) = &mut value {
                entries.extend([
                    ("seed".to_owned(), json!(world.seed)),
                    ("level".to_owned(), json!(world.level.name())),
                    ("claims_hold".to_owned(), json!(world.claims_hold)),
                    ("without_faults".to_owned(), json!(world.is_sound)),
                    ("world".to_owned(), json!(world.notes)),
                    ("worst_time_s".to_owned(), json!(worst.map(|worst| worst.time.as_s()))),
                    ("worst_error_m_s".to_owned(), json!(worst.map(|worst| worst.error_m_s))),
                    ("worst_phase".to_owned(), json!(worst.map(|worst| worst.phase.key()))),
                    ("worst_mechanism".to_owned(), json!(worst.map(|worst| mechanism(&worst)))),
                ]);
            }
            value
        });
        json!({
            "levels": levels.collect::<Map<_, _>>(),
            "levels_without_faults": sound.collect::<Map<_, _>>(),
            "worlds": worlds.collect::<Vec<_>>(),
        })
    }
}

fn write_intervals(
    output: &mut dyn Write,
    level: LineLevel,
    claims: &str,
    scores: &WorldScores,
) -> io::Result<()> {
    let whole = scores.whole(OURS);
    let [runs, left] = scores.runs_and_left();
    let [likely, sure] = scores.normal_widths();
    let again = scores.normal_again(NORMAL_WITHIN);
    writeln!(
        output,
        "| {} | {claims} | {runs} | {} | {} of {runs} | {} | {} | {} | {} | {} | {} |",
        level.name(),
        rounded_down(whole.speed_inside_pct),
        runs - left,
        rounded_down(whole.confidence_speed_inside_pct),
        rounded_down(whole.confidence_distance_inside_pct),
        one(likely, 2),
        one(sure, 2),
        one(again.map(|[median, _]| median), 1),
        one(again.map(|[_, soon]| soon), 0),
    )
}

/// ... and so many times that of the raw mean, by whether its wheels tell the truth.
const fn at_most_raw_mean(phase: WheelPhase) -> f64 {
    match phase {
        WheelPhase::Rolling | WheelPhase::RollingAgain | WheelPhase::Standing => 1.05,
        WheelPhase::OneSlips | WheelPhase::BothSlip => 0.5,
    }
}

/// How many times the rms of another odometer ours is: over all periods together, bold where it is more than asked, and in the median
/// world.
fn times(
    all: &WorldScores,
    worlds: &[&ScoredWorld],
    phase: WheelPhase,
    other: WorldOdometer,
    at_most: f64,
) -> String {
    let ratio = |scores: &WorldScores| {
        let rms = |odometer| scores.in_phase(phase, odometer).speed_rms_m_s;
        Some(rms(OURS)? / rms(other).filter(|rms| *rms > 0.0)?)
    };
    let each = worlds.iter().filter_map(|world| ratio(&world.scores));
    let median = Spread::of(each).map(|spread| spread.median);
    beside_asked(ratio(all), median, at_most)
}

fn beside_asked(of_all: Option<f64>, median: Option<f64>, at_most: f64) -> String {
    let bold = if of_all.is_some_and(|ratio| ratio > at_most) { "**" } else { "" };
    format!("{bold}{}{bold} / {}", one(of_all, 2), one(median, 2))
}

/// The scores of several worlds together.
fn together(worlds: &[&ScoredWorld]) -> Option<WorldScores> {
    let (first, others) = worlds.split_first()?;
    let mut all = first.scores.clone();
    others.iter().for_each(|world| all.merge(&world.scores));
    Some(all)
}

fn write_phases(output: &mut dyn Write, level: LineLevel, worlds: &[&ScoredWorld]) -> io::Result<()> {
    let Some(scores) = together(worlds) else { return Ok(()) };
    for phase in WheelPhase::ALL {
        let of = |odometer| scores.in_phase(phase, odometer);
        let rms = |odometer| one(of(odometer).speed_rms_m_s, 3);
        let ours = of(OURS);
        let etcs = |score: &OdometryScore| one(score.etcs_speed_violation_pct, 2);
        writeln!(
            output,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            level.name(),
            phase.title(),
            ours.scored,
            rms(OURS),
            rms(WorldOdometer::Oracle),
            times(&scores, worlds, phase, WorldOdometer::Oracle, AT_MOST_ORACLE),
            rms(WorldOdometer::RawMean),
            times(&scores, worlds, phase, WorldOdometer::RawMean, at_most_raw_mean(phase)),
            rms(WorldOdometer::RawMax),
            rms(WorldOdometer::Paper),
            one(ours.speed_width_mean_m_s, 2),
            rounded_down(ours.speed_inside_pct),
            one(ours.confidence_speed_width_m_s, 2),
            rounded_down(ours.confidence_speed_inside_pct),
            etcs(&ours),
            etcs(&of(WorldOdometer::RawMean)),
            etcs(&of(WorldOdometer::RawMax)),
            etcs(&of(WorldOdometer::Paper)),
            etcs(&of(WorldOdometer::Hindsight)),
        )?;
    }
    Ok(())
}

fn as_json(scores: &WorldScores) -> Value {
    let each = |of: &dyn Fn(WorldOdometer) -> OdometryScore| {
        let scored =
            WorldOdometer::ALL.map(|odometer| (odometer.key().to_owned(), score_json(&of(odometer))));
        scored.into_iter().collect::<Map<_, _>>()
    };
    let phases = WheelPhase::ALL.map(|phase| {
        (phase.key().to_owned(), Value::Object(each(&|odometer| scores.in_phase(phase, odometer))))
    });
    let [worlds, left] = scores.runs_and_left();
    let [likely, sure] = scores.normal_widths();
    let again = scores.normal_again(NORMAL_WITHIN);
    json!({
        "worlds": worlds,
        "distance_left_guaranteed": left,
        "normal_confidence_width_m_s": likely,
        "normal_guaranteed_width_m_s": sure,
        // Infinite, if the interval stayed wide, is no number in JSON.
        "normal_again_s": again.map(|[median, _]| median).filter(|median| median.is_finite()),
        "normal_again_within_3_s_pct": again.map(|[_, soon]| soon),
        "whole": each(&|odometer| scores.whole(odometer)),
        "phases": phases.into_iter().collect::<Map<_, _>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_more_than_asked_is_bold() {
        assert_eq!(beside_asked(Some(1.5), Some(0.9), 1.5), "1.50 / 0.90");
        assert_eq!(beside_asked(Some(1.6), Some(1.7), 1.5), "**1.60** / 1.70");
        assert_eq!(beside_asked(None, None, 1.5), "– / –");
        assert_eq!(WheelPhase::ALL.map(at_most_raw_mean), [1.05, 0.5, 0.5, 1.05, 1.05]);
    }
}
