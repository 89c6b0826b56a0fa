//! A line as a train meets it: how steep, how curved, how fast, and where to stop.

use core::fmt;

use footplate_core::{Length, Speed, TimeSpan};

use super::stepped::Stepped;

/// Steeper than any adhesion railway (per mille; the steepest, in Lisbon and Linz, have 135 and 116).
pub const STEEPEST_PER_MILLE: f64 = 150.0;
/// More than the tightest curve of a tramway costs (per mille; 650 / R at a radius of 15 m is 43).
pub const TIGHTEST_PER_MILLE: f64 = 50.0;
/// No train on rails ran faster (574.8 km/h in 2007), in m/s.
pub(crate) const FASTEST_M_PER_S: f64 = 160.0;
/// The slowest limit that a train can be driven by (1 km/h), in m/s.
const SLOWEST_M_PER_S: f64 = 1.0 / 3.6;
/// The longest dwell, a day (s).
const LONGEST_DWELL_S: f64 = 86_400.0;

/// A place where trains stop.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// What people call it.
    pub name: String,
    /// Where the front of the train comes to stand.
    pub at: Length,
    /// How long it stands before it goes on; at the last stop it stays.
    pub dwell: TimeSpan,
}

/// A line in one direction. Places are metres along it and rise in the direction of travel.
#[derive(Debug, Clone, PartialEq)]
pub struct LineProfile {
    name: String,
    gradient: Stepped,
    curve_resistance: Stepped,
    speed_limit: Stepped,
    stops: Vec<Stop>,
}

/// What a line is made of, in the order of places.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LineParts {
    /// What people call the line.
    pub name: String,
    /// Rise in per mille from each place on, positive uphill; none means level.
    pub gradients: Vec<(Length, f64)>,
    /// Resistance of curves in per mille of the weight from each place on; none means straight.
    pub curve_resistances: Vec<(Length, f64)>,
    /// The limit from each place on; for the whole train.
    pub speed_limits: Vec<(Length, Speed)>,
    /// Stops; a journey begins at the first and ends at the last.
    pub stops: Vec<Stop>,
}

impl LineProfile {
    /// A line of its parts.
    ///
    /// # Errors
    /// The first part that is out of order, or a value that no railway has.
    pub fn new(parts: LineParts) -> Result<Self, LineError> {
        let LineParts { name, gradients, curve_resistances, speed_limits, stops } = parts;
        let stepped = |what, steps: &[(Length, f64)], range| {
            if steps.is_empty() { Ok(Stepped::constant(0.0)) } else { Stepped::new(what, steps, range) }
        };
        let limits: Vec<_> =
            speed_limits.into_iter().map(|(from, limit)| (from, limit.as_m_per_s())).collect();
        check_stops(&stops)?;
        Ok(Self {
            name,
            gradient: stepped("gradient", &gradients, [-STEEPEST_PER_MILLE, STEEPEST_PER_MILLE])?,
            curve_resistance: stepped("curve resistance", &curve_resistances, [0.0, TIGHTEST_PER_MILLE])?,
            speed_limit: Stepped::new("speed limit", &limits, [SLOWEST_M_PER_S, FASTEST_M_PER_S])?,
            stops,
        })
    }

    /// What people call the line.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Rise in per mille, positive uphill.
    pub const fn gradient(&self) -> &Stepped {
        &self.gradient
    }

    /// Resistance of curves in per mille of the weight.
    pub const fn curve_resistance(&self) -> &Stepped {
        &self.curve_resistance
    }

    /// The speed limit in m/s.
    pub const fn speed_limit(&self) -> &Stepped {
        &self.speed_limit
    }

    /// Where trains stop, two at least, in order.
    pub fn stops(&self) -> &[Stop] {
        &self.stops
    }

    /// How high the line lies at a place above its first gradient's begin.
    pub fn height(&self, at: Length) -> Length {
        Length::from_mm(self.gradient.integral(at))
    }
}

fn check_stops(stops: &[Stop]) -> Result<(), LineError> {
    let wrong = |index, problem| Err(LineError { what: "stop", index, problem });
    let mut before: Option<f64> = None;
    for (index, stop) in stops.iter().enumerate() {
        let (at_m, dwell) = (stop.at.as_m(), stop.dwell.as_s());
        if !at_m.is_finite() {
            return wrong(index, LineProblem::Place { at_m });
        }
        if let Some(after_m) = before.filter(|before| at_m <= *before) {
            return wrong(index, LineProblem::Order { at_m, after_m });
        }
        if !(0.0..=LONGEST_DWELL_S).contains(&dwell) {
            return wrong(index, LineProblem::Dwell { dwell_s: dwell, longest_s: LONGEST_DWELL_S });
        }
        before = Some(at_m);
    }
    if stops.len() < 2 { wrong(stops.len(), LineProblem::TooFewStops) } else { Ok(()) }
}

/// What is wrong with a part of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineError {
    /// What kind of part.
    pub what: &'static str,
    /// Which of its kind, counted from 0.
    pub index: usize,
    /// What is wrong with it.
    pub problem: LineProblem,
}

/// Why a part cannot be one of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LineProblem {
    /// There is none.
    Nothing,
    /// A journey needs a place to begin and a place to end.
    TooFewStops,
    /// Its place is no number.
    Place {
        /// The place.
        at_m: f64,
    },
    /// It does not lie behind the one before it.
    Order {
        /// Its place.
        at_m: f64,
        /// The place of the one before.
        after_m: f64,
    },
    /// A value that no railway has.
    Value {
        /// The value.
        value: f64,
        /// The least it can be.
        lowest: f64,
        /// The most it can be.
        highest: f64,
    },
    /// No train dwells like that.
    Dwell {
        /// The time.
        dwell_s: f64,
        /// The longest it can be.
        longest_s: f64,
    },
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, index, problem } = *self;
        let number = index + 1;
        match problem {
            LineProblem::Nothing => write!(f, "there is no {what}; there should be one at least"),
            LineProblem::TooFewStops => {
                write!(f, "stops: there are {index}; a journey needs two, where it begins and where it ends")
            }
            LineProblem::Place { at_m } => write!(
                f,
                "{what} {number} begins at {at_m} m, which is not \
                                                      a position"
            ),
            LineProblem::Order { at_m, after_m } => write!(
                f,
                "{what} {number} begins at {at_m} m, and the one before it at {after_m} m; places should rise"
            ),
            LineProblem::Value { value, lowest, highest } => {
                write!(f, "{what} {number} is {value}; it should lie between {lowest} and {highest}")
            }
            LineProblem::Dwell { dwell_s, longest_s } => {
                write!(
                    f,
                    "{what} {number} has a dwell of {dwell_s} s; it should lie between 0 and {longest_s}"
                )
            }
        }
    }
}

impl core::error::Error for LineError {}
