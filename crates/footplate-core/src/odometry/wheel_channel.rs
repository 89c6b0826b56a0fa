//! One wheelset: from its reading to its speed, its acceleration and the bounds that its counts set.

use super::command_watch::Allowed;
use super::wheels::{
    CountWindows, Expected, Heading, Period, Quality, Range, ReportedDirection, Tachometer, Vehicle,
    WheelReading, WheelTracker, Wheelset, larger, smaller,
};

/// A count of a rolling wheel differs from the expected one by no more than this (pulses): one for the phase at either end, one
/// for a change of acceleration ...
const SURPRISE_PULSES: f64 = 2.2;
/// ... and rarely by more than this.
const RARE_PULSES: f64 = 1.5;
/// Largest accelerations of a wheelset (m/s²): of one that can only roll, and of one that can slip, slide or regain its grip.
const ROLLING: f64 = 2.5;
const SLIPPING: f64 = 30.0;
/// A count that is the same for longer is hardly that of a wheel (s).
const STUCK_AFTER_S: f64 = 0.7;
/// Counts of rolling wheels differ by no more than these pulses, and this part of them (diameters, creepage in curves).
const APART_PULSES: f64 = 2.0;
const APART_PART: f64 = 0.03;
/// Over a constant count that lasts this long (s), rolling wheels run as far as each other as they did before, to these pulses and
/// this part of the distance (creepage in curves and under effort) beyond the tolerances of the diameters.
const APART_AFTER_S: f64 = 1.5;
const RAN_APART_PART: f64 = 0.005;
/// How long distances count by which both wheels rolled before (s).
const LATELY_S: f64 = 60.0;
/// Readings after which the tracker's expectation is good enough to reject a count.
const WARM: u32 = 8;
/// How many times faster than the fastest train a wheel may turn: one that rolls or is braked, and one that a motor can
/// spin. A wheel that slip control lets run away by 1.3 m/s² passes four times the top speed in two to three minutes.
const FASTER_THAN_TRAIN: f64 = 1.2;
const FASTER_SPINNING: f64 = 20.0;

/// One wheelset as the odometer follows it.
#[derive(Debug, Clone)]
pub(super) struct WheelChannel {
    pub(super) wheelset: Wheelset,
    /// Pitch by the stated diameter (m) ...
    pub(super) wheelset_pitch: f64,
    /// ... and by the learnt one (m).
    pub(super) pitch: f64,
    pub(super) pitch_range: Range,
    /// The inverse of the pitch (1/m).
    pulses_per_m: f64,
    pub(super) tracker: WheelTracker,
    pub(super) quality: Quality,
    /// Pulses of the period in the direction of travel.
    pub(super) pulses: f64,
    /// Those of them that were not read in the period.
    pub(super) late: f64,
    /// How long its count has been the same and not zero (s).
    same_for: f64,
    /// How far it turned in that time, and how much farther the other wheel did (m).
    turned_same: f64,
    other_further: f64,
    /// How far it and the other wheel turned lately while both seemed to roll (m).
    turned_lately: [f64; 2],
    /// That count is no wheel's.
    pub(super) stuck: bool,
    /// How many pulses its last count may be wrong by.
    pub(super) uncertainty: f64,
    uncertainty_before: f64,
    /// The direction that its sensor reported lately.
    pub(super) reported: ReportedDirection,
    tachometer: Tachometer,
    windows: CountWindows,
    readings: u32,
    most_per_second: f64,
}

impl WheelChannel {
    pub(super) fn new(wheelset: Wheelset, vehicle: &Vehicle) -> Self {
        let pitch = wheelset.pulse_pitch().as_m();
        let period = vehicle.period.as_s();
        let faster = if wheelset.axle.may_slip() { FASTER_SPINNING } else { FASTER_THAN_TRAIN };
        Self {
            wheelset,
            wheelset_pitch: pitch,
            pitch,
            pitch_range: Range::around(pitch, wheelset.diameter_tolerance),
            pulses_per_m: 1.0 / pitch,
            tracker: WheelTracker::new(pitch, period),
            quality: Quality::Missing,
            pulses: 0.0,
            late: 0.0,
            same_for: 0.0,
            turned_same: 0.0,
            other_further: 0.0,
            turned_lately: [0.0; 2],
            stuck: false,
            uncertainty: 0.0,
            uncertainty_before: 0.0,
            reported: ReportedDirection::default(),
            tachometer: Tachometer::new(),
            windows: CountWindows::new(period),
            readings: 0,
            most_per_second: faster * vehicle.max_speed.as_m_per_s() / pitch,
        }
    }

