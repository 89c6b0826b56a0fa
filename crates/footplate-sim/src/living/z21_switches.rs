//! The properties of a virtual Z21 and its network, as reported of real ones.

use footplate_core::Ratio;
use footplate_wire::z21::Feedback;

use crate::living::speed_reports::SpeedReports;

/// The properties of the station and its network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Z21Switches {
    /// How often a datagram is lost, in either direction.
    pub lost: Ratio,
    /// How often one is duplicated.
    pub duplicated: Ratio,
    /// How often one is overtaken by those that follow it.
    pub overtaken: Ratio,
    /// Whether datagrams take up to 60 ms, as in a busy wireless network.
    pub is_slow: bool,
    /// Whether the first request for broadcasts is lost, which left programs without any feedback.
    pub loses_first_subscription: bool,
    /// Whether it rejects a wrong XOR byte; most do not check it.
    pub strict_xor: bool,
    /// Whether its own XOR bytes are wrong, as those of one server program are.
    pub wrong_xor: bool,
    /// Whether the state of a locomotive ends with F28, as with firmware before 1.42.
    pub short_states: bool,
    /// Whether it reads only the first dataset of a datagram, as small clones do.
    pub first_only: bool,
    /// Whether it is a z21start without its unlock code: it ignores commands to locomotives and turnouts.
    pub is_locked: bool,
    /// The bus of its sensors.
    pub feedback: Feedback,
    /// Whether its decoders report by RailCom.
    pub rail_com: bool,
    /// What they report of their speed.
    pub speeds: SpeedReports,
}

impl Default for Z21Switches {
    fn default() -> Self {
        Self {
            lost: Ratio::ZERO,
            duplicated: Ratio::ZERO,
            overtaken: Ratio::ZERO,
            is_slow: false,
            loses_first_subscription: false,
            strict_xor: false,
            wrong_xor: false,
            short_states: false,
            first_only: false,
            is_locked: false,
            feedback: Feedback::RBus,
            rail_com: true,
            speeds: SpeedReports::None,
        }
    }
}
