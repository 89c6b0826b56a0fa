//! What is believed of a train between two contacts, and how one report changes it.
//!
//! An extended Kalman filter whose state is known best at a contact:
//! `c` time of the last contact (s, on the run's clock), `u` = ln of the steady speed of the step in m/s,
//! `a` = ln of the pace of the law of speed change (see [`LawFamily`](crate::calibration::LawFamily)),
//! `q` delay from command to effect (s). `d` is the length of the hop ahead (m), known apart.
//! The forecast is `t = f(c, u, a, q, d)`, the time of the next contact; `j` its derivatives.
//! A report says `z = t + e`, `e` uniform in the poll interval; the gain uses its variance.

#![expect(clippy::indexing_slicing, reason = "arrays of N letters, indexed below N")]

use super::transition::Transition;
use crate::calibration::LawFamily;

/// Places of the letters in the state.
pub(super) const C: usize = 0;
pub(super) const U: usize = 1;
pub(super) const A: usize = 2;
pub(super) const Q: usize = 3;
const N: usize = 4;

/// Steps of the numerical derivatives: small against the doubt of each letter, large against the
/// nanosecond in which the laws answer.
const STEPS: [f64; N] = [1e-3, 1e-3, 1e-2, 1e-3];
const STEP_LENGTH: f64 = 1e-3;
/// Above this speed at the contact (m/s) a later start or a longer way tell in the time by the speeds alone; below,
/// a train that may stop short bends too much for that, and they are taken over the steps.
const STRAIGHT_ABOVE: f64 = 0.05;
/// Looks at one report from ever better points; after four the point no longer moves by a millimetre.
const ITERATIONS: usize = 4;
/// A look that moves the point by less than this (in the units of the state, and in m) was the last.
const UNMOVED: f64 = 1e-6;
/// One report moves no letter further than this from its mean: a factor of e for speed and pace.
const FARTHEST: f64 = 1.0;

/// Mean and covariance of the state under one law.
#[derive(Debug, Clone, Copy)]
pub(super) struct Belief {
    pub(super) family: LawFamily,
    pub(super) x: [f64; N],
    pub(super) p: [[f64; N]; N],
}

/// A command whose effect the train is still undergoing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Command {
    /// When it was sent (s, on the run's clock).
    pub(super) sent: f64,
    /// The speed before it (m/s).
    pub(super) from: f64,
}

/// Doubts that no state carries: what a train does that the model does not know.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unmodelled {
    /// Random walk of ln speed, per √s.
    pub(super) wander: f64,
    /// Part of a distance covered while changing speed by which no law is true.
    pub(super) law_error: f64,
}

/// The forecast of the time of the next contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Due {
    /// Mean time of contact (s, on the run's clock).
    pub(super) time: f64,
    /// Its variance (s²).
    pub(super) variance: f64,
    /// Speed there (m/s).
    pub(super) speed: f64,
    /// Whether the speed changes on the way.
    pub(super) changing: bool,
    /// Covariance of the time with each letter as it was at the last contact.
    with: [f64; N],
    /// Covariance of the time with the length of the hop (s·m).
    with_length: f64,
    /// Growth of the variance of `u` on the way.
    wander: f64,
    j: [f64; N],
    j_length: f64,
}

/// The way ahead as a train knows it: length (m) and variance (m²).
#[derive(Debug, Clone, Copy)]
pub(super) struct Hop {
    pub(super) length: f64,
    pub(super) variance: f64,
}

/// What the mean does on the way.
#[derive(Debug, Clone, Copy)]
struct Path {
    time: f64,
    /// Part of the time run at a settled speed (s).
    steady: f64,
    speed: f64,
    law_variance: f64,
    changing: bool,
}

impl Belief {
    /// The transition under way according to this belief's mean.
    pub(super) fn transition(&self, command: Command) -> Transition {
        transition(self.family, &self.x, command)
    }

