//! What laws of speed change are called in German; their English names come with them.

use footplate_core::kinematics::SpeedLaw;
use footplate_core::model::report::{Constant, LawKind};

pub(super) fn german_law(kind: LawKind) -> String {
    let LawKind::Family(family) = kind else { return "linear in der Stufe (Massensimulation)".to_owned() };
    let shape = match family.law {
        SpeedLaw::MidStep => "Sprung in der Mitte",
        SpeedLaw::ConstantAcceleration => "gleichmäßige Beschleunigung",
        SpeedLaw::ConstantJerk => "gleichmäßiger Ruck (S-Kurve)",
        SpeedLaw::Smooth => "weich (kubisches Tempo)",
        SpeedLaw::Lag => return "Verzögerung erster Ordnung".to_owned(),
    };
    let constant = match family.constant {
        Constant::Acceleration => "gleich schnell bei allen Wechseln",
        Constant::Time => "gleich lang bei allen Wechseln",
    };
    format!("{shape}, {constant}")
}
