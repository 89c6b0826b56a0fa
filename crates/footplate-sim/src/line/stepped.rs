//! A number that changes at places along a line and is constant between them: a gradient, a speed limit.

use footplate_core::Length;

use super::profile::{LineError, LineProblem};

/// A value for each place: each step holds from its place to the next; the first holds before it as well.
#[derive(Debug, Clone, PartialEq)]
pub struct Stepped {
    /// Where each step begins (m), rising. Never empty.
    starts: Vec<f64>,
    /// The value of each step.
    values: Vec<f64>,
    /// The integral from the first start to each start.
    integrals: Vec<f64>,
}

impl Stepped {
    /// One value everywhere.
    pub fn constant(value: f64) -> Self {
        Self { starts: vec![0.0], values: vec![value], integrals: vec![0.0] }
    }

    /// Steps in the order of their places, with values between `lowest` and `highest`.
    ///
    /// # Errors
    /// The first step that is out of order or out of range; `what` is what the error calls the value.
    pub fn new(
        what: &'static str,
        steps: &[(Length, f64)],
        [lowest, highest]: [f64; 2],
    ) -> Result<Self, LineError> {
        let wrong = |index, problem| Err(LineError { what, index, problem });
        if steps.is_empty() {
            return wrong(0, LineProblem::Nothing);
        }
        let mut built = Self { starts: Vec::new(), values: Vec::new(), integrals: Vec::new() };
        let mut integral = 0.0;
        for (index, &(start, value)) in steps.iter().enumerate() {
            let start = start.as_m();
            if !(lowest <= value && value <= highest) {
                return wrong(index, LineProblem::Value { value, lowest, highest });
            }
            if !start.is_finite() {
                return wrong(index, LineProblem::Place { at_m: start });
            }
            if let (Some(&before), Some(held)) = (built.starts.last(), built.values.last()) {
                if start <= before {
                    return wrong(index, LineProblem::Order { at_m: start, after_m: before });
                }
                integral += held * (start - before);
            }
            built.starts.push(start);
            built.values.push(value);
            built.integrals.push(integral);
        }
        Ok(built)
    }

    /// The step that holds at `m`.
    fn index(&self, m: f64) -> usize {
        self.starts.partition_point(|start| *start <= m).saturating_sub(1)
    }

    /// The value at a place.
    pub fn at(&self, place: Length) -> f64 {
        self.values[self.index(place.as_m())]
    }

    /// The integral of the value over metres, from the first step to a place.
    pub fn integral(&self, place: Length) -> f64 {
        let m = place.as_m();
        let index = self.index(m);
        self.integrals[index] + self.values[index] * (m - self.starts[index])
    }

    /// The mean over what lies behind a place, `behind` long; the value at the place if that is nothing.
    pub fn mean_behind(&self, place: Length, behind: Length) -> f64 {
        if behind <= Length::ZERO {
            return self.at(place);
        }
        (self.integral(place) - self.integral(place - behind)) / behind.as_m()
    }