    /// Takes in a reading, `t` seconds after the last one where `nominal` were planned. Returns how far the wheel turned (m).
    #[inline]
    pub(super) fn read(
        &mut self,
        period: &Period,
        which: usize,
        (t, nominal): (f64, f64),
        heading: Heading,
        allowed: &Allowed,
    ) -> f64 {
        let Some(reading) = period.wheels.get(which) else { return 0.0 };
        let expected = self.tracker.expected(t) * self.pulses_per_m;
        let (may_slide, may_slip) = self.may_differ(allowed);
        let most = if may_slide || may_slip { SLIPPING } else { ROLLING };
        let warm = self.readings >= WARM;
        // What an acceleration of 1 m/s² that sets in at once adds to a count.
        let added = t * t * self.pulses_per_m;
        let leeway = |acceleration: f64| {
            if warm { SURPRISE_PULSES + acceleration * added } else { f64::INFINITY }
        };
        let expectation = Expected {
            pulses: expected * heading.direction,
            more: leeway(most),
            fewer: leeway(most),
            rolling: RARE_PULSES + ROLLING * added,
            most: self.most_per_second * t + SURPRISE_PULSES,
        };
        let turn = self.tachometer.read(reading, t / nominal, heading, &expectation);
        self.quality = turn.quality;
        let pulses = turn.pulses * heading.direction;
        self.same_for = if pulses == self.pulses && pulses != 0.0 { self.same_for + t } else { 0.0 };
        self.pulses = pulses;
        self.late = turn.late * heading.direction;
        let counted = self.pulses * self.pitch;
        self.uncertainty = turn.uncertainty;
        if turn.uncertainty.is_finite() {
            // A row that was read late is short of nothing, but the next window may begin with it.
            self.windows.counted(t, self.pulses, turn.uncertainty + self.uncertainty_before);
            self.uncertainty_before = turn.uncertainty;
        } else {
            self.uncertainty_before = 0.0;
            self.windows.counted(t, self.pulses, 0.0);
            self.windows.interrupt();
        }
        if turn.quality == Quality::Missing {
            self.readings = 0;
            self.tracker.turned(self.tracker.expected(t), t);
            return counted;
        }
        if self.readings == 0 {
            self.tracker.restart(counted / t);
        }
        self.readings = self.readings.saturating_add(1);
        self.tracker.turned(counted, t);
        counted
    }

    /// Takes in the direction that the sensor reports.
    pub(super) fn read_direction(&mut self, reading: &WheelReading, sign: f64, t: f64) {
        self.reported.read(reading, self.tachometer.wiring(), sign * self.pulses, t);
    }

    /// The first reading of a run, which tells only a speed.
    pub(super) fn begin(&mut self, period: &Period, which: usize, t: f64) -> Option<f64> {
        let reading = period.wheels.get(which)?;
        let most = self.most_per_second * t + SURPRISE_PULSES;
        let any = f64::INFINITY;
        let open = Expected { pulses: 0.0, more: any, fewer: any, rolling: any, most };
        let uncertain = Heading { direction: 1.0, certain: false, disputed: false };
        let turn = self.tachometer.read(reading, 1.0, uncertain, &open);
        self.quality = turn.quality;
        if turn.quality == Quality::Missing {
            return None;
        }
        Some(turn.pulses * self.pitch / t)
    }

    /// The speeds that the train can have if this wheel rolls; any while its count is uncertain.
    pub(super) fn turns(&self, acceleration: Range) -> Range {
        if self.uncertainty.is_infinite() {
            return Range::ANY;
        }
        self.windows.speed(self.pitch_range, acceleration)
    }

    /// Its diameter is `scale` times the stated one.
    pub(super) fn rescale(&mut self, scale: f64, bounds: Range) {
        self.pitch = self.wheelset_pitch * scale;
        self.pulses_per_m = 1.0 / self.pitch;
        self.pitch_range =
            Range { low: self.wheelset_pitch * bounds.low, high: self.wheelset_pitch * bounds.high };
    }

    /// Whether its count has been constant for too long: that of a wheel that turns changes by one now and then.
    fn stands_still(&self) -> bool {
        self.same_for > STUCK_AFTER_S
    }

