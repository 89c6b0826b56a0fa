//! One period in, one estimate out.
//!
//! The order of a period: read both wheelsets; ask what the command allows; predict the train; judge which wheelset
//! slips or slides; narrow the bounds; let the trusted wheels correct the filter, or the virtual sensor stand in for
//! them; add up the distance.

use super::command_watch::{Allowed, CommandWatch};
use super::distance_bounds::{Counted, DistanceBounds};
use super::motion_estimate::{Mode, MotionEstimate, WheelState};
use super::past::Past;
use super::settings::OdometrySettings;
use super::speed_bounds::{Limits, SpeedBounds, WheelBounds};
use super::train_filter::TrainFilter;
use super::virtual_sensor::{Beginning, Envelope, LostWheel, VirtualSensor};
use super::wheel_channel::WheelChannel;
use crate::units::{Acceleration, Length, Speed};
use crate::wheels::{
    Heading, Loss, Period, Quality, Range, Shown, Signs, SlipSlide, TrainSigns, Vehicle, VehicleError,
};

/// A longer time without a period breaks the run: the train can have done anything (s).
const GAP_S: f64 = 2.0;
/// Faster than this a train does not turn round from one period to the next (m/s).
const CERTAIN_HEADING: f64 = 1.5;
/// Slower than this it may (m/s).
const TURNED_ROUND: f64 = 0.1;
/// Both sensors silent or disbelieved for longer: the estimate is a guess (s).
const BLIND_S: f64 = 5.0;
/// Variance of the speed that the first period tells, in squared pulses per period: a count at a random phase.
const FIRST_COUNT: f64 = 1.0 / 6.0;
/// Jerk density while the virtual sensor stands in (m²/s⁵): accelerations are known to 0.3 m/s² after a second.
const BLIND_JERK: f64 = 0.1;

/// Difference of speeds at which the wheel that seems to slip or slide loses half its share: three standard deviations
/// of the difference of two wheels that roll (m/s), and what their diameters may differ by (part of the speed).
const APART: (f64, f64) = (0.25, 0.004);
/// Share of a powered wheel in traction beside one that is not: its creep is a bias, the other has none.
const CREEPING_SHARE: f64 = 0.05;
/// How closely two wheels have to turn alike to be believed against everything else (m/s, part of the speed) ...
const ALIKE: (f64, f64) = (0.2, 0.006);
/// ... and for how long (s), with nothing holding them back or driving them, and otherwise.
const ALIKE_FREE_S: f64 = 1.0;
const ALIKE_HELD_S: f64 = 8.0;
/// Wheels silent for longer in a slide are locked (s).
const LOCKED_S: f64 = 0.15;

/// Follows one train from its first period.
#[derive(Debug, Clone)]
pub struct Odometer {
    vehicle: Vehicle,
    settings: OdometrySettings,
    wheels: [WheelChannel; 2],
    command: CommandWatch,
    slips: SlipSlide,
    bounds: SpeedBounds,
    ways: DistanceBounds,
    train: TrainFilter,
    stand_in: Option<VirtualSensor>,
    last: Option<MotionEstimate>,
    /// Seconds since the first period.
    clock: f64,
    /// 1 the way in which distance grows, −1 the other.
    way: f64,
    distance: f64,
    /// How far the counts put the train ahead of where the filter believes it (m).
    ahead: f64,
    blind: f64,
    /// How long both wheels have turned alike (s).
    alike_for: f64,
    /// What the train did before anything slipped or slid.
    past: Past,
}

