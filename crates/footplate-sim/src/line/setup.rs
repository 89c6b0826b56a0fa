//! What a scenario sets up before the world runs by itself.

use super::balises::MarkAccuracy;
use super::bogie::Conduct;
use super::brake_cylinder::BrakeTimes;
use super::consist::{Design, Placement};
use super::creep_force::Film;
use super::faults::Fault;
use super::gradients::Gradients;
use super::kinds::Kind;
use super::plan::{Plan, Stage};
use super::slide_protection::ProtectionStyle;
use super::steering::Steering;
use super::vehicle::BRAKE_TOLERANCE;

/// A train on a line with a driver's plan, and what is in store for it. Times are since the first sample (s).
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) design: Design,
    /// Which measured wheelsets are driven.
    pub(crate) powered: [bool; 2],
    pub(crate) placement: Placement,
    /// How well diameters are known.
    pub(crate) diameter_tolerance: f64,
    /// Where it begins (m), and how fast (m/s).
    pub(crate) place: f64,
    pub(crate) speed: f64,
    /// What the rail is like where nothing else is said.
    pub(crate) base: Film,
    /// Gradients, and what curves take as part of the weight.
    pub(crate) line: [Gradients; 2],
    /// No gradient is steeper, curves included (m/m).
    pub(crate) steepest: f64,
    pub(crate) steering: Steering,
    /// What comes onto the rail, in order of time.
    pub(crate) films: Vec<Lay>,
    /// What the bogie of the measured wheelsets does on its own, in order of time.
    pub(crate) bogie: Vec<(f64, Conduct)>,
    /// On which measured wheelsets slide protection works.
    pub(crate) protected: [bool; 2],
    pub(crate) fault: Fault,
    pub(crate) has_balises: bool,
    /// How well places are known that are marked instead; none if absent.
    pub(crate) marks: Option<MarkAccuracy>,
    /// Teeth of the second tachometer, where it has not as many as the first.
    pub(crate) other_teeth: Option<u32>,
    pub(crate) brake_times: BrakeTimes,
    pub(crate) protection: ProtectionStyle,
    /// How much later than it is given the command is recorded (s), and from when to when it is not recorded at all.
    pub(crate) command_delay: f64,
    pub(crate) command_lost: Option<[f64; 2]>,
    pub(crate) brake_tolerance: f64,
    /// When it ends (s), unless the driver has arrived before.
    pub(crate) lasts: f64,
}

/// A film that comes onto the rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lay {
    /// When.
    pub(crate) at: f64,
    /// How far ahead of the train it begins then (m); negative behind its front.
    pub(crate) ahead: f64,
    /// How long it is (m).
    pub(crate) length: f64,
    /// Over which length it comes up (m).
    pub(crate) onset: f64,
    pub(crate) film: Film,
    /// By how much friction grows with each wheelset.
    pub(crate) cleaning: f64,
}

/// How well the diameters of a train in service are known: measured on the lathe to 0.4 mm, and worn by as much since.
const DIAMETER_TOLERANCE: f64 = 0.001;

impl Setup {
    /// A sound train at a speed on a dry, level line: the first measured wheelset driven, the other not.
    pub(crate) fn new(kind: Kind, speed: f64, stages: Vec<Stage>, lasts: f64) -> Self {
        Self { speed, ..Self::of(kind.design(), Steering::Plan(Plan::new(stages)), lasts) }
    }

    /// A sound train of any design that stands on a dry, level line.
    pub(crate) fn of(design: Design, steering: Steering, lasts: f64) -> Self {
        Self {
            design,
            powered: [true, false],
            placement: Placement::TwoCars,
            diameter_tolerance: DIAMETER_TOLERANCE,
            place: 0.0,
            speed: 0.0,
            base: Film::DRY,
            line: [Gradients::level(), Gradients::level()],
            steepest: 0.0,
            steering,
            films: Vec::new(),
            bogie: Vec::new(),
            protected: [true; 2],
            fault: Fault::None,
            has_balises: false,
            marks: None,
            other_teeth: None,
            brake_times: BrakeTimes::default(),
            protection: ProtectionStyle::OnOff,
            command_delay: 0.0,
            command_lost: None,
            brake_tolerance: BRAKE_TOLERANCE,
            lasts,
        }
    }

    /// The same on a line with gradients up to the steepest (m/m).
    pub(crate) fn with_gradients(self, gradients: Gradients, steepest: f64) -> Self {
        Self { line: [gradients, Gradients::level()], steepest, ..self }
    }
}