    /// When and how a hop of `length` ± `variance` ends. `None` if the train stops short of it.
    pub(super) fn due(&self, command: Option<Command>, hop: Hop, doubt: Unmodelled) -> Option<Due> {
        self.due_near(&self.x, hop.length, command, hop, doubt)
    }

    /// The same, seen from another point `x`, `length` than the mean: for the derivatives to be taken there.
    fn due_near(
        &self,
        x: &[f64; N],
        length: f64,
        command: Option<Command>,
        hop: Hop,
        doubt: Unmodelled,
    ) -> Option<Due> {
        let [c, u, ..] = *x;
        if let Some(command) = command {
            let transition = transition(self.family, x, command);
            if transition.settled() > c {
                return self.due_changing(x, length, command, &transition, hop, doubt);
            }
        }
        let speed = libm::exp(u);
        let way = length / speed;
        let path = Path { time: c + way, steady: way, speed, law_variance: 0.0, changing: false };
        Some(self.spread(path, [1.0, -way, 0.0, 0.0], 1.0 / speed, hop, doubt))
    }

    fn due_changing(
        &self,
        x: &[f64; N],
        length: f64,
        command: Command,
        transition: &Transition,
        hop: Hop,
        doubt: Unmodelled,
    ) -> Option<Due> {
        let start = transition.distance_at(x[C]);
        let time = transition.time_at(start + length)?;
        let speed = transition.speed_at(time);
        // Where the moved train never arrives the derivative says nothing; the doubt of the law stands in.
        let over_step = |place: usize| {
            let step = STEPS[place];
            let mut moved = *x;
            moved[place] += step;
            let other = self::transition(self.family, &moved, command);
            other
                .time_at(other.distance_at(moved[C]) + length)
                .map_or(0.0, |moved_time| (moved_time - time) / step)
        };
        let (mut j, j_length) = if speed > STRAIGHT_ABOVE && x[Q] >= 0.0 {
            // The law itself stays as it is: what is lost at the start is made up at the end.
            let ratio = transition.speed_at(x[C]) / speed;
            ([ratio, 0.0, 0.0, 1.0 - ratio], 1.0 / speed)
        } else {
            let longer = transition.time_at(start + length + STEP_LENGTH);
            let j_length = longer.map_or(0.0, |moved_time| (moved_time - time) / STEP_LENGTH);
            ([over_step(C), 0.0, 0.0, over_step(Q)], j_length)
        };
        (j[U], j[A]) = (over_step(U), over_step(A));
        // The law is doubted over the part of the way on which the speed still changes.
        let settled = transition.settled();
        let changing_way = transition.distance_at(settled.min(time)) - start;
        let law_time = doubt.law_error * changing_way.max(0.0) * j_length;
        let path = Path {
            time,
            steady: (time - settled).max(0.0),
            speed,
            law_variance: law_time * law_time,
            changing: true,
        };
        Some(self.spread(path, j, j_length, hop, doubt))
    }

    /// The forecast seen from where the report `z` (variance `r`) says the state is, and how late the report
    /// is by it: the iterated extended Kalman filter (Bell and Cathey, 1993). Laws bend too much for one
    /// straight line through a doubtful mean. `first` is the forecast from the mean.
    pub(super) fn due_in_hindsight(
        &self,
        first: Due,
        command: Option<Command>,
        hop: Hop,
        doubt: Unmodelled,
        z: f64,
        r: f64,
    ) -> (Due, f64) {
        let (mut x, mut length, mut due) = (self.x, hop.length, first);
        let mut looks = 1;
        loop {
            let back: f64 = (0..N).map(|i| due.j[i] * (self.x[i] - x[i])).sum();
            let late = z - due.time - back - due.j_length * (hop.length - length);
            let s = due.variance + r;
            let step = |i: usize| (due.with[i] / s * late).clamp(-FARTHEST, FARTHEST);
            let (from, from_length) = (x, length);
            x = core::array::from_fn(|i| self.x[i] + step(i));
            length = (hop.length + due.with_length / s * late).max(0.5 * hop.length);
            let stays = (length - from_length).abs() < UNMOVED
                && x.iter().zip(&from).all(|(to, from)| (to - from).abs() < UNMOVED);
            let next = if stays || looks == ITERATIONS {
                None
            } else {
                self.due_near(&x, length, command, hop, doubt)
            };
            match next {
                Some(next) => (due, looks) = (next, looks + 1),
                None => return (Due { time: z - late, ..due }, late),
            }
        }
    }

