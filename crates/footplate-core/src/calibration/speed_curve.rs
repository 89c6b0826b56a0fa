//! A change of speed as a small table, for trains that follow no law: the share of the change done by time.
//!
//! Time is counted in units of the change's own time `T` since its effect began, `T` from a mean acceleration
//! or the same for all changes, whichever describes the train better. The share is 0 at the start, 1 at
//! [`SPAN`]·T, in between on straight lines through [`KNOTS`] values that least squares choose, smoothed by a
//! second-difference prior (Whittaker, 1923) and then made to rise only.
#![expect(clippy::indexing_slicing, reason = "knots are indexed below their number")]

use alloc::vec::Vec;

use super::law_family::Constant;
use super::transient::Transient;
use crate::linalg::{Group, NormalEquations};
use crate::units::Speed;

/// Values between command and end.
const KNOTS: usize = 7;
/// The table reaches this far, in units of T: a lag is at 95 % after three times its constant.
const SPAN: f64 = 1.6;
/// Changes smaller than this (m/s) take no less time than it.
const SMALLEST_CHANGE: f64 = 1e-3;
/// Prior deviation of the second difference of neighbouring shares.
const BEND: f64 = 0.15;
/// The place of each change is free: ± 100 m.
const PLACE_VARIANCE: f64 = 1e4;

/// Share of a change of speed by time.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedCurve {
    constant: Constant,
    /// Pace that makes the unit of time: m/s² or s.
    pace: f64,
    /// From command to effect (s).
    delay: f64,
    /// Shares at equal distances in time, 0 at the first and 1 at the last.
    shares: [f64; KNOTS + 2],
}

impl SpeedCurve {
    /// Unknowns of the table beside pace and delay.
    pub const UNKNOWNS: usize = KNOTS;

    /// The table that fits some changes best, given the pace that makes the unit of time and the delay.
    #[must_use]
    pub fn of(changes: &[Transient], constant: Constant, pace: f64, delay: f64) -> Option<Self> {
        if !(pace > 0.0 && pace.is_finite() && delay.is_finite()) {
            return None;
        }
        let mut curve = Self { constant, pace, delay, shares: [0.0; KNOTS + 2] };
        let mut system = NormalEquations::new(KNOTS);
        for knot in 0..KNOTS {
            let mut terms: Vec<(usize, f64)> = Vec::new();
            let mut known = 0.0;
            for (away, weight) in [(0, 1.0), (1, -2.0), (2, 1.0)] {
                match knot + away {
                    0 => {}
                    place if place > KNOTS => known += weight,
                    place => terms.push((place - 1, weight)),
                }
            }
            system.add(&terms, -known, BEND * BEND);
        }
        for change in changes {
            let [from, to] = change.speeds.map(|speed| speed.as_m_per_s());
            let mut group = Group::new([PLACE_VARIANCE]);
            let duration = curve.duration(change.speeds);
            for point in &change.points {
                let (areas, ended) = areas(duration, point.since_command - delay);
                let terms: Vec<(usize, f64)> =
                    (0..KNOTS).map(|knot| (knot, (to - from) * areas[knot + 1])).collect();
                let rest = from * point.since_command + (to - from) * (areas[KNOTS + 1] + ended);
                let fastest = from.max(to);
                let variance = fastest * fastest * point.variance + change.way_doubt * change.way_doubt;
                group.add(&terms, [1.0], point.way - rest, variance);
            }
            system.add_group(&group);
        }
        let solved = system.solve()?;
        curve.shares[KNOTS + 1] = 1.0;
        for (knot, value) in solved.values.iter().enumerate() {
            curve.shares[knot + 1] = value.clamp(curve.shares[knot], 1.0);
        }
        Some(curve)
    }

    /// Time that a change takes from its effect to its end (s).
    #[must_use]
    pub fn duration(&self, [from, to]: [Speed; 2]) -> f64 {
        SPAN * match self.constant {
            Constant::Acceleration => (to - from).abs().as_m_per_s().max(SMALLEST_CHANGE) / self.pace,
            Constant::Time => self.pace,
        }
    }

    /// What makes the unit of time: the same mean acceleration or the same time for all changes.
    #[must_use]
    pub const fn constant(&self) -> Constant {
        self.constant
    }

    /// From command to effect (s).
    #[must_use]
    pub const fn delay(&self) -> f64 {
        self.delay
    }

    /// Times in units of T and the share of the change done by then.
    pub fn knots(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let step = SPAN / (KNOTS + 1) as f64;
        self.shares.iter().enumerate().map(move |(knot, share)| (step * knot as f64, *share))
    }

    /// Way since the command (m) and speed (m/s) of a change at a time since the command (s).
    #[must_use]
    pub fn at(&self, speeds: [Speed; 2], since_command: f64) -> (f64, f64) {
        let [from, to] = speeds.map(|speed| speed.as_m_per_s());
        let since = since_command - self.delay;
        if since <= 0.0 {
            return (from * since_command, from);
        }
        let duration = self.duration(speeds);
        let (areas, ended) = areas(duration, since);
        let done: f64 = areas.iter().zip(&self.shares).map(|(area, share)| area * share).sum();
        let place = (since / duration * (KNOTS + 1) as f64).min((KNOTS + 1) as f64);
        let low = (place as usize).min(KNOTS);
        let share = self.shares[low] + (place - low as f64) * (self.shares[low + 1] - self.shares[low]);
        (from * since_command + (to - from) * (done + ended), from + (to - from) * share)
    }
}

/// How much each knot's share counts in the area under the shares up to a time (s), and the time after the end.
fn areas(duration: f64, time: f64) -> ([f64; KNOTS + 2], f64) {
    let step = duration / (KNOTS + 1) as f64;
    let mut areas = [0.0; KNOTS + 2];
    for piece in 0..=KNOTS {
        let into = ((time - step * piece as f64) / step).clamp(0.0, 1.0);
        // Area under a straight line from the left share to the right, over the part `into` of the piece.
        areas[piece] += step * (into - 0.5 * into * into);
        areas[piece + 1] += step * 0.5 * into * into;
    }
    (areas, (time - duration).max(0.0))
}
