//! Random worlds: train, rail, driver, protection and faults, all drawn from stated ranges.
//!
//! Most of it is independent of each other, so that things meet that no scenario brings together. The ranges stand here
//! and in docs/theory/line_simulator.md. A seed is one world, whatever its operator knows of it: [`LineLevel`] changes
//! the vehicle file and whether the command is recorded, and nothing that happens.

use footplate_core::TimeSpan;

use super::balises::MarkAccuracy;
use super::bogie::{Conduct, Plateau};
use super::brake_cylinder::BrakeTimes;
use super::consist::Placement;
use super::creep_force::Film;
use super::faults::Fault;
use super::gradients::Gradients;
use super::kinds::Kind;
use super::plan::Handle::{At, Keep};
use super::plan::{Stage, Until};
use super::recording::{LineRun, LineTruth, WheelTruth};
use super::resistance::GRAVITY;
use super::run::{LineConditions, run};
use super::setup::{Lay, Setup};
use super::slide_protection::ProtectionStyle;
use super::true_claims::{claim, releases_as_claimed};
use super::vehicle::LOOSE_BRAKE_TOLERANCE;
use crate::draws::{Draws, Purpose};

/// Pulses per revolution: the usual wheels of teeth. Both have the same in half of all worlds.
const TEETH: [u32; 6] = [60, 80, 90, 100, 128, 200];
/// From one sample to the next (ms).
const PERIODS_MS: [i64; 4] = [20, 50, 100, 200];
/// The steepest gradient (m/m).
const STEEPEST: f64 = 0.035;
/// How well diameters are known.
const DIAMETER_TOLERANCE: (f64, f64) = (0.0005, 0.006);
/// Speeds of a hop (m/s): the least, and the most for each kind of train.
const SLOWEST_M_PER_S: f64 = 6.0;
/// Hops from stop to stop, and how long a world lasts at most (s).
const HOPS: (usize, usize) = (1, 3);
const LASTS_S: f64 = 360.0;

/// Before the brake answers and before it releases (s), and how long its cylinders take to fill and to empty by 63 % (s).
const BRAKE_DEAD_S: (f64, f64) = (0.0, 0.8);
const RELEASE_DEAD_S: (f64, f64) = (0.0, 2.5);
const FILL_S: (f64, f64) = (0.2, 1.0);
const EMPTY_S: (f64, f64) = (0.2, 1.2);

/// Adhesion: base of the rail, and of what lies on it (coefficient of friction).
const BASE: (f64, f64) = (0.15, 0.55);
const LOW: (f64, f64) = (0.012, 0.12);
/// What is left of it at large creepage, how fast it falls (s/m), and how soft the wheel and rail are.
const KEPT: (f64, f64) = (0.2, 0.8);
const FALL: (f64, f64) = (0.03, 0.8);
const ADHERING: (f64, f64) = (0.1, 1.0);
const SLIPPING: (f64, f64) = (0.03, 0.4);
/// Films of leaves and damp, and ice for minutes (m); bare rail between them (m); over which length they come up (m).
const SHORT_M: (f64, f64) = (20.0, 500.0);
const LONG_M: (f64, f64) = (1000.0, 6000.0);
const BARE_M: (f64, f64) = (50.0, 1200.0);
const ONSET_M: (f64, f64) = (0.0, 150.0);
/// By how much friction grows with each wheelset.
const CLEANING: (f64, f64) = (1.0, 1.5);
/// Farther than any world goes (m).
const FAR_M: f64 = 15_000.0;

/// A creepage that a converter keeps, how long (s), how fast wheels get there and back (m/s²).
const PLATEAU: (f64, f64) = (0.03, 0.18);
const PLATEAU_S: (f64, f64) = (2.0, 45.0);
const AWAY: (f64, f64) = (0.05, 3.0);
const BACK: (f64, f64) = (0.15, 2.5);

/// Marks of places: what is said of them (m), how often they are wrong, and by how much (m).
const MARK_M: (f64, f64) = (0.5, 3.0);
const MARKS_WRONG: f64 = 0.12;
const WRONG_BY_M: (f64, f64) = (5.0, 18.0);

/// Faults of sensors and recorder; the first of them in two of three worlds.
const FAULTS: [Fault; 11] = [
    Fault::None,
    Fault::MissingTooth,
    Fault::MissedPulses,
    Fault::Bursts,
    Fault::DeadWhenSlow,
    Fault::Stuck,
    Fault::DeadSensor,
    Fault::SwappedDirection,
    Fault::CountersOnly,
    Fault::Clock,
    Fault::SpikesAndDropouts,
];