    fn spread(&self, path: Path, j: [f64; N], j_length: f64, hop: Hop, doubt: Unmodelled) -> Due {
        let wander = doubt.wander * doubt.wander * path.steady;
        let mut with: [f64; N] = core::array::from_fn(|i| {
            j.iter().zip(&self.p).map(|(derivative, line)| derivative * line[i]).sum()
        });
        let motion: f64 = j.iter().zip(&with).map(|(derivative, covariance)| derivative * covariance).sum();
        // A speed that wanders evenly on the way moves the arrival by a third of what it moves the speed.
        let wandering = path.steady * path.steady * wander / 3.0;
        with[U] -= path.steady * wander / 2.0;
        let with_length = j_length * hop.variance;
        Due {
            time: path.time,
            variance: (motion + j_length * with_length + wandering + path.law_variance).max(0.0),
            speed: path.speed,
            changing: path.changing,
            with,
            with_length,
            wander,
            j,
            j_length,
        }
    }

    /// The train reached the contact that was due: `late` seconds later than forecast, as a report with
    /// variance `r` says. Returns the correction of the length of the hop and the part of its variance that
    /// is now explained.
    pub(super) fn arrive(&mut self, due: &Due, late: f64, r: f64) -> LengthCorrection {
        let s = due.variance + r;
        let k: [f64; N] = core::array::from_fn(|i| if i == C { due.variance / s } else { due.with[i] / s });
        self.x[C] = due.time;
        for (value, gain) in self.x.iter_mut().zip(&k) {
            *value += gain * late;
        }
        self.p[U][U] += due.wander;
        let before: [f64; N] = core::array::from_fn(|i| if i == C { due.variance } else { due.with[i] });
        for i in 0..N {
            for j in 0..N {
                let prior = match (i == C, j == C) {
                    (true, true) => due.variance,
                    (true, false) => before[j],
                    (false, true) => before[i],
                    (false, false) => self.p[i][j],
                };
                self.p[i][j] = prior - before[i] * before[j] / s;
            }
        }
        LengthCorrection { by: due.with_length / s * late, explained: due.with_length * due.with_length / s }
    }

    /// The train is at a contact with nothing known of the way there.
    pub(super) fn appear(&mut self, time: f64, variance: f64) {
        self.x[C] = time;
        for i in 0..N {
            self.p[C][i] = 0.0;
            self.p[i][C] = 0.0;
        }
        self.p[C][C] = variance;
    }

    /// The speed ahead is another one, known apart from all else.
    pub(super) fn expect_speed(&mut self, ln_speed: f64, variance: f64) {
        self.x[U] = ln_speed;
        for i in 0..N {
            self.p[U][i] = 0.0;
            self.p[i][U] = 0.0;
        }
        self.p[U][U] = variance;
    }
}

/// What a hit says of the length of a hop.
#[derive(Debug, Clone, Copy)]
pub(super) struct LengthCorrection {
    /// To add to its mean (m).
    pub(super) by: f64,
    /// To take from its variance (m²).
    pub(super) explained: f64,
}

fn transition(family: LawFamily, x: &[f64; N], command: Command) -> Transition {
    Transition::new(family, libm::exp(x[A]), command.sent + x[Q].max(0.0), command.from, libm::exp(x[U]))
}
