//! One wheelset from its reading to what it shows: speed, acceleration, and the bounds that its counts set.

use super::command_watch::Allowed;
use crate::wheels::{
    CountWindows, Expected, Heading, Loss, Period, Quality, Range, SensorWatch, Tachometer, ToldWay, Vehicle,
    WheelReading, WheelTracker, Wheelset, smaller,
};

/// Pulses by which a count can surprise a wheel that rolls: one for the phase at either end, one for what its
/// acceleration changed meanwhile ...
const SURPRISE_PULSES: f64 = 2.2;
/// ... and by which it rarely does.
const RARE_PULSES: f64 = 1.5;
/// No wheelset on rails was seen to change its speed faster (m/s²): locking on the poorest rail takes 20.
const EVER: f64 = 40.0;
/// Accelerations of a wheelset beyond which a count is not one of a wheel (m/s²): the train's and noise, a wheel that
/// slips or slides, one that regains its grip.
const ROLLING: f64 = 2.5;
const LOSING: f64 = 20.0;
const REGAINING: f64 = 30.0;
/// Readings before the tracker knows enough to be surprised.
const WARM: u32 = 8;
/// By how much a wheel may turn faster than the fastest train (m/s): spinning on the spot.
const FASTER_THAN_TRAIN: f64 = 1.2;
/// Time over which the acceleration is smoothed that tells braking from coasting (s).
const SMOOTHED_S: f64 = 0.5;

/// What one wheelset tells the odometer.
#[derive(Debug, Clone)]
pub(super) struct WheelChannel {
    pub(super) wheelset: Wheelset,
    /// By the diameter it is believed to have (m) ...
    pub(super) wheelset_pitch: f64,
    /// ... and by what was learnt of it.
    pub(super) pitch: f64,
    pub(super) pitch_range: Range,
    /// The inverse of the pitch (1/m).
    pulses_per_m: f64,
    pub(super) tracker: WheelTracker,
    pub(super) watch: SensorWatch,
    pub(super) quality: Quality,
    /// Pulses of the period in the direction of travel.
    pub(super) pulses: f64,
    pub(super) smooth_acceleration: f64,
    pub(super) missing_for: f64,
    /// By how many pulses its last count may be wrong.
    pub(super) doubt: f64,
    doubt_before: f64,
    /// Which way its sensor lately said it turned.
    pub(super) told: ToldWay,
    tachometer: Tachometer,
    windows: CountWindows,
    readings: u32,
    most_per_second: f64,
}

impl WheelChannel {
    pub(super) fn new(wheelset: Wheelset, vehicle: &Vehicle) -> Self {
        let pitch = wheelset.pulse_pitch().as_m();
        let period = vehicle.period.as_s();
        Self {
            wheelset,
            wheelset_pitch: pitch,
            pitch,
            pitch_range: Range::around(pitch, wheelset.diameter_tolerance),
            pulses_per_m: 1.0 / pitch,
            tracker: WheelTracker::new(pitch, period),
            watch: SensorWatch::new(),
            quality: Quality::Missing,
            pulses: 0.0,
            smooth_acceleration: 0.0,
            missing_for: 0.0,
            doubt: 0.0,
            doubt_before: 0.0,
            told: ToldWay::default(),
            tachometer: Tachometer::new(),
            windows: CountWindows::new(period),
            readings: 0,
            most_per_second: FASTER_THAN_TRAIN * vehicle.max_speed.as_m_per_s() / pitch,
        }
    }