    /// Whether its count changes as that of a wheel that turns.
    fn moves(&self) -> bool {
        self.is_read() && self.pulses != 0.0 && !self.stands_still()
    }

    /// Compares both counts of a period of `t` seconds. A constant count, not zero, beside one that changes and is apart from
    /// it is stuck until it changes itself, even if the other wheel stops. At a constant speed near a whole number of pulses
    /// in a period the counts of rolling wheels are constant, too, and not apart.
    pub(super) fn compare(&mut self, other: &mut Self, t: f64) {
        let (turned, other_turned) = (self.pulses * self.pitch, other.pulses * other.pitch);
        let least = APART_PULSES * larger(self.pitch, other.pitch);
        let apart =
            (turned - other_turned).abs() > least + APART_PART * larger(turned.abs(), other_turned.abs());
        let tolerance = self.tolerance() + other.tolerance() + RAN_APART_PART;
        let both_roll = !apart && self.moves() && other.moves();
        self.compare_distance(turned, other_turned, both_roll, t);
        other.compare_distance(other_turned, turned, both_roll, t);
        let moves = self.moves() && (apart || other.ran_apart(least, tolerance));
        let other_moves = other.moves() && (apart || self.ran_apart(least, tolerance));
        for (wheel, beside) in [(self, other_moves), (other, moves)] {
            let was = wheel.stuck;
            wheel.stuck = wheel.stands_still() && (was || beside);
            if was && !wheel.stuck && wheel.uncertainty > 0.0 {
                // What was followed while it was stuck says nothing.
                wheel.tracker.restart(wheel.pulses * wheel.pitch / t);
            }
        }
    }

    /// Adds up how far the other wheel turned beyond it (m) since its count has been constant, and how far both turned before.
    fn compare_distance(&mut self, turned: f64, other_turned: f64, both_roll: bool, t: f64) {
        if both_roll {
            let kept = 1.0 - smaller(t / LATELY_S, 1.0);
            let [own, other] = self.turned_lately;
            self.turned_lately = [kept * own + turned.abs(), kept * other + other_turned.abs()];
        }
        if self.same_for > 0.0 {
            self.turned_same += turned.abs();
            self.other_further += (other_turned - turned) * turned.signum();
        } else {
            (self.turned_same, self.other_further) = (0.0, 0.0);
        }
    }

    /// Whether the other wheel turned farther or less far, while its count was constant, than rolling wheels do. A tooth that is missing
    /// makes one run less far all the time.
    fn ran_apart(&self, least: f64, part: f64) -> bool {
        let [own, other] = self.turned_lately;
        let most = 1.0 / f64::from(self.wheelset.teeth);
        let usual = if own > 0.0 { larger(smaller(other / own - 1.0, most), -most) } else { 0.0 };
        let off = self.other_further - usual * self.turned_same;
        self.same_for > APART_AFTER_S && off.abs() > least + part * self.turned_same
    }

    /// The true pitch lies within this part of the assumed one.
    pub(super) fn tolerance(&self) -> f64 {
        0.5 * self.pitch_range.width() * self.pulses_per_m
    }

    /// Reverses everything: the train has reversed.
    pub(super) fn reverse(&mut self) {
        self.tracker.reverse();
        self.windows.reverse();
    }

    /// Whether it may slide and whether it may slip now.
    pub(super) fn may_differ(&self, allowed: &Allowed) -> (bool, bool) {
        let axle = self.wheelset.axle;
        (allowed.slide && axle.may_slide(), allowed.slip && axle.may_slip())
    }