/// What the operator of a train knows of it, and what the recording contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineLevel {
    /// Teeth, diameters and the limits of speed and acceleration.
    L0,
    /// The command, too.
    L1,
    /// What brake and slide protection do, and the gradients of the line, too.
    L2,
}

impl LineLevel {
    /// All of them, in order.
    pub const ALL: [Self; 3] = [Self::L0, Self::L1, Self::L2];

    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::L0 => "L0",
            Self::L1 => "L1",
            Self::L2 => "L2",
        }
    }
}

/// A world drawn from a seed.
#[derive(Debug, Clone)]
pub struct LineWorld {
    setup: Setup,
    seed: u64,
    conditions: LineConditions,
    notes: Vec<String>,
}

impl LineWorld {
    /// The world of a seed.
    pub fn draw(seed: u64) -> Self {
        let mut draws = Draws::new(seed, Purpose::Physics);
        let draws = &mut draws;
        let (kind, fastest) =
            pick(draws, &[(Kind::HighSpeed, 45.0), (Kind::Suburban, 30.0), (Kind::Metro, 22.0)]);
        let mut notes = vec![format!("{kind:?}")];
        let steepest = draws.uniform(0.0..STEEPEST);
        let stages = stages(fastest, steepest, kind.design().full_brake(), draws);
        let powered = pick(draws, &[[true, false], [true, true], [false, false]]);
        let placement = pick(draws, &[Placement::TwoCars, Placement::OneBogie]);
        notes.push(format!("{} driven", powered.iter().filter(|powered| **powered).count()));
        let brake_times = BrakeTimes {
            dead: [within(draws, BRAKE_DEAD_S), within(draws, RELEASE_DEAD_S)],
            motors: draws.uniform(0.0..0.5),
            fill: within(draws, FILL_S),
            empty: within(draws, EMPTY_S),
        };
        let (protection, protected) = match draws.below(3) {
            0 => (ProtectionStyle::OnOff, [true; 2]),
            1 => (ProtectionStyle::Proportional { creepage: draws.uniform(0.04..0.2) }, [true; 2]),
            _ => (ProtectionStyle::OnOff, [false; 2]),
        };
        notes.push(match (protected, protection) {
            ([false, _], _) => "no protection".to_owned(),
            (_, ProtectionStyle::OnOff) => "on-off".to_owned(),
            (_, ProtectionStyle::Proportional { creepage }) => {
                format!("proportional {:.0} %", 100.0 * creepage)
            }
        });
        let base = film(within(draws, BASE), draws);
        let films = films(&mut notes, draws);
        let bogie = if placement == Placement::OneBogie && draws.chance(0.7) {
            plateaus(powered, &mut notes, draws)
        } else {
            Vec::new()
        };
        let fault = if draws.chance(2.0 / 3.0) { Fault::None } else { pick(draws, &FAULTS[1..]) };
        if fault != Fault::None {
            notes.push(format!("{fault:?}"));
        }
        let teeth = pick(draws, &TEETH);
        let other_teeth = draws.chance(0.5).then(|| pick(draws, &TEETH));
        let period = TimeSpan::from_ms(pick(draws, &PERIODS_MS));
        let marks = draws.chance(0.5).then(|| MarkAccuracy {
            deviation: within(draws, MARK_M),
            wrong: MARKS_WRONG,
            wrong_by: WRONG_BY_M,
        });
        // Recorded no later than brake and motors answer: otherwise what the recording says of coasting would be false.
        let answers = brake_times.dead[0].min(brake_times.motors);
        let command_delay = (answers / period.as_s()).floor() * period.as_s() * draws.uniform(0.0..1.0);
        let lost_at = draws.uniform(20.0..200.0);
        let command_lost = draws.chance(0.15).then(|| [lost_at, lost_at + draws.uniform(2.0..60.0)]);
        let line = Gradients::draw(steepest, FAR_M, draws);
        let setup = Setup {
            powered,
            placement,
            diameter_tolerance: within(draws, DIAMETER_TOLERANCE),
            base,
            films,
            bogie,
            protected,
            protection,
            brake_times,
            fault,
            marks,
            other_teeth,
            command_delay,
            command_lost,
            brake_tolerance: LOOSE_BRAKE_TOLERANCE,
            ..Setup::new(kind, 0.0, stages, LASTS_S)
        }
        .with_gradients(line, steepest);
        notes.push(format!("{} ms", period.as_ms()));
        let conditions = LineConditions { teeth, period, ..LineConditions::default() };
        Self { setup, seed, conditions, notes }
    }

