//! How a virtual Central Station and the line to it behave, each as it was seen on real ones or reported of them.

use footplate_core::{Ratio, TimeSpan};
use footplate_wire::marklin_can::LocomotiveProtocol;

/// How frames travel.
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

/// How the station and the line behave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanSwitches {
    /// How frames travel.
    pub transport: CanTransport,
    /// How often a datagram is lost, in either direction.
    pub lost: Ratio,
    /// How often one comes twice.
    pub duplicated: Ratio,
    /// How often one is overtaken by those that follow it.
    pub overtaken: Ratio,
    /// Whether a stream arrives in parts that are cut anywhere.
    pub is_split: bool,
    /// Whether it does what is commanded without confirming it, as one program that serves does.
    pub is_mute: bool,
    /// Whether reports of sensors include how long the previous state lasted.
    pub has_times: bool,
    /// Whether it answers when it is asked for its modules.
    pub answers_polls: bool,
    /// Whether it has a list of its locomotives to give.
    pub has_list: bool,
    /// What the decoders of its locomotives understand.
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