    /// Where each step begins, and its value.
    pub fn steps(&self) -> impl Iterator<Item = (Length, f64)> + '_ {
        self.starts.iter().map(|start| Length::from_m(*start)).zip(self.values.iter().copied())
    }

    /// The least value at a place and all that lies behind it, `behind` long, as steps of the place.
    #[must_use]
    pub fn least_behind(&self, behind: Length) -> Self {
        let behind = behind.as_m().max(0.0);
        // A step counts from its start until all of the length behind the place has left it.
        let ends = self.starts.iter().skip(1).map(|end| end + behind);
        let mut starts: Vec<f64> = self.starts.iter().copied().chain(ends).collect();
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        let least = |start: f64| {
            let first = self.starts[1..].partition_point(|end| end + behind <= start);
            let last = self.index(start);
            self.values[first.min(last)..=last].iter().copied().fold(f64::INFINITY, f64::min)
        };
        let mut built = Self { starts: Vec::new(), values: Vec::new(), integrals: Vec::new() };
        let mut integral = 0.0;
        for start in starts {
            let value = least(start);
            if let (Some(&before), Some(&held)) = (built.starts.last(), built.values.last()) {
                if value == held {
                    continue;
                }
                integral += held * (start - before);
            }
            built.starts.push(start);
            built.values.push(value);
            built.integrals.push(integral);
        }
        built
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn stepped(steps: &[(f64, f64)]) -> Stepped {
        let steps: Vec<_> = steps.iter().map(|(m, value)| (Length::from_m(*m), *value)).collect();
        Stepped::new("value", &steps, [-100.0, 100.0]).unwrap()
    }

    #[test]
    fn a_train_half_on_a_slope_feels_half_of_it() {
        let slope = stepped(&[(0.0, 0.0), (1000.0, 10.0)]);
        let train = Length::from_m(200.0);
        assert_eq!(slope.mean_behind(Length::from_m(1100.0), train), 5.0);
        assert_eq!(slope.mean_behind(Length::from_m(1200.0), train), 10.0);
        assert_eq!(slope.mean_behind(Length::from_m(1000.0), Length::ZERO), 10.0);
        // Up 10 per mille for a kilometre: ten metres, in thousandths of a metre.
        assert_eq!(slope.integral(Length::from_m(2000.0)), 10_000.0);
    }

    #[test]
    fn a_limit_holds_until_the_tail_has_left_it() {
        let limits = stepped(&[(0.0, 40.0), (100.0, 20.0), (150.0, 30.0), (400.0, 40.0)]);
        let front: Vec<_> = limits.least_behind(Length::from_m(100.0)).steps().collect();
        let expected = [(0.0, 40.0), (100.0, 20.0), (250.0, 30.0), (500.0, 40.0)];
        assert_eq!(front, expected.map(|(m, value)| (Length::from_m(m), value)));
    }

    #[test]
    fn what_is_out_of_order_or_range_is_named() {
        let new = |steps: &[(f64, f64)]| {
            let steps: Vec<_> = steps.iter().map(|(m, value)| (Length::from_m(*m), *value)).collect();
            Stepped::new("gradient", &steps, [-50.0, 50.0]).unwrap_err().to_string()
        };
        assert_eq!(new(&[]), "there is no gradient; there should be one at least");
        assert_eq!(
            new(&[(0.0, 0.0), (5.0, 1.0), (5.0, 2.0)]),
            "gradient 3 begins at 5 m, and the one before it at 5 m; places should rise"
        );
        assert_eq!(new(&[(0.0, 60.0)]), "gradient 1 is 60; it should lie between -50 and 50");
        assert_eq!(new(&[(f64::NAN, 0.0)]), "gradient 1 begins at NaN m, which is not a position");
        assert_eq!(new(&[(0.0, f64::NAN)]), "gradient 1 is NaN; it should lie between -50 and 50");
    }

    proptest! {
        #[test]
        fn the_least_behind_is_what_a_look_at_every_metre_finds(
            gaps in prop::collection::vec(1_u8..40, 1..12),
            values in prop::collection::vec(-9_i8..9, 12),
            behind in 0_u8..60,
        ) {
            let mut at = 0.0;
            let steps: Vec<(f64, f64)> = gaps.iter().zip(&values).map(|(gap, value)| {
                let start = at;
                at += f64::from(*gap);
                (start, f64::from(*value))
            }).collect();
            let along = stepped(&steps);
            let front = along.least_behind(Length::from_m(f64::from(behind)));
            for metre in 0..500 {
                // Half a metre off every boundary.
                let place = f64::from(metre) + 0.5;
                let looked = (0..=u32::from(behind)).map(|back| along.at(Length::from_m(place - f64::from(back))));
                let least = looked.fold(f64::INFINITY, f64::min);
                prop_assert_eq!(front.at(Length::from_m(place)), least, "at {}", place);
            }
        }
    }
}
