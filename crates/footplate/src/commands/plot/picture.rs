//! What a picture shows: panels below each other, each with its axes and layers.

/// A picture of curves.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) struct Picture {
    pub(in crate::commands) title: String,
    /// What a reader should know beside it, in one line.
    pub(in crate::commands) subtitle: String,
    /// From top to bottom; those without words for x show the same stretch of it as the next that has them.
    pub(in crate::commands) panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::commands) struct Panel {
    /// With units, as in `speed (m/s)`; empty where the panel below says it.
    pub(in crate::commands) x: String,
    pub(in crate::commands) y: String,
    /// How high it is beside the others; 1 unless that is said.
    pub(in crate::commands) height: Option<u32>,
    /// Whether nought belongs on the upright axis.
    pub(in crate::commands) from_nought: bool,
    /// The first lies below the others.
    pub(in crate::commands) layers: Vec<Layer>,
}

/// One thing on a panel, with its word in the legend.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) struct Layer {
    pub(in crate::commands) label: String,
    pub(in crate::commands) ink: Ink,
    pub(in crate::commands) shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
pub(in crate::commands) enum Shape {
    /// A line through x and y; broken where y is no number.
    Line(Vec<(f64, f64)>),
    /// The same, dashed.
    Dashed(Vec<(f64, f64)>),
    /// The room between two heights: x, low and high.
    Band(Vec<(f64, f64, f64)>),
    /// Points with what is not known of them: x, y, and half the interval.
    Points(Vec<(f64, f64, f64)>),
}

/// The colours of the dashboard's charts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::commands) enum Ink {
    First,
    Second,
    Third,
    /// What is compared with: truth, nought, the law.
    Plain,
}

impl Layer {
    pub(in crate::commands) fn new(label: &str, ink: Ink, shape: Shape) -> Self {
        Self { label: label.to_owned(), ink, shape }
    }
}

impl Shape {
    /// Every point that has to be seen.
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
