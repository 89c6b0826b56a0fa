//! How far single stops from one speed scatter, as far as model trains usually do.

/// Repeated stops of train 2 at step 8, 0.39 m/s, scatter by 4 mm; below that in proportion to the speed, as their ways
/// do. Of train 77 at step 14, 0.61 m/s, by 21 mm (both measured, 2020).
const MID: (f64, f64) = (0.39, 0.004);
const TOP: (f64, f64) = (0.61, 0.021);
/// What is left at a crawl (m): the play of couplings and gears.
const LEAST: f64 = 0.0005;

/// One standard deviation (m) of stops from a speed (m/s).
pub(super) fn usual_scatter(speed: f64) -> f64 {
    let (mid_speed, mid) = MID;
    let (top_speed, top) = TOP;
    if speed <= mid_speed {
        return LEAST.max(mid * speed / mid_speed);
    }
    mid + (top - mid) * (speed - mid_speed) / (top_speed - mid_speed)
}