impl Odometer {
    /// An odometer that knows the vehicle and nothing else.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn new(vehicle: Vehicle, settings: OdometrySettings) -> Result<Self, VehicleError> {
        vehicle.check()?;
        Ok(Self::fresh(vehicle, settings))
    }

    /// How it works.
    #[must_use]
    pub fn settings(&self) -> OdometrySettings {
        self.settings
    }

    /// Takes in the readings of one period. Distance is zero at the end of the first.
    pub fn step(&mut self, period: &Period) -> MotionEstimate {
        let Some(last) = self.last else { return self.begin(period) };
        let t = (period.time - last.time).as_s();
        if t <= 0.0 {
            // Time that stands still or goes back says nothing about the train.
            return MotionEstimate { mode: worse(last.mode, Mode::Degraded), ..last };
        }
        if t > GAP_S {
            return self.resume(period, last, t);
        }
        let estimate = self.follow(period, last, t);
        self.last = Some(estimate);
        estimate
    }

    /// The first period of a run.
    fn begin(&mut self, period: &Period) -> MotionEstimate {
        let t = self.vehicle.period.as_s();
        let [first, second] = &mut self.wheels;
        let read = [first.begin(period, 0, t), second.begin(period, 1, t)];
        let most = self.vehicle.max_speed.as_m_per_s();
        let off = 1.5 * first.pitch.max(second.pitch) / t;
        let mut bounds = Range { low: 0.0, high: most };
        let speeds = read.iter().flatten();
        if let Some(fastest) = speeds.clone().copied().reduce(f64::max) {
            bounds.high = (fastest * 1.02 + off).min(most);
        }
        if let Some(slowest) = speeds.copied().reduce(f64::min) {
            bounds.low = (slowest * 0.98 - off).max(0.0);
        }
        let (speed, variance) = match read {
            [Some(a), Some(b)] => (0.5 * (a + b), 0.5 * FIRST_COUNT),
            [Some(v), None] | [None, Some(v)] => (v, FIRST_COUNT),
            [None, None] => (0.0, most * most * t * t),
        };
        self.train = TrainFilter::new(speed, variance * (first.pitch / t) * (first.pitch / t) + 1e-4);
        self.bounds = SpeedBounds::new(bounds);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(speed),
            speed_deviation: Speed::from_m_per_s(self.train.speed_deviation()),
            speed_low: Speed::from_m_per_s(bounds.low),
            speed_high: Speed::from_m_per_s(bounds.high),
            acceleration: Acceleration::ZERO,
            distance: Length::ZERO,
            distance_low: Length::ZERO,
            distance_high: Length::ZERO,
            over: Length::ZERO,
            under: Length::ZERO,
            wheels: [WheelState::Rolling; 2],
            mode: if read.iter().all(Option::is_some) { Mode::Normal } else { Mode::Degraded },
            shares: [0.5, 0.5, 0.0],
        };
        self.last = Some(estimate);
        estimate
    }

    /// A period after a gap in which the train can have done anything it is able to.
    fn resume(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let top = self.vehicle.max_speed.as_m_per_s();
        let before = self.ways.distance();
        let reach = Range { low: before.low - top * t, high: before.high + top * t };
        let mut fresh =
            Self { way: self.way, distance: self.distance, ..Self::fresh(self.vehicle, self.settings) };
        fresh.ways.relocate(reach);
        let first = fresh.begin(period);
        *self = fresh;
        let estimate =
            self.finished(MotionEstimate { mode: Mode::Degraded, distance: last.distance, ..first }, &last);
        self.last = Some(estimate);
        estimate
    }

    fn fresh(vehicle: Vehicle, settings: OdometrySettings) -> Self {
        let [first, second] = vehicle.wheelsets;
        let fastest = vehicle.max_speed.as_m_per_s();
        Self {
            vehicle,
            settings,
            wheels: [WheelChannel::new(first, &vehicle), WheelChannel::new(second, &vehicle)],
            command: CommandWatch::new(),
            slips: SlipSlide::new(vehicle.thresholds, settings.both_axles, settings.latch),
            bounds: SpeedBounds::new(Range { low: 0.0, high: fastest }),
            ways: DistanceBounds::new(Range::exactly(0.0)),
            train: TrainFilter::new(0.0, fastest * fastest),
            stand_in: None,
            last: None,
            clock: 0.0,
            way: 1.0,
            distance: 0.0,
            ahead: 0.0,
            blind: 0.0,
            alike_for: 0.0,
            past: Past::new(),
        }
    }

    fn follow(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        self.clock += t;
        let effort = period.effort.filter(|effort| effort.is_finite());
        let seen = {
            let [first, second] = &self.wheels;
            let (a, b) = (first.smooth_acceleration, second.smooth_acceleration);
            if a.min(b) < -a.max(b) { a.min(b) } else { a.max(b) }
        };
        let held = self.slips.lost().contains(&Some(Loss::Slide));
        let allowed = self.command.next(effort, seen, held, t, &self.vehicle);
        // One forward and the other backward: then neither says that the train has turned round.
        for (wheel, reading) in self.wheels.iter_mut().zip(&period.wheels) {
            wheel.hear(reading, self.way, t);
        }
        let disputed = {
            let [first, second] = &self.wheels;
            first.told.way() * second.told.way() < 0.0
        };
        if disputed && self.way < 0.0 {
            // One of the two is wired the wrong way round; trains that run backward are rarer.
            self.turn();
        }
        let heading = Heading { way: self.way, certain: self.train.v.abs() > CERTAIN_HEADING, disputed };
        let [first_lost, second_lost] = self.slips.lost();
        let at = (self.clock, t, self.vehicle.period.as_s());
        let [first, second] = &mut self.wheels;
        let counted = [
            first.read(period, 0, at, heading, &allowed, first_lost),
            second.read(period, 1, at, heading, &allowed, second_lost),
        ];

        let possible = self.bounds.possible(&allowed, t);
        let turns = [first.turns(allowed.acceleration), second.turns(allowed.acceleration)];
        let before = self.train.v;
        let jerk = if self.stand_in.is_some() { BLIND_JERK } else { self.settings.jerk_density };
        let mut way = self.train.run(t, jerk);
        let mut lost = self.judge(&turns, possible, &allowed, t);
        if self.agreed(&allowed, t) {
            self.slips.clear();
            for wheel in &mut self.wheels {
                wheel.watch.believe();
            }
            lost = [None; 2];
        }
        if lost == [Some(Loss::Slide); 2] {
            self.command.disprove();
        }
        let speed_before = self.bounds.speed();
        let bounded = self.narrow(possible, &turns, &allowed, lost, t);

        let trusted = self.trusted(lost);
        let shares = self.shares(trusted, &allowed);
        if trusted.contains(&true) {
            way += self.correct(counted, way, shares);
            self.blind = 0.0;
        } else {
            way = self.stand_in(lost, &allowed, before, t);
        }
        if self.stand_in.is_none() {
            self.past.remember(self.train.v, self.train.a, self.clock);
        }
        let kept = bounded.nearest(self.train.v);
        if kept != self.train.v {
            self.train.v = kept;
        }
        self.distance += self.way * way;
        self.ways.moved(speed_before, bounded, allowed.acceleration, &self.counted(lost, &allowed), t);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(self.way * self.train.v),
            speed_deviation: Speed::from_m_per_s(self.train.speed_deviation()),
            acceleration: Acceleration::from_m_per_s2(self.way * self.train.a),
            distance: Length::from_m(self.distance),
            wheels: self.states(lost),
            mode: self.mode(lost, trusted),
            shares,
            ..last
        };
        let estimate = self.finished(estimate, &last);
        self.turn_round();
        estimate
    }

    /// Which wheelsets slip or slide, and which sensors are believed.
    fn judge(&mut self, turns: &[Range; 2], possible: Range, allowed: &Allowed, t: f64) -> [Option<Loss>; 2] {
        let train = TrainSigns {
            speed: self.train.v,
            acceleration: self.train.a,
            possible,
            slide: allowed.slide,
            slip: allowed.slip,
        };
        let [first, second] = &self.wheels;
        let [first_turns, second_turns] = turns;
        let signs = |wheel: &WheelChannel, range: &Range| Signs {
            speed: wheel.tracker.speed(),
            acceleration: wheel.tracker.acceleration(),
            range: *range,
            acceleration_deviation: wheel.tracker.acceleration_deviation(),
            read: wheel.quality == Quality::Ok && !wheel.watch.doubted(),
            axle: wheel.wheelset.axle,
        };
        let lost = self.slips.judge(&[signs(first, first_turns), signs(second, second_turns)], &train, t);
        self.watch_sensors(turns, possible, allowed, t);
        lost
    }

    /// Which sensors are believed.
    fn watch_sensors(&mut self, turns: &[Range; 2], possible: Range, allowed: &Allowed, t: f64) {
        let [first, second] = &self.wheels;
        let speeds = [first, second].map(|wheel| wheel.is_read().then(|| wheel.tracker.speed()));
        let [first_speed, second_speed] = speeds;
        let beyond = |wheel: &WheelChannel, range: &Range| {
            let (slides, slips) = wheel.may_differ(allowed);
            (range.high < possible.low && !slides) || (range.low > possible.high && !slips)
        };
        let [first_turns, second_turns] = turns;
        let [first_beyond, second_beyond] = [beyond(first, first_turns), beyond(second, second_turns)];
        let [first_sudden, second_sudden] = [first, second].map(|wheel| wheel.quality == Quality::Excluded);
        // What both say at once is no fault of either: the row was read late, or the train is not what it was taken for.
        let both = (first_beyond || first_sudden) && (second_beyond || second_sudden);
        let train = self.train.v;
        for (((wheel, other), impossible), too_sudden) in self
            .wheels
            .iter_mut()
            .zip([second_speed, first_speed])
            .zip([first_beyond, second_beyond])
            .zip([first_sudden, second_sudden])
        {
            if wheel.quality == Quality::Missing {
                continue;
            }
            let (slides, slips) = wheel.may_differ(allowed);
            let shown = Shown {
                pulses: wheel.pulses,
                speed: wheel.tracker.speed(),
                other,
                train,
                may_differ: slides || slips,
                impossible: impossible && !both,
                too_sudden: too_sudden && !both,
            };
            wheel.watch.look(&shown, t);
        }
    }

    /// Whether both wheels have turned alike and smoothly for so long that they roll, whatever was thought of them.
    fn agreed(&mut self, allowed: &Allowed, t: f64) -> bool {
        let [first, second] = &self.wheels;
        let counted = first.is_counted() && second.is_counted();
        let apart = (first.tracker.speed() - second.tracker.speed()).abs();
        let (noise, part) = ALIKE;
        let alike = apart < noise + part * first.tracker.speed().abs();
        let harder = self.vehicle.max_brake.as_m_per_s2().max(self.vehicle.max_traction.as_m_per_s2());
        let smooth = [first, second].iter().all(|wheel| wheel.smooth_acceleration.abs() < harder);
        let turning = first.pulses != 0.0 && second.pulses != 0.0;
        self.alike_for = if counted && alike && smooth && turning { self.alike_for + t } else { 0.0 };
        // Two sensors that are both thought to be wrong are not likely to be.
        let excluded = first.watch.excluded() && second.watch.excluded();
        let held_back = (allowed.slide || allowed.slip) && !excluded;
        self.alike_for > if held_back { ALIKE_HELD_S } else { ALIKE_FREE_S }
            && (self.vehicle.independent || !held_back)
    }

    fn narrow(
        &mut self,
        possible: Range,
        turns: &[Range; 2],
        allowed: &Allowed,
        lost: [Option<Loss>; 2],
        t: f64,
    ) -> Range {
        let [first, second] = &self.wheels;
        let [first_turns, second_turns] = *turns;
        let [first_lost, second_lost] = lost;
        let of = |wheel: &WheelChannel, turns: Range, lost| WheelBounds {
            turns: if wheel.watch.doubted() { Range::ANY } else { turns },
            speed: wheel.tracker.speed(),
            axle: wheel.wheelset.axle,
            lost,
        };
        let wheels = [of(first, first_turns, first_lost), of(second, second_turns, second_lost)];
        let Vehicle { thresholds, independent, .. } = self.vehicle;
        self.bounds.narrow(possible, &wheels, allowed, &Limits { thresholds, independent }, t)
    }

    /// Which wheels may correct the filter.
    fn trusted(&self, lost: [Option<Loss>; 2]) -> [bool; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        [first.is_read() && first_lost.is_none(), second.is_read() && second_lost.is_none()]
    }

    /// How much each wheel and the virtual sensor say.
    fn shares(&self, trusted: [bool; 2], allowed: &Allowed) -> [f64; 3] {
        let [first, second] = &self.wheels;
        match trusted {
            [false, false] => [0.0, 0.0, 1.0],
            [true, false] => [1.0, 0.0, 0.0],
            [false, true] => [0.0, 1.0, 0.0],
            [true, true] => {
                let weight = |wheel: &WheelChannel, other: &WheelChannel| {
                    let sharp = 1.0 / (wheel.pitch * wheel.pitch);
                    let creeps =
                        allowed.slip && wheel.wheelset.axle.may_slip() && !other.wheelset.axle.may_slip();
                    let behind = if allowed.slide {
                        other.tracker.speed() - wheel.tracker.speed()
                    } else if allowed.slip {
                        wheel.tracker.speed() - other.tracker.speed()
                    } else {
                        0.0
                    };
                    let (noise, part) = APART;
                    let apart = behind.max(0.0) / (noise + part * self.train.v.abs());
                    sharp * if creeps { CREEPING_SHARE } else { 1.0 } / (1.0 + apart * apart * apart * apart)
                };
                let (a, b) = (weight(first, second), weight(second, first));
                [a / (a + b), b / (a + b), 0.0]
            }
        }
    }

    /// Lets the trusted wheels correct the filter; by how much that moved the train (m).
    ///
    /// The wheels are read as one counter to which each adds its share of every period. Two counters of their own would
    /// drift apart by what their diameters differ, and tear at the filter whenever the shares change.
    fn correct(&mut self, [first_counted, second_counted]: [f64; 2], way: f64, [a, b, _]: [f64; 3]) -> f64 {
        if self.stand_in.take().is_some() {
            self.ahead = 0.0;
        }
        let [first, second] = &self.wheels;
        let off = |wheel: &WheelChannel, share: f64| share * share * wheel.pitch * wheel.pitch * (1.0 / 12.0);
        let r = off(first, a) + off(second, b);
        self.ahead += a * first_counted + b * second_counted - way;
        let moved = self.train.place(self.ahead, r).moved;
        self.ahead -= moved;
        moved
    }

    /// The virtual sensor takes over; how far the train went (m).
    fn stand_in(&mut self, lost: [Option<Loss>; 2], allowed: &Allowed, before: f64, t: f64) -> f64 {
        let [first, second] = lost;
        let Some(kind) = first.or(second) else {
            // No wheel is read at all: the train goes on as it did.
            self.blind += t;
            self.train.a *= 1.0 - (t / BLIND_S).min(1.0);
            return 0.5 * (before + self.train.v) * t;
        };
        let thresholds = self.vehicle.thresholds;
        let limit = self.vehicle.max_traction.as_m_per_s2();
        let envelope = self.settings.envelope;
        let speed = match envelope {
            Envelope::Fixed => before,
            Envelope::Touches => self.past.speed_without(kind, before, self.clock),
        };
        let commanded = allowed.commanded;
        let begins = Beginning { speed, commanded };
        let sensor = self
            .stand_in
            .get_or_insert_with(|| VirtualSensor::new(kind, begins, limit, envelope, thresholds));
        let [a, b] = &self.wheels;
        let rate = sensor.rate();
        let wheels = [a, b].map(|wheel| {
            let speed = match envelope {
                Envelope::Fixed => Some(wheel.tracker.speed()),
                Envelope::Touches => wheel.steady_speed(rate),
            };
            let acceleration = wheel.tracker.acceleration();
            speed.filter(|_| wheel.is_read()).map(|speed| LostWheel { speed, acceleration })
        });
        let locked = [a, b].iter().all(|wheel| !wheel.is_read() || wheel.tracker.silence() > LOCKED_S);
        let speed = sensor.next(wheels, commanded, locked, t);
        self.train.v = speed;
        self.train.a = sensor.rate();
        0.5 * (before + speed) * t
    }

    /// What the wheels' counts say about the way of the period.
    fn counted(&self, lost: [Option<Loss>; 2], allowed: &Allowed) -> [Counted; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let of = |wheel: &WheelChannel, lost: Option<Loss>| {
            let good = wheel.doubt.is_finite() && !wheel.watch.doubted();
            let axle = wheel.wheelset.axle;
            Counted {
                pulses: wheel.pulses,
                doubt: if good { wheel.doubt } else { 0.0 },
                pitch: wheel.pitch_range,
                at_least: good && lost != Some(Loss::Spin) && !(allowed.slip && axle.may_slip()),
                at_most: good && lost != Some(Loss::Slide) && !(allowed.slide && axle.may_slide()),
            }
        };
        [of(first, first_lost), of(second, second_lost)]
    }

    fn states(&self, lost: [Option<Loss>; 2]) -> [WheelState; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let state = |wheel: &WheelChannel, lost| match lost {
            _ if !wheel.is_read() => WheelState::Excluded,
            Some(Loss::Slide) => WheelState::Slide,
            Some(Loss::Spin) => WheelState::Spin,
            None => WheelState::Rolling,
        };
        [state(first, first_lost), state(second, second_lost)]
    }

    fn mode(&self, lost: [Option<Loss>; 2], trusted: [bool; 2]) -> Mode {
        let corrected = self.stand_in.as_ref().map_or(0.0, VirtualSensor::elapsed);
        let longest = self.vehicle.thresholds.longest_correction.as_s();
        if self.blind > BLIND_S || (corrected > longest && self.train.v > TURNED_ROUND) {
            return Mode::Ambiguous;
        }
        if self.wheels.iter().any(|wheel| !wheel.is_read()) {
            return Mode::Degraded;
        }
        match (trusted, lost) {
            ([false, false], _) => Mode::Correction,
            (_, [None, None]) => Mode::Normal,
            _ => Mode::OneSlip,
        }
    }

    /// Fills in the bounds, in the sense in which distance grows, and the amounts that never decrease.
    fn finished(&self, estimate: MotionEstimate, last: &MotionEstimate) -> MotionEstimate {
        let (mut speed, mut ways) = (self.bounds.speed(), self.ways.distance());
        if self.way < 0.0 {
            (speed, ways) = (speed.reversed(), ways.reversed());
        }
        let distance = estimate.distance.as_m();
        let over = Length::from_m(distance - ways.low).max(last.over);
        let under = Length::from_m(ways.high - distance).max(last.under);
        MotionEstimate {
            speed_low: Speed::from_m_per_s(speed.low),
            speed_high: Speed::from_m_per_s(speed.high),
            distance_low: Length::from_m(ways.low),
            distance_high: Length::from_m(ways.high),
            over,
            under,
            ..estimate
        }
    }

    /// Looks the other way once the train has turned round.
    fn turn_round(&mut self) {
        let says = |wheel: &WheelChannel| wheel.told.way() * self.way;
        let back = self.wheels.iter().any(|wheel| says(wheel) < 0.0 && wheel.told.convincing());
        if self.train.v > -TURNED_ROUND || !back || self.wheels.iter().any(|wheel| says(wheel) > 0.0) {
            return;
        }
        self.turn();
    }

    fn turn(&mut self) {
        self.way = -self.way;
        self.train.reverse();
        self.bounds.reverse();
        self.ways.reverse();
        self.slips.clear();
        self.stand_in = None;
        self.ahead = -self.ahead;
        for wheel in &mut self.wheels {
            wheel.reverse();
        }
    }
}

fn worse(one: Mode, other: Mode) -> Mode {
    if one == Mode::Ambiguous { one } else { other }
}