    /// Whether its sample was read.
    pub(super) fn is_read(&self) -> bool {
        self.quality != Quality::Missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::wheels::Axle;
    use crate::time::{TimeSpan, Timestamp};
    use crate::units::{Acceleration, Length, Speed};

    /// A period (s).
    const T: f64 = 0.1;
    const FORWARD: Heading = Heading { direction: 1.0, certain: true, disputed: false };

    /// Two wheelsets of 100 teeth, whose diameters are known to 0.2 %, of a train of 40 m/s.
    fn channels() -> [WheelChannel; 2] {
        let axle = Axle::Trailing;
        let wheelset =
            Wheelset { teeth: 100, diameter: Length::from_m(1.0), diameter_tolerance: 0.002, axle };
        let abilities = [1.0, 1.2].map(Acceleration::from_m_per_s2);
        let (period, top) = (TimeSpan::from_s(T), Speed::from_m_per_s(40.0));
        let vehicle = Vehicle::new(period, top, abilities, [wheelset; 2]).unwrap();
        [(); 2].map(|()| WheelChannel::new(wheelset, &vehicle))
    }

    fn period(counts: [i64; 2]) -> Period {
        Period {
            time: Timestamp::ZERO,
            wheels: counts.map(WheelReading::pulses),
            effort: None,
            acceleration: None,
            balise: None,
            balise_deviation: None,
        }
    }

    /// Reads both counts. Returns whether each is stuck.
    fn read([first, second]: &mut [WheelChannel; 2], counts: [i64; 2]) -> [bool; 2] {
        let acceleration = Range { low: -1.2, high: 1.0 };
        let allowed = Allowed {
            slide: false,
            slip: false,
            acceleration,
            rolling: acceleration,
            commanded: None,
            traction: 0.0,
            brake: 0.0,
        };
        for (which, channel) in [&mut *first, &mut *second].into_iter().enumerate() {
            let turned = channel.read(&period(counts), which, (T, T), FORWARD, &allowed);
            let pitch = core::f64::consts::PI / 100.0;
            assert!((turned - counts[which] as f64 * pitch).abs() < 1e-9, "{turned} {counts:?}");
        }
        first.compare(second, T);
        [first.stuck, second.stuck]
    }

    /// The number of periods after the first until the first wheel's count of 30 is stuck beside these two in turn; at most 60.
    fn stuck_beside(other: [i64; 2]) -> Option<usize> {
        let mut wheels = channels();
        (0..=60).find(|nth| read(&mut wheels, [30, other[nth % 2]])[0])
    }

    #[test]
    fn a_constant_count_is_stuck_after_0_7_s_beside_one_that_changes_and_is_apart() {
        // Apart by more than two pulses and 3 % of 40.
        assert_eq!(stuck_beside([40, 41]), Some(8));
        assert_eq!(stuck_beside([20, 21]), Some(8));
        assert_eq!(stuck_beside([33, 33]), None, "the other is constant, too");
        assert_eq!(stuck_beside([30, 30]), None);
    }

    #[test]
    fn a_constant_count_is_stuck_after_1_5_s_where_the_other_wheel_runs_farther_than_it_used_to() {
        // One pulse farther in each period, of which a missing tooth of 100 explains 0.3. After 15 periods the rest is 10 pulses; two, and 0.9 %
        // of 450, are 6.
        assert_eq!(stuck_beside([30, 32]), Some(15));
        assert_eq!(stuck_beside([28, 30]), Some(15));
        // Half a pulse is no more than the missing tooth and the diameters explain.
        assert_eq!(stuck_beside([30, 31]), None);
    }

    #[test]
    fn a_stuck_count_stays_stuck_until_it_changes() {
        let mut wheels = channels();
        for nth in 0..10 {
            read(&mut wheels, [30, 40 + nth % 2]);
        }
        assert_eq!(read(&mut wheels, [30, 39]), [true, false]);
        assert_eq!(read(&mut wheels, [30, 39]), [true, false]);
        assert_eq!(read(&mut wheels, [31, 39]), [false, false]);
    }

    #[test]
    fn a_learnt_diameter_is_known_as_well_as_its_bounds_say() {
        let [mut wheel, _] = channels();
        assert!((wheel.tolerance() - 0.002).abs() < 1e-12, "{}", wheel.tolerance());
        wheel.rescale(1.01, Range { low: 1.009, high: 1.012 });
        // Half of 0.003 of 1.01.
        assert!((wheel.tolerance() - 0.001_485_149).abs() < 1e-9, "{}", wheel.tolerance());
        assert!((wheel.pitch - 1.01 * core::f64::consts::PI / 100.0).abs() < 1e-12);
    }

    #[test]
    fn a_first_count_is_a_speed_unless_no_train_is_so_fast() {
        let begun = |count| channels()[0].begin(&period([count, 0]), 0, T);
        // 30 pulses of 31.4 mm in 0.1 s.
        assert!((begun(30).unwrap() - 9.424_778).abs() < 1e-6);
        // 1.2 times 40 m/s are 152.8 pulses, and 2.2 more.
        assert!(begun(154).is_some() && begun(155).is_none());
    }
}
