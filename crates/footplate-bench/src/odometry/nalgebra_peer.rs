//! The same as a textbook writes it, with the matrices of the crate `nalgebra`.

use nalgebra::{Matrix1, Matrix1x2, Matrix2, Vector2};

use super::PERIOD_S;
use super::fusion::{JERK, VARIANCES};
use crate::operation::Operation;

/// Speed and acceleration, and their covariance.
#[derive(Clone, Copy)]
struct Filter {
    x: Vector2<f64>,
    p: Matrix2<f64>,
}

/// The matrices of the model; `h` takes the speed out of the state.
struct Model {
    f: Matrix2<f64>,
    q: Matrix2<f64>,
    h: Matrix1x2<f64>,
}

impl Filter {
    fn step(&mut self, model: &Model, measured: f64, variance: f64) {
        let Model { f, q, h } = model;
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + q;
        let innovation = Matrix1::new(measured) - h * self.x;
        let s = h * self.p * h.transpose() + Matrix1::new(variance);
        let gain = self.p * h.transpose() * s.try_inverse().unwrap_or_default();
        self.x += gain * innovation;
        self.p = (Matrix2::identity() - gain * h) * self.p;
    }
}

pub(super) fn transition() -> Matrix2<f64> {
    Matrix2::new(1.0, PERIOD_S, 0.0, 1.0)
}

pub(super) fn noise() -> Matrix2<f64> {
    let t = PERIOD_S;
    Matrix2::new(t.powi(3) / 3.0, t.powi(2) / 2.0, t.powi(2) / 2.0, t) * JERK
}

/// The sum of what three filters know; gives a number that depends on all of it.
pub(super) fn fused(known: [(&Vector2<f64>, &Matrix2<f64>); 3]) -> f64 {
    let (mut information, mut weighed) = (Matrix2::zeros(), Vector2::zeros());
    for (x, p) in known {
        let inverse = p.try_inverse().unwrap_or_default();
        information += inverse;
        weighed += inverse * x;
    }
    let p = information.try_inverse().unwrap_or_default();
    (p * weighed)[0] + 1e-12 * p[(0, 0)]
}

pub(super) fn operation(group: &'static str, means: &'static str, speeds: Vec<[f64; 2]>) -> Operation {
    let model = core::hint::black_box(Model { f: transition(), q: noise(), h: Matrix1x2::new(1.0, 0.0) });
    let [variance, of_mean] = VARIANCES;
    let mut filters = [Filter { x: Vector2::zeros(), p: Matrix2::identity() }; 3];
    Operation::new(group, means, speeds, move |&[first, second]| {
        filters[0].step(&model, first, variance);
        filters[1].step(&model, second, variance);
        filters[2].step(&model, 0.5 * (first + second), of_mean);
        fused([0, 1, 2].map(|which| (&filters[which].x, &filters[which].p)))
    })
}