    /// What is special about it, in a few words.
    pub fn notes(&self) -> String {
        self.notes.join(", ")
    }

    /// Whether its sensors and its recorder have no fault.
    pub fn is_sound(&self) -> bool {
        self.setup.fault == Fault::None
    }

    /// Whether the claims of every level are true in a run of it. They are not where rows are read late, where one burst of
    /// interference meets both sensors, where wheels slip on a train that rolls back against its traction, where a train rolls
    /// back whose sensors report no direction, and where wheels slip longer after a command than the claimed release.
    pub fn claims_hold(&self, run: &LineRun) -> bool {
        let signed = run
            .samples
            .iter()
            .flat_map(|sample| sample.wheels)
            .any(|wheel| wheel.turned.is_some() || wheel.pulses.is_none() && wheel.counter.is_some());
        let rolls_back = |truth: &LineTruth| {
            truth.speed.as_m_per_s() < 0.0
                && (!signed || truth.wheels.iter().any(|does| *does != WheelTruth::Rolling))
        };
        !matches!(self.setup.fault, Fault::Clock | Fault::Bursts)
            && !run.truth.iter().any(rolls_back)
            && releases_as_claimed(run)
    }

    /// Runs it, with the vehicle as an operator of a level knows it. The same seed gives the same bytes on every machine.
    pub fn run(&self, level: LineLevel) -> LineRun {
        let mut run = run(level.name(), &self.setup, self.seed, self.conditions);
        claim(&mut run, level, &self.setup.brake_times);
        run
    }
}

fn within(draws: &mut Draws, (low, high): (f64, f64)) -> f64 {
    draws.uniform(low..high)
}

/// Between two amounts, every factor equally likely.
fn of_magnitude(draws: &mut Draws, (low, high): (f64, f64)) -> f64 {
    low * libm::exp(draws.uniform(0.0..libm::log(high / low)))
}

fn pick<T: Copy>(draws: &mut Draws, from: &[T]) -> T {
    from[draws.below(from.len())]
}

fn film(friction: f64, draws: &mut Draws) -> Film {
    Film {
        friction,
        kept: within(draws, KEPT),
        fall: of_magnitude(draws, FALL),
        adhering: of_magnitude(draws, ADHERING),
        slipping: of_magnitude(draws, SLIPPING),
    }
}

/// What the driver does: stands with a brake that is moved about, starts, runs, coasts or drags the brake, and stops in one
/// go or with a pause.
fn stages(fastest: f64, steepest: f64, full_brake: f64, draws: &mut Draws) -> Vec<Stage> {
    // Less would not slow the train downhill.
    let least = (steepest * GRAVITY / full_brake + 0.15).min(0.9);
    let mut stages = Vec::new();
    let hops = HOPS.0 + draws.below(HOPS.1 - HOPS.0 + 1);
    for _ in 0..hops {
        stand(&mut stages, draws);
        let speed = draws.uniform(SLOWEST_M_PER_S..fastest);
        stages.push(Stage::new(At(draws.uniform(0.6..1.0)), Until::Faster(speed)));
        for _ in 0..=draws.below(2) {
            let lasts = draws.uniform(8.0..30.0);
            let handle = match draws.below(3) {
                0 => Keep(speed),
                1 => At(0.0),
                _ => At(-draws.uniform(0.05..0.25)),
            };
            stages.push(Stage::new(handle, Until::For(lasts)));
        }
        if draws.chance(0.5) {
            // Released in the middle of it.
            let slower = draws.uniform(0.4..0.8) * speed;
            stages.push(Stage::new(At(-draws.uniform(least..1.0)), Until::Slower(slower)));
            let handle = if draws.chance(0.5) { At(0.0) } else { Keep(slower) };
            stages.push(Stage::new(handle, Until::For(draws.uniform(5.0..25.0))));
        }
        stages.push(Stage::new(At(-draws.uniform(least..1.0)), Until::Slower(0.0)));
    }
    stages.push(Stage::new(At(-0.6), Until::Time(1e9)));
    stages
}

