//! Detects standstill from an accelerometer alone.
//!
//! A running train trembles, a standing one does not; but how much depends on the car, the track and where the sensor lies.
//! So the tremor of one and a half seconds, after a straight line is taken out of each axis, is compared with what is usual
//! for this train while it runs. A train that coasts slowly trembles little as well. So it is asked in addition whether the
//! acceleration was steady and near zero, and the speed near zero, as far as the drift of the sensor allows to say.
//!
//! A standing train has left when its acceleration has, or when it trembles as a running one does.

use super::acceleration_block::{AccelerationBlock, BLOCK_S};
use crate::time::Timestamp;

/// The blocks that are looked at together: 1.5 s.
pub(super) const WATCHED: usize = 15;
/// Over so many of the latest blocks an acceleration has to last to be a departure: 0.5 s.
pub(super) const DEPARTING: usize = 5;
/// What is usual before anything was learnt (m/s²). Measured in a metro: 0.17 to 0.26.
const USUAL: f64 = 0.2;
/// What is usual is followed by at most one e-fold in this time (s), which makes it the median.
const USUAL_FOLLOWS_S: f64 = 40.0;
/// Jerk below which an acceleration is steady (m/s³). Chosen: an eighth of the jerk of comfortable driving.
const STEADY_JERK: f64 = 0.12;
/// While a train stands, what is read is followed as offset within this time (s).
const OFFSET_FOLLOWS_S: f64 = 1.0;
/// A speed up to this counts as none, drift apart (m/s).
const NO_SPEED: f64 = 0.5;

/// How far an accelerometer may drift between two stops. Bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftLimits {
    /// What it may be off at once, gradients included (m/s²).
    pub offset_m_per_s2: f64,
    /// By how much that may grow in a second (m/s³): for a restored high pass the offset of the reading over its time
    /// constant.
    pub growth_m_per_s3: f64,
}

impl DriftLimits {
    /// A sensor that reads steady acceleration, on gradients up to 40 mm/m.
    #[must_use]
    pub const fn steady() -> Self {
        Self { offset_m_per_s2: 0.45, growth_m_per_s3: 0.0 }
    }

    /// A sensor whose high pass of 7 s was undone, with readings offset by up to 0.1 m/s², as that of a phone.
    #[must_use]
    pub const fn restored() -> Self {
        Self { offset_m_per_s2: 0.2, growth_m_per_s3: 0.1 / 7.0 }
    }

    fn acceleration(&self, seconds: f64) -> f64 {
        self.offset_m_per_s2 + self.growth_m_per_s3 * seconds
    }

    fn speed(&self, seconds: f64) -> f64 {
        NO_SPEED + self.offset_m_per_s2 * seconds + 0.5 * self.growth_m_per_s3 * seconds * seconds
    }
}

/// What tells a standing train from a running one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandstillThresholds {
    /// A standing train trembles less than this part of what is usual while it runs.
    pub quiet: f64,
    /// A train trembles as a running one does from this part of it on.
    pub loud: f64,
    /// Acceleration that is a departure (m/s²).
    pub departure_m_per_s2: f64,
}

impl Default for StandstillThresholds {
    /// Measured on three trips of a metro: quiet below 0.45 (0.3 misses stops, 0.5 takes one slow stretch for a stop), loud from
    /// 0.8 on. Departures are chosen: half of what a full-size train starts with on a bad day.
    fn default() -> Self {
        Self { quiet: 0.45, loud: 0.8, departure_m_per_s2: 0.2 }
    }
}

/// Whether the train is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Standing {
    /// Too little was seen to say.
    Unknown,
    /// It stands, and has since about this time.
    Since(Timestamp),
    /// It runs, and has since about this time.
    LeftAt(Timestamp),
}

/// Watches an accelerometer. Fixed memory.
#[derive(Debug, Clone)]
pub struct StandstillDetector {
    drift: DriftLimits,
    thresholds: StandstillThresholds,
    /// The latest blocks, the newest last.
    blocks: [Option<AccelerationBlock>; WATCHED],
    standing: Standing,
    /// What the acceleration along the track reads too much.
    offset: f64,
    /// The speed since the departure, as far as the accelerometer knows.
    speed: f64,
    /// Seconds since the departure.
    running: Option<f64>,
    usual: f64,
}

impl StandstillDetector {
    /// Has seen nothing yet.
    #[must_use]
    pub fn new(drift: DriftLimits) -> Self {
        Self::with_thresholds(drift, StandstillThresholds::default())
    }

    /// The same with thresholds of its own.
    #[must_use]
    pub fn with_thresholds(drift: DriftLimits, thresholds: StandstillThresholds) -> Self {
        Self {
            drift,
            thresholds,
            blocks: [None; WATCHED],
            standing: Standing::Unknown,
            offset: 0.0,
            speed: 0.0,
            running: None,
            usual: USUAL,
        }
    }

