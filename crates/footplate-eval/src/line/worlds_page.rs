//! Random worlds through every odometer: tables by phase, and the worst ten with seed and notes.

use std::io::{self, Write};

use footplate_core::TimeSpan;
use footplate_sim::line::{LineLevel, LineWorld};
use footplate_store::odometry::{OdometryScore, Phase, WorldOdometer, WorldScores, WorstMoment};
use serde_json::{Map, Value, json};

use super::families_page::{one, rounded_down};
use super::score_json;
use crate::seeds::{FRESH, seeds_sentence};

/// Number of the worst worlds that are named.
const WORST: usize = 10;
/// The interval should have its normal width so soon after both slipped.
const NORMAL_WITHIN: TimeSpan = TimeSpan::from_ms(3000);
const OURS: WorldOdometer = WorldOdometer::Recommended;

/// One world with the scores of every odometer.
pub struct ScoredWorld {
    seed: u64,
    level: LineLevel,
    notes: String,
    claims_hold: bool,
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
        Ok(Self { seed, level, notes: world.notes(), claims_hold: world.claims_hold(&run), scores })
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
Shares are over all periods. *Guaranteed* and *99.99 %* are the shares whose true speed lies within the interval, rounded
down. The *oracle* knows which wheelset slips, and when. *ETCS* is the share of periods whose speed is off by more than
ETCS allows; *hindsight* is an odometer that knows the true speed but while both slip, and then the speed at which that began
and the mean acceleration until one of them rolls again. A train rolls *again* for 20 s after a wheelset slipped.
";

impl WorldsPage {
    /// Of worlds that were asked for like this on the command line.
    #[must_use]
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
        writeln!(
            output,
            "\n| level | phase | periods | rms m/s | oracle | raw mean | raw max | paper | guaranteed % | 99.99 % \
             | ETCS % | raw mean | hindsight |\n\
             | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for level in &levels {
            if let Some(scores) = self.of(*level, |_| true) {
                write_phases(output, *level, &scores)?;
            }
        }
        writeln!(
            output,
            "\n## The worst\n\nWhere the truth left a guaranteed interval although all claims hold, and then where the speed \
             was farthest off.\n\n| level | seed | rms m/s | worst error m/s | at s | phase | guaranteed % | world |\n\
             | --- | ---: | ---: | ---: | ---: | --- | ---: | --- |"
        )?;
        self.worst().into_iter().try_for_each(|world| write_world(output, world))
    }

    /// Whether the truth left a guaranteed interval more often than it may, in worlds whose claims hold.
    #[must_use]
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
        worlds.truncate(WORST);
        worlds
    }

    fn of(&self, level: LineLevel, is_in: impl Fn(&ScoredWorld) -> bool) -> Option<WorldScores> {
        let mut worlds = self.worlds.iter().filter(|world| world.level == level && is_in(world));
        let mut all = worlds.next()?.scores.clone();
        worlds.for_each(|world| all.merge(&world.scores));
        Some(all)
    }

    /// Everything for machines.
    #[must_use]
    pub fn as_json(&self) -> Value {
        let levels = LineLevel::ALL.into_iter().filter_map(|level| {
            let scores = self.of(level, |_| true)?;
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
                    ("world".to_owned(), json!(world.notes)),
                    ("worst_time_s".to_owned(), json!(worst.map(|worst| worst.time.as_s()))),
                    ("worst_error_m_s".to_owned(), json!(worst.map(|worst| worst.error_m_s))),
                    ("worst_phase".to_owned(), json!(worst.map(|worst| worst.phase.key()))),
                ]);
            }
            value
        });
        json!({ "levels": levels.collect::<Map<_, _>>(), "worlds": worlds.collect::<Vec<_>>() })
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

fn write_phases(output: &mut dyn Write, level: LineLevel, scores: &WorldScores) -> io::Result<()> {
    for phase in Phase::ALL {
        let of = |odometer| scores.in_phase(phase, odometer);
        let rms = |odometer| one(of(odometer).speed_rms_m_s, 3);
        let ours = of(OURS);
        let etcs = |score: &OdometryScore| one(score.etcs_speed_violation_pct, 2);
        writeln!(
            output,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            level.name(),
            phase.title(),
            ours.scored,
            rms(OURS),
            rms(WorldOdometer::Oracle),
            rms(WorldOdometer::RawMean),
            rms(WorldOdometer::RawMax),
            rms(WorldOdometer::Paper),
            rounded_down(ours.speed_inside_pct),
            rounded_down(ours.confidence_speed_inside_pct),
            etcs(&ours),
            etcs(&of(WorldOdometer::RawMean)),
            etcs(&of(WorldOdometer::Hindsight)),
        )?;
    }
    Ok(())
}

fn write_world(output: &mut dyn Write, world: &ScoredWorld) -> io::Result<()> {
    let whole = world.scores.whole(OURS);
    let Some(WorstMoment { time, error_m_s, phase, .. }) = world.scores.worst() else { return Ok(()) };
    writeln!(
        output,
        "| {} | {} | {} | {error_m_s:+.2} | {:.1} | {} | {} | {} |",
        world.level.name(),
        world.seed,
        one(whole.speed_rms_m_s, 3),
        time.as_s(),
        phase.title(),
        rounded_down(whole.speed_inside_pct),
        world.notes,
    )
}

fn as_json(scores: &WorldScores) -> Value {
    let each = |of: &dyn Fn(WorldOdometer) -> OdometryScore| {
        let scored =
            WorldOdometer::ALL.map(|odometer| (odometer.key().to_owned(), score_json(&of(odometer))));
        scored.into_iter().collect::<Map<_, _>>()
    };
    let phases = Phase::ALL.map(|phase| {
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