fn stand(stages: &mut Vec<Stage>, draws: &mut Draws) {
    if draws.chance(0.6) {
        stages.push(Stage::new(At(-0.6), Until::For(draws.uniform(3.0..20.0))));
        return;
    }
    for _ in 0..=draws.below(6) {
        stages.push(Stage::new(At(-draws.uniform(0.6..1.0)), Until::For(draws.uniform(0.5..4.0))));
        let held = if draws.chance(0.3) { 0.0 } else { draws.uniform(0.4..0.5) };
        stages.push(Stage::new(At(-held), Until::For(draws.uniform(0.2..0.8))));
    }
    stages.push(Stage::new(At(-0.6), Until::For(draws.uniform(1.0..4.0))));
}

/// What lies on the rail from the first stop on: nothing, films in places, or ice for minutes.
fn films(notes: &mut Vec<String>, draws: &mut Draws) -> Vec<Lay> {
    let (name, length) = match draws.below(4) {
        0 => return Vec::new(),
        1 | 2 => ("films", SHORT_M),
        _ => ("ice", LONG_M),
    };
    let typical = of_magnitude(draws, LOW);
    notes.push(format!("{name} {typical:.3}"));
    let mut films = Vec::new();
    let mut ahead = draws.uniform(0.0..BARE_M.1);
    while ahead < FAR_M {
        let lasts = of_magnitude(draws, length);
        let friction = (typical * draws.uniform(0.7..1.4)).clamp(LOW.0, LOW.1);
        films.push(Lay {
            at: 0.0,
            ahead,
            length: lasts,
            onset: within(draws, ONSET_M),
            film: film(friction, draws),
            cleaning: within(draws, CLEANING),
        });
        ahead += lasts + of_magnitude(draws, BARE_M);
    }
    films
}

/// What the converter of the measured bogie does on its own.
fn plateaus(powered: [bool; 2], notes: &mut Vec<String>, draws: &mut Draws) -> Vec<(f64, Conduct)> {
    let mut time = draws.uniform(5.0..80.0);
    let mut acts = Vec::new();
    for _ in 0..=draws.below(2) {
        let is_driven = powered == [true; 2] && draws.chance(0.3);
        let creepage = within(draws, PLATEAU) * if is_driven { 1.0 } else { -1.0 };
        let lasts = of_magnitude(draws, PLATEAU_S);
        let (away, back) = (of_magnitude(draws, AWAY), of_magnitude(draws, BACK));
        notes.push(format!("creeps {:.0} % for {lasts:.0} s", 100.0 * creepage));
        acts.push((time, Conduct::Creeps(Plateau { creepage, lasts, away, back })));
        time += lasts + draws.uniform(10.0..120.0);
    }
    acts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_changes_what_is_known_and_nothing_that_happens() {
        let world = LineWorld::draw(5);
        let [nothing, command, all] = LineLevel::ALL.map(|level| world.run(level));
        assert_eq!(nothing.truth, all.truth);
        assert!(nothing.samples.iter().all(|sample| sample.effort.is_none()));
        assert!(command.samples.iter().any(|sample| sample.effort.is_some()));
        assert_eq!(command.samples, all.samples);
        assert_eq!(world.run(LineLevel::L2), LineWorld::draw(5).run(LineLevel::L2));
    }

    #[test]
    fn worlds_roll_slip_and_stand_and_their_claims_of_speed_and_acceleration_are_true() {
        let mut shares = [0_usize; 4];
        for seed in 1..=12 {
            let run = LineWorld::draw(seed).run(LineLevel::L2);
            for truth in &run.truth {
                let beyond = truth.wheels.iter().filter(|wheel| **wheel != WheelTruth::Rolling).count();
                shares[beyond] += 1;
                shares[3] += usize::from(truth.speed.as_m_per_s() == 0.0);
                assert!(truth.speed.abs() <= run.vehicle.max_speed, "{seed}");
            }
            // Means over a second: a step of the wheels is no acceleration of the train.
            let per_second = (1.0 / run.vehicle.period.as_s()).round() as usize;
            for pair in run.truth.windows(per_second + 1) {
                let gained = (pair[per_second].speed.abs() - pair[0].speed.abs()).as_m_per_s();
                assert!(gained <= run.vehicle.max_traction.as_m_per_s2() + 1e-9, "{seed}: {gained}");
                assert!(-gained <= run.vehicle.max_brake.as_m_per_s2() + 1e-9, "{seed}: {gained}");
            }
        }
        let all: usize = shares[..3].iter().sum();
        assert!(shares[1] * 100 > all && shares[2] * 100 > all && shares[3] * 20 > all, "{shares:?}");
        assert!(shares[0] * 2 > all, "{shares:?}");
    }
}