    /// Takes in a block and returns whether the train is at rest at its end.
    pub fn take(&mut self, block: AccelerationBlock) -> Standing {
        self.blocks.rotate_left(1);
        if let Some(newest) = self.blocks.last_mut() {
            *newest = Some(block);
        }
        self.speed += (block.along - self.offset) * block.lasted;
        if let Some(running) = &mut self.running {
            *running += block.lasted;
        }
        if let Some(window) = Window::of(&self.blocks) {
            if let Standing::Since(_) = self.standing {
                self.watch_standing(&window);
            } else {
                self.watch_running(&window, &block);
            }
        }
        self.standing
    }

    /// Whether the train stood at the end of the latest block.
    #[must_use]
    pub fn standing(&self) -> Standing {
        self.standing
    }

    /// What the acceleration along the track reads at standstill (m/s²).
    pub(super) fn offset(&self) -> f64 {
        self.offset
    }

    /// The latest blocks, the newest last.
    pub(super) fn blocks(&self) -> impl DoubleEndedIterator<Item = &AccelerationBlock> {
        self.blocks.iter().flatten()
    }

    fn watch_running(&mut self, window: &Window, block: &AccelerationBlock) {
        let off = window.along - self.offset;
        let possible = self.running.is_none_or(|seconds| {
            self.speed.abs() < self.drift.speed(seconds) && off.abs() < self.drift.acceleration(seconds)
        });
        if possible && window.tremor < self.thresholds.quiet * self.usual && window.jerk.abs() < STEADY_JERK {
            self.standing = Standing::Since(window.start);
            self.offset = window.along;
            self.running = None;
        } else {
            let follows = block.lasted / USUAL_FOLLOWS_S;
            self.usual *= if window.tremor > self.usual { 1.0 + follows } else { 1.0 - follows };
        }
    }

    fn watch_standing(&mut self, window: &Window) {
        let departing = window.latest_along - self.offset;
        let StandstillThresholds { loud, departure_m_per_s2, .. } = self.thresholds;
        if departing.abs() > departure_m_per_s2 || window.tremor > loud * self.usual {
            self.standing = Standing::LeftAt(window.latest_start);
            self.running = Some(window.latest_lasted);
            self.speed = departing * window.latest_lasted;
            return;
        }
        // Not the latest: they may belong to a departure that is noticed only later.
        let before = self.blocks().rev().nth(DEPARTING).copied();
        if let Some(before) = before {
            self.offset += (before.along - self.offset) * (before.lasted / OFFSET_FOLLOWS_S).min(1.0);
        }
    }
}

/// What the watched blocks say together.
struct Window {
    start: Timestamp,
    /// Mean acceleration along the track (m/s²).
    along: f64,
    /// Its change (m/s³).
    jerk: f64,
    /// What is left of all axes when a straight line is taken out of each (m/s²).
    tremor: f64,
    latest_start: Timestamp,
    latest_along: f64,
    latest_lasted: f64,
}

impl Window {
    /// `None` until all blocks are there, and where there is a gap between them.
    fn of(blocks: &[Option<AccelerationBlock>; WATCHED]) -> Option<Self> {
        let [Some(first), ..] = blocks else { return None };
        if blocks.iter().flatten().any(|block| block.lasted > 3.0 * BLOCK_S) {
            return None;
        }
        let all = || blocks.iter().flatten();
        let count = all().count() as f64;
        let mean = |of: &dyn Fn(&AccelerationBlock) -> f64| all().map(of).sum::<f64>() / count;
        let time = |block: &AccelerationBlock| (block.end - first.end).as_s();
        let mean_time = mean(&time);
        let spread = mean(&|block| (time(block) - mean_time) * (time(block) - mean_time));
        let line = |of: &dyn Fn(&AccelerationBlock) -> f64| {
            let middle = mean(of);
            (middle, mean(&|block| (time(block) - mean_time) * (of(block) - middle)) / spread)
        };
        let mut tremor = mean(&|block| block.variance);
        for axis in 0..3 {
            let of = |block: &AccelerationBlock| block.axes.get(axis).copied().unwrap_or_default();
            let (middle, slope) = line(&of);
            tremor += mean(&|block| {
                let beside = of(block) - middle - slope * (time(block) - mean_time);
                beside * beside
            });
        }
        let (along, jerk) = line(&|block| block.along);
        let latest = || all().rev().take(DEPARTING);
        let latest_lasted: f64 = latest().map(|block| block.lasted).sum();
        let newest = all().next_back()?;
        Some(Self {
            start: first.end,
            along,
            jerk,
            tremor: libm::sqrt(tremor),
            latest_start: newest.end - crate::time::TimeSpan::from_s(latest_lasted),
            latest_along: latest().map(|block| block.along * block.lasted).sum::<f64>() / latest_lasted,
            latest_lasted,
        })
    }
}
