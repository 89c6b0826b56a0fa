//! The rise and fall of a line: gradients that change in vertical curves.

use footplate_core::Length;

use super::stepped::Stepped;
use crate::draws::Draws;

/// How long a gradient and the vertical curve to the next are (m): drawn from these.
const EVEN_M: (f64, f64) = (300.0, 1500.0);
const CURVE_M: (f64, f64) = (80.0, 300.0);
/// Where the first gradient begins (m): behind any train.
const BEHIND_M: f64 = 1000.0;

/// Gradients along a line, positive uphill.
#[derive(Debug, Clone)]
pub(crate) struct Gradients {
    /// Places (m) and gradients (m/m), linear in between.
    points: Vec<(f64, f64)>,
    /// Where the last answer was found; trains move on slowly.
    at: usize,
}

impl Gradients {
    /// A level line.
    pub(crate) fn level() -> Self {
        Self { points: vec![(-BEHIND_M, 0.0)], at: 0 }
    }

    /// A line of a length (m) whose gradients are drawn up to the steepest (m/m).
    pub(crate) fn draw(steepest: f64, length: f64, draws: &mut Draws) -> Self {
        let mut points = Vec::new();
        let mut place = -BEHIND_M - draws.uniform(0.0..EVEN_M.1);
        while place < length {
            let gradient = draws.uniform(-steepest..steepest);
            points.push((place, gradient));
            place += draws.uniform(EVEN_M.0..EVEN_M.1);
            points.push((place, gradient));
            place += draws.uniform(CURVE_M.0..CURVE_M.1);
        }
        Self { points, at: 0 }
    }

    /// Given gradients from given places on, with vertical curves of 100 m between them.
    pub(crate) fn given(sections: &[(f64, f64)]) -> Self {
        let mut points = Vec::new();
        let mut last = None;
        for &(place, gradient) in sections {
            if let Some(before) = last {
                points.push((place - 100.0, before));
            }
            points.push((place, gradient));
            last = Some(gradient);
        }
        Self { points, at: 0 }
    }

    /// What acts on the middle of a train of a length (m) on a line that changes in steps (per mille): each of them
    /// comes under the train bit by bit.
    pub(crate) fn under(steps: &Stepped, length: f64) -> Self {
        let of_train = Length::from_m(length);
        let starts: Vec<f64> = steps.steps().map(|(start, _)| start.as_m()).collect();
        let mut fronts: Vec<f64> = starts.iter().flat_map(|start| [*start, start + length]).collect();
        fronts.sort_by(f64::total_cmp);
        fronts.dedup();
        let mean = |front: f64| 1e-3 * steps.mean_behind(Length::from_m(front), of_train);
        Self { points: fronts.into_iter().map(|front| (front - 0.5 * length, mean(front))).collect(), at: 0 }
    }

    /// The gradient at a place (m/m).
    pub(crate) fn at(&mut self, place: f64) -> f64 {
        let points = &self.points;
        while self.at > 0 && points[self.at].0 > place {
            self.at -= 1;
        }
        while self.at + 1 < points.len() && points[self.at + 1].0 <= place {
            self.at += 1;
        }
        let (here, gradient) = points[self.at];
        match points.get(self.at + 1) {
            Some(&(next, towards)) if place > here => {
                gradient + (towards - gradient) * (place - here) / (next - here)
            }
            _ => gradient,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    #[test]
    fn gradients_stay_within_the_steepest_and_never_jump() {
        let mut line = Gradients::draw(0.012, 20_000.0, &mut Draws::new(1, Purpose::Track));
        let mut last = line.at(-500.0);
        for metre in -500..20_000 {
            let gradient = line.at(f64::from(metre));
            assert!(gradient.abs() <= 0.012);
            // 24 per mille over the shortest vertical curve of 80 m.
            assert!((gradient - last).abs() <= 0.024 / 80.0 + 1e-12);
            last = gradient;
        }
        assert_eq!(line.at(300.0), line.clone().at(300.0), "the path to it does not matter");
    }

    #[test]
    fn a_step_comes_under_a_train_bit_by_bit() {
        let steps = [(Length::from_m(0.0), 5.0), (Length::from_m(1000.0), 25.0)];
        let steps = Stepped::new("gradient", &steps, [-100.0, 100.0]).unwrap();
        let mut line = Gradients::under(&steps, 200.0);
        // The middle of the train: front at 1000, 1100 and 1200 m.
        for (middle, gradient) in
            [(500.0, 0.005), (900.0, 0.005), (1000.0, 0.015), (1100.0, 0.025), (3000.0, 0.025)]
        {
            assert!((line.at(middle) - gradient).abs() < 1e-12, "{middle}");
        }
    }

    #[test]
    fn given_gradients_are_where_they_were_given() {
        let mut line = Gradients::given(&[(-1000.0, 0.0), (500.0, 0.03), (900.0, -0.03)]);
        assert_eq!(
            [0.0, 400.0, 450.0, 500.0, 700.0, 850.0, 950.0].map(|at| line.at(at)),
            [0.0, 0.0, 0.015, 0.03, 0.03, 0.0, -0.03]
        );
    }
}
