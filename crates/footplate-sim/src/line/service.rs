//! A train on a line with stops: any train and any line, on wheels with tachometers.

use footplate_core::{Jerk, TimeSpan};

use super::consist::{Design, Placement};
use super::creep_force::Film;
use super::driver::{Driver, Style};
use super::gradients::Gradients;
use super::journey::{Journey, JourneyError};
use super::profile::LineProfile;
use super::recording::LineRun;
use super::run::{LineConditions, run};
use super::setup::Setup;
use super::steering::{LineDriver, Steering};
use super::stepped::Stepped;
use super::train::Train;
use crate::draws::{Draws, Purpose};

/// The step of the journey as one body that finds out how long it takes.
const STEP: TimeSpan = TimeSpan::from_ms(50);
/// A train on wheels takes this much longer at most, and this much more (s): brakes that build up, a driver who eases
/// off at stops.
const LONGER: f64 = 1.3;
const LONGER_S: f64 = 60.0;
/// How much earlier the brake is applied: what a cylinder takes to fill.
const ANTICIPATION: TimeSpan = TimeSpan::from_ms(700);

/// A journey of any train on any line, from the first stop to the last.
#[derive(Debug, Clone)]
pub struct LineService {
    name: String,
    design: Design,
    line: LineProfile,
    style: Style,
    lasts: f64,
}

impl LineService {
    /// A train that runs along a line as fast as it may. How many wheelsets carry it, and how many of them are driven,
    /// follows from its mass and its tractive effort.
    ///
    /// # Errors
    /// A value that no train has, or a train that does not get there.
    pub fn new(train: Train, line: LineProfile) -> Result<Self, JourneyError> {
        let design = Design::of(train);
        let style = Style {
            jerk: Some(Jerk::from_m_per_s3(design.jerk)),
            anticipation: ANTICIPATION,
            ..Style::FASTEST
        };
        let time = Journey::run(&design.train, &line, style, STEP)?.time();
        let name = format!("{} on {}", design.train.name, line.name());
        Ok(Self { name, design, line, style, lasts: LONGER * time.as_s() + LONGER_S })
    }

    /// Runs it on a dry rail with balises, until it stands at the last stop. The same seed and conditions give the same
    /// bytes on every machine.
    pub fn run(&self, seed: u64, conditions: LineConditions) -> LineRun {
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let length = self.design.train.weight_length.as_m().max(1.0);
        let (gradient, curve) = (self.line.gradient(), self.line.curve_resistance());
        let steepest = |steps: &Stepped| steps.steps().map(|(_, value)| value.abs()).fold(0.0, f64::max);
        let driver = Driver::new(self.design.train.clone(), self.line.clone(), self.style);
        let setup = Setup {
            powered: [true, self.design.driven >= self.design.wheelsets],
            placement: Placement::TwoCars,
            place: self.line.stops().first().map_or(0.0, |stop| stop.at.as_m()),
            base: Film::DRY.with_friction(draws.uniform(0.42..0.55)),
            line: [Gradients::under(gradient, length), Gradients::under(curve, length)],
            steepest: 1e-3 * (steepest(gradient) + steepest(curve)),
            has_balises: true,
            ..Setup::of(self.design.clone(), Steering::Line(Box::new(LineDriver::new(driver))), self.lasts)
        };
        run(&self.name, &setup, seed, conditions)
    }
}
