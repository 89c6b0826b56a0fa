//! The interval that contains the speed with a stated probability.
//!
//! Each hypothesis may leave out an equal part of the risk. One of probability `w` with Gaussian errors leaves out no
//! more than `risk` if it is given `k` deviations either side with `w exp(−k²/2) ≤ risk`.

use super::filters::Filters;
use super::lanes::{Lanes, ln};
use super::scene::Scene;
use crate::odometry::wheels::{Range, larger, smaller};

/// Both diameters are hardly off by their whole tolerance at once. The mean of two errors that are uniform over it is within this
/// part in 99.99 % of cases.
const TOLERANCE: f64 = 0.993;
/// Creepage of rolling wheels under full effort (part of the speed).
const CREEPAGE: f64 = 0.003;
/// Hypotheses in which no wheel tells the speed.
const COASTS: [bool; 8] = [false, false, false, true, true, false, false, false];

/// Speed (m/s) and distance of the period (m); `beyond` is by how much the wheels differ beyond their tolerances (part).
pub(super) fn interval(
    p: &Lanes,
    filters: &Filters,
    distances: &Lanes,
    scene: &Scene,
    (risk, beyond): (f64, f64),
    t: f64,
) -> [Range; 2] {
    let part = risk / 8.0;
    let per_part = 1.0 / part;
    let mut speed = Range { low: f64::INFINITY, high: f64::NEG_INFINITY };
    let mut distance = speed;
    let [first, second] = &scene.wheels;
    let wide = 0.5 * (first.tolerance + second.tolerance) * TOLERANCE;
    let wider = larger(first.tolerance, second.tolerance);
    let effort = scene.brake + scene.traction;
    // Both wheels tell the speed of "both roll".
    let mut tolerance = wide;
    for ((((&w, &v), &pvv), &ran), coasts) in
        p.0.iter().zip(&filters.v.0).zip(&filters.pvv.0).zip(&distances.0).zip(COASTS)
    {
        let tolerance = core::mem::replace(&mut tolerance, wider);
        if w <= part {
            continue;
        }
        let scale = (tolerance + beyond + if coasts { 0.0 } else { CREEPAGE * effort }) * v.abs();
        // k deviations, with k² = 2 ln (w / part).
        let off = libm::sqrt(2.0 * ln(w * per_part) * pvv) + scale;
        speed = speed.or(Range { low: v - off, high: v + off });
        let drift = if coasts { off } else { scale };
        distance = distance.or(Range { low: ran - drift * t, high: ran + drift * t });
    }
    let top = scene.top_speed;
    speed = Range { low: larger(speed.low, -top), high: smaller(speed.high, top) };
    [speed, distance]
}
