//! The content of a picture: panels below one another, each with axes and layers.

/// A picture of curves.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) struct Picture {
    pub(in crate::commands) title: String,
    /// One line of explanation.
    pub(in crate::commands) subtitle: String,
    /// From top to bottom; a panel without an x label shares the x axis of the next panel that has one.
    pub(in crate::commands) panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::commands) struct Panel {
    /// The x label with its unit, as in `speed (m/s)`; empty if the panel below has it.
    pub(in crate::commands) x: String,
    pub(in crate::commands) y: String,
    /// Its height relative to other panels; 1 by default.
    pub(in crate::commands) height: Option<u32>,
    /// Whether the y axis includes zero.
    pub(in crate::commands) from_zero: bool,
    /// From back to front.
    pub(in crate::commands) layers: Vec<Layer>,
}

/// One curve or set of points, with its name in the legend.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) struct Layer {
    pub(in crate::commands) label: String,
    pub(in crate::commands) ink: Ink,
    pub(in crate::commands) shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) enum Shape {
    /// A line through (x, y); interrupted where y is NaN.
    Line(Vec<(f64, f64)>),
    /// The same, dashed.
    Dashed(Vec<(f64, f64)>),
    /// The area between two curves: (x, low, high).
    Band(Vec<(f64, f64, f64)>),
    /// Points with error bars: (x, y, half the interval).
    Points(Vec<(f64, f64, f64)>),
}

/// The colours of the dashboard's charts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::commands) enum Ink {
    First,
    Second,
    Third,
    /// References: truth, zero, a formula.
    Plain,
}

impl Layer {
    pub(in crate::commands) fn new(label: &str, ink: Ink, shape: Shape) -> Self {
        Self { label: label.to_owned(), ink, shape }
    }
}

impl Shape {
    /// All points that must be visible.
    pub(super) fn extent(&self) -> Box<dyn Iterator<Item = (f64, f64)> + '_> {
        match self {
            Self::Line(points) | Self::Dashed(points) => Box::new(points.iter().copied()),
            Self::Band(points) => {
                Box::new(points.iter().flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]))
            }
            Self::Points(points) => {
                Box::new(points.iter().flat_map(|(x, y, half)| [(*x, y - half), (*x, y + half)]))
            }
        }
    }
}

/// Points of a curve (chosen: one per half per cent).
const SAMPLES: usize = 200;
/// The end of the curve, in per cent: outliers must not flatten the rest.
pub(in crate::commands) const SHOWN: f64 = 95.0;

/// Points (value, per cent of the values below it), from the least value on; empty without values.
pub(in crate::commands) fn shares(values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return Vec::new() };
    let point = |sample: usize| {
        let share = SHOWN / 100.0 * sample as f64 / SAMPLES as f64;
        let value = sorted.get((share * last as f64).round() as usize)?;
        Some((*value, 100.0 * share))
    };
    (0..=SAMPLES).filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_halves_the_values_and_outliers_are_cut() {
        let curve = shares((0..=100).rev().map(f64::from).chain([f64::NAN]));
        assert_eq!(curve.first(), Some(&(0.0, 0.0)));
        assert_eq!(curve.last(), Some(&(95.0, 95.0)));
        let (value, _) = curve.iter().find(|(_, share)| *share >= 50.0).unwrap();
        assert!((49.0..=51.0).contains(value), "{value}");
        assert!(shares([].into_iter()).is_empty());
    }
}
