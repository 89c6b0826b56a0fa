//! The properties of a virtual Central Station and its line, as observed on real ones or reported of them.

use footplate_core::{Ratio, TimeSpan};
use footplate_wire::marklin_can::LocomotiveProtocol;

/// The transport of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CanTransport {
    /// Each in a datagram, to every client.
    #[default]
    Datagrams,
    /// One behind the other in a stream.
    Stream,
    /// As lines of text, through a serial CAN adapter that its user has to open.
    Adapter,
}

/// The properties of the station and its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanSwitches {
    /// The transport of frames.
    pub transport: CanTransport,
    /// How often a datagram is lost, in either direction.
    pub lost: Ratio,
    /// How often one is duplicated.
    pub duplicated: Ratio,
    /// How often one is overtaken by those that follow it.
    pub overtaken: Ratio,
    /// Whether a stream arrives in random parts.
    pub is_split: bool,
    /// Whether it does what is commanded without confirming it, as one server program does.
    pub is_mute: bool,
    /// Whether reports of sensors include how long the previous state lasted.
    pub has_times: bool,
    /// Whether it answers polls of its modules.
    pub answers_polls: bool,
    /// Whether it sends a list of its locomotives.
    pub has_list: bool,
    /// The protocol of its locomotives.
    pub locomotives: LocomotiveProtocol,
    /// How often it reads its sensors; 100 ms unless its owner has set it (Link S88).
    pub scan: TimeSpan,
}

impl Default for CanSwitches {
    fn default() -> Self {
        Self {
            transport: CanTransport::default(),
            lost: Ratio::ZERO,
            duplicated: Ratio::ZERO,
            overtaken: Ratio::ZERO,
            is_split: false,
            is_mute: false,
            has_times: true,
            answers_polls: true,
            has_list: true,
            locomotives: LocomotiveProtocol::Mfx,
            scan: TimeSpan::from_ms(100),
        }
    }
}
