//! The same by the crate `adskalman`, with the covariance update that it calls optimal and that costs least.

use adskalman::{
    CovarianceUpdateMethod, KalmanFilterNoControl, ObservationModel, StateAndCovariance,
    TransitionModelLinearNoControl,
};
use nalgebra::{Matrix1, Matrix1x2, Matrix2, Matrix2x1, U1, U2, Vector1, Vector2};

use super::fusion::VARIANCES;
use super::nalgebra_peer::{fused, noise, transition};
use crate::operation::Operation;

struct Motion {
    f: Matrix2<f64>,
    f_transposed: Matrix2<f64>,
    q: Matrix2<f64>,
}

impl TransitionModelLinearNoControl<f64, U2> for Motion {
    fn F(&self) -> &Matrix2<f64> {
        &self.f
    }

    fn FT(&self) -> &Matrix2<f64> {
        &self.f_transposed
    }

    fn Q(&self) -> &Matrix2<f64> {
        &self.q
    }
}

struct Tachometer {
    h: Matrix1x2<f64>,
    h_transposed: Matrix2x1<f64>,
    r: Matrix1<f64>,
}

impl Tachometer {
    fn new(variance: f64) -> Self {
        let h = Matrix1x2::new(1.0, 0.0);
        Self { h, h_transposed: h.transpose(), r: Matrix1::new(variance) }
    }
}

impl ObservationModel<f64, U2, U1> for Tachometer {
    fn H(&self) -> &Matrix1x2<f64> {
        &self.h
    }

    fn HT(&self) -> &Matrix2x1<f64> {
        &self.h_transposed
    }

    fn R(&self) -> &Matrix1<f64> {
        &self.r
    }
}

pub(super) fn operation(group: &'static str, means: &'static str, speeds: Vec<[f64; 2]>) -> Operation {
    let f = transition();
    let motion = Motion { f, f_transposed: f.transpose(), q: noise() };
    let [of_one, of_mean] = VARIANCES.map(Tachometer::new);
    let mut known = [0; 3].map(|_| StateAndCovariance::new(Vector2::zeros(), Matrix2::identity()));
    Operation::new(group, means, speeds, move |&[first, second]| {
        let measured = [(&of_one, first), (&of_one, second), (&of_mean, 0.5 * (first + second))];
        for (known, (tachometer, measured)) in known.iter_mut().zip(measured) {
            let filter = KalmanFilterNoControl::new(&motion, tachometer);
            let method = CovarianceUpdateMethod::OptimalKalman;
            if let Ok(after) = filter.step_with_options(known, &Vector1::new(measured), method) {
                *known = after;
            }
        }
        fused([0, 1, 2].map(|which| (known[which].state(), known[which].covariance())))
    })
}