    /// Takes in a reading, `t` seconds after the last one and `nominal` after by plan; says how far the wheel turned (m).
    #[inline]
    pub(super) fn read(
        &mut self,
        period: &Period,
        which: usize,
        (t, nominal): (f64, f64),
        heading: Heading,
        allowed: &Allowed,
        lost: Option<Loss>,
    ) -> f64 {
        let Some(reading) = period.wheels.get(which) else { return 0.0 };
        let expected = self.tracker.expected(t) * self.pulses_per_m;
        let (may_slide, may_slip) = self.may_differ(allowed);
        // Only a wheel that has lost its grip can regain it.
        let (up, down) = match (lost, may_slide, may_slip) {
            (Some(_), ..) => (REGAINING, REGAINING),
            (None, true, _) => (ROLLING, LOSING),
            (None, false, true) => (LOSING, ROLLING),
            (None, false, false) => (ROLLING, ROLLING),
        };
        let warm = self.readings >= WARM && !self.watch.excluded();
        // What an acceleration of 1 m/s² that sets in at once adds to a count.
        let added = t * t * self.pulses_per_m;
        let leeway = |acceleration: f64| {
            if warm { SURPRISE_PULSES + acceleration * added } else { f64::INFINITY }
        };
        // Expectation and leeway in the sense in which the tachometer counts.
        let (more, fewer) =
            if heading.way < 0.0 { (leeway(down), leeway(up)) } else { (leeway(up), leeway(down)) };
        let expectation = Expected {
            pulses: expected * heading.way,
            more,
            fewer,
            rolling: RARE_PULSES + ROLLING * added,
            ever: SURPRISE_PULSES + EVER * 2.0 * added,
            most: self.most_per_second * t + SURPRISE_PULSES,
        };
        let turn = self.tachometer.read(reading, t / nominal, heading, &expectation);
        self.quality = turn.quality;
        self.pulses = turn.pulses * heading.way;
        let counted = self.pulses * self.pitch;
        self.doubt = turn.doubt;
        if turn.doubt.is_finite() {
            // A row that was read late is short of nothing, but the next window may begin with it.
            self.windows.counted(t, self.pulses, turn.doubt + self.doubt_before);
            self.doubt_before = turn.doubt;
        } else {
            self.doubt_before = 0.0;
            self.windows.counted(t, self.pulses, 0.0);
            self.windows.interrupt();
        }
        if matches!(turn.quality, Quality::Missing | Quality::Excluded) {
            self.missing_for += t;
            self.readings = 0;
            self.tracker.turned(self.tracker.expected(t), t);
            return counted;
        }
        if self.readings == 0 && self.missing_for > 0.0 {
            self.tracker.restart(counted / t);
        }
        self.missing_for = 0.0;
        self.readings = self.readings.saturating_add(1);
        self.tracker.turned(counted, t);
        self.smooth_acceleration +=
            (self.tracker.acceleration() - self.smooth_acceleration) * smaller(t / SMOOTHED_S, 1.0);
        counted
    }

    /// Minds which way the sensor says it turned.
    pub(super) fn hear(&mut self, reading: &WheelReading, way: f64, t: f64) {
        self.told.hear(reading, self.tachometer.wiring(), way * self.pulses, t);
    }

    /// The first reading of a run: only a speed is known from it.
    pub(super) fn begin(&mut self, period: &Period, which: usize, t: f64) -> Option<f64> {
        let reading = period.wheels.get(which)?;
        let most = self.most_per_second * t + SURPRISE_PULSES;
        let any = f64::INFINITY;
        let open = Expected { pulses: 0.0, more: any, fewer: any, rolling: any, ever: any, most };
        let uncertain = Heading { way: 1.0, certain: false, disputed: false };
        let turn = self.tachometer.read(reading, 1.0, uncertain, &open);
        self.quality = turn.quality;
        if turn.quality == Quality::Missing {
            return None;
        }
        let speed = turn.pulses * self.pitch / t;
        self.tracker.restart(speed);
        Some(speed)
    }

    /// Between which speeds the train must run if this wheel rolls; nothing if it is not asked.
    pub(super) fn turns(&self, acceleration: Range) -> Range {
        if self.watch.excluded() || self.doubt.is_infinite() {
            return Range::ANY;
        }
        self.windows.speed(self.pitch_range, acceleration)
    }

    /// How fast it turns by its last counts alone (m/s), moved to now with an acceleration (m/s²). The tracker is quicker,
    /// but overshoots when a wheel that regains its grip stops accelerating.
    pub(super) fn steady_speed(&self, acceleration: f64) -> Option<f64> {
        self.windows.mean_speed(self.pitch).map(|(speed, age)| speed + acceleration * age)
    }

    /// Its diameter is so many times the believed one.
    pub(super) fn rescale(&mut self, scale: f64, bounds: Range) {
        self.pitch = self.wheelset_pitch * scale;
        self.pulses_per_m = 1.0 / self.pitch;
        self.pitch_range =
            Range { low: self.wheelset_pitch * bounds.low, high: self.wheelset_pitch * bounds.high };
    }

    /// The train has turned round.
    pub(super) fn reverse(&mut self) {
        self.tracker.reverse();
        self.windows.reverse();
        self.smooth_acceleration = -self.smooth_acceleration;
    }

    /// Whether it may slide and whether it may slip now.
    pub(super) fn may_differ(&self, allowed: &Allowed) -> (bool, bool) {
        let axle = self.wheelset.axle;
        (allowed.slide && axle.may_slide(), allowed.slip && axle.may_slip())
    }

    /// Its sample was read, whether or not its sensor is believed.
    pub(super) fn is_counted(&self) -> bool {
        !matches!(self.quality, Quality::Missing | Quality::Excluded)
    }

    /// Its sample was read and its sensor is believed.
    pub(super) fn is_read(&self) -> bool {
        self.is_counted() && !self.watch.excluded()
    }
}
