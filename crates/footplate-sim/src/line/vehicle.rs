//! What the operator of a simulated train believes of it: everything that a vehicle file states.

use footplate_core::{Acceleration, Length, Speed, TimeSpan};

/// A simulated train as its operator knows it. Every claim is true in the simulated world, as loosely as an operator
/// would state it.
#[derive(Debug, Clone, PartialEq)]
pub struct LineVehicle {
    /// What people call it.
    pub name: String,
    /// The odometry period.
    pub period: TimeSpan,
    /// It never runs faster.
    pub max_speed: Speed,
    /// It never accelerates more, downhill included.
    pub max_traction: Acceleration,
    /// It never decelerates more, uphill included.
    pub max_brake: Acceleration,
    /// The wheelsets of the two tachometers.
    pub wheelsets: [LineWheelset; 2],
    /// They sit in different bogies, each with its own cylinder and anti-slide valve. Not so on one bogie, where one
    /// converter can draw both away from the train together.
    pub independent: bool,
    /// What the brake command does when the rail carries it.
    pub brake_command: LineBrake,
    /// What the slide protection does, where anything is claimed of it.
    pub slide_protection: Option<LineSlideProtection>,
    /// After how many pulses a running counter begins again; as large as the counter's register.
    pub counter_modulus: i64,
}

/// A wheelset with a tachometer, as its owner knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineWheelset {
    /// Pulses per revolution.
    pub teeth: u32,
    /// The assumed diameter.
    pub diameter: Length,
    /// The true diameter lies within this part of it, above or below.
    pub diameter_tolerance: f64,
    /// Whether a motor drives it; all wheelsets are braked.
    pub is_powered: bool,
}

/// What a brake command does when the rail carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineBrake {
    /// Deceleration at effort −1 on level track; proportional below.
    pub full: Acceleration,
    /// The true deceleration lies within this part of it, above or below.
    pub tolerance: f64,
    /// What gradients may add to it, above or below.
    pub gradient: Acceleration,
    /// What running resistance adds to it at most; it never takes away.
    pub resistance: Acceleration,
    /// How long the brake takes from nothing to its full force, and back.
    pub build_up: TimeSpan,
    /// How long after its command ends, brake or traction may still act on a wheel, and a wheel that slipped may take to
    /// turn with the train again; what is usual if absent.
    pub release: Option<TimeSpan>,
}

/// What slide and slip protection are claimed to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSlideProtection {
    /// At least one of the two measured wheelsets has no more creepage than this ...
    pub creepage: f64,
    /// ... but for times no longer than this.
    pub longest: TimeSpan,
}

/// How much more than a train's design is claimed: its strength is drawn within 7 %.
pub(crate) const BRAKE_TOLERANCE: f64 = 0.1;
/// The same where one wheelset of 16, or two of 32, do not brake with the train, or catch up with it on a dry rail.
pub(crate) const LOOSE_BRAKE_TOLERANCE: f64 = 0.17;
