//! What sensors and decoders report: modules on the R-BUS, detectors on LocoNet and the CAN bus, RailCom.

use super::broadcasts::Broadcasts;
use super::reply::Reply;

/// Modules in one group of the R-BUS.
pub const GROUP_MODULES: usize = 10;
/// Inputs of a module.
const MODULE_INPUTS: u16 = 8;
/// Inputs in one group of the R-BUS.
pub const GROUP_INPUTS: u16 = GROUP_MODULES as u16 * MODULE_INPUTS;
/// The groups of the R-BUS: 20 modules.
pub(super) const GROUPS: u8 = 2;
/// CAN detectors have eight ports, as R-BUS modules have inputs.
const CAN_PORTS: u16 = 8;
/// Occupancy, as LocoNet detectors report it.
const LOCO_NET_OCCUPANCY: u8 = 0x01;
/// Occupancy, as CAN detectors report it.
const CAN_OCCUPANCY: u8 = 0x01;
/// Values of a CAN detector below this are free; from it on occupied.
const CAN_OCCUPIED: u16 = 0x1000;

/// Which sensors the layout is seen by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// Modules on the R-BUS (10787, 10808 on the R-BUS, 10819). Input 1 of module 1 is 1, of module 2 it is 9.
    #[default]
    RBus,
    /// Detectors on the CAN bus (10808). Port 0 of the module with address 1 is 1, of address 2 it is 9.
    Can,
    /// Detectors on LocoNet, by their addresses.
    LocoNet,
}

impl Feedback {
    /// What the station has to be asked for.
    #[must_use]
    pub const fn broadcasts(self) -> Broadcasts {
        match self {
            Self::RBus => Broadcasts::R_BUS,
            Self::Can => Broadcasts::CAN,
            Self::LocoNet => Broadcasts::LOCO_NET,
        }
    }

    /// The sensors that a message tells of, by their numbers on the station, and whether each is occupied.
    pub fn detections(self, reply: &Reply) -> impl Iterator<Item = (u16, bool)> {
        let (first, count, bits) = match (self, reply) {
            (Self::RBus, Reply::Feedback { group, inputs }) => {
                let bits =
                    inputs.iter().rev().fold(0_u128, |bits, byte| bits << MODULE_INPUTS | u128::from(*byte));
                (u16::from(*group) * GROUP_INPUTS + 1, GROUP_INPUTS, bits)
            }
            (Self::Can, Reply::Can(CanDetection { address, port, kind: CAN_OCCUPANCY, value, .. })) => {
                let before = address.saturating_sub(1).saturating_mul(CAN_PORTS);
                let number = before.saturating_add(u16::from(*port)).saturating_add(1);
                (number, u16::from(u16::from(*port) < CAN_PORTS), u128::from(*value >= CAN_OCCUPIED))
            }
            (Self::LocoNet, Reply::LocoNet(LocoNetDetection { kind: LOCO_NET_OCCUPANCY, address, info })) => {
                (*address, 1, u128::from(*info != 0))
            }
            _ => (0, 0, 0),
        };
        (0..count).map(move |at| (first.saturating_add(at), bits >> at & 1 == 1))
    }
}

/// A detector on LocoNet reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocoNetDetection {
    /// What it reports: 1 occupancy, 2 and 3 a transponder that enters or leaves, 0x10 to 0x12 Lissy.
    pub kind: u8,
    /// Its address.
    pub address: u16,
    /// What it reports of that: with occupancy 1 occupied, 0 free.
    pub info: u16,
}

/// A detector on the CAN bus reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CanDetection {
    /// Its number on the bus.
    pub network: u16,
    /// Its address, as a person has set it.
    pub address: u16,
    /// The port, from 0.
    pub port: u8,
    /// What it reports: 1 occupancy, 0x11 to 0x1f the locomotives in it.
    pub kind: u8,
    /// With occupancy below 0x1000 free, from there on occupied (0x12.. overload).
    pub value: u16,
    /// A second value.
    pub more: u16,
}

/// What a decoder says of itself by RailCom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RailCom {
    /// Its address.
    pub address: u16,
    /// Messages that were received from it.
    pub received: u32,
    /// Messages that could not be read.
    pub errors: u16,
    /// Which of the following it sends: bit 0 and 1 a speed, bit 2 quality.
    pub options: u8,
    /// Its speed, in its own unit (km/h where the decoder knows it).
    pub speed: u8,
    /// How good its reception is (0 best).
    pub quality: u8,
}

impl RailCom {
    /// The bits of `options` that announce a speed.
    pub const SPEEDS: u8 = 0x03;
    /// A second speed is counted from here.
    const SECOND_SPEED: u16 = 256;

    /// The speed that its decoder reports, if it reports one. A speed of the second kind begins at 256.
    pub fn reported_speed(&self) -> Option<u16> {
        let above = match self.options & Self::SPEEDS {
            0 => return None,
            1 => 0,
            _ => Self::SECOND_SPEED,
        };
        Some(above + u16::from(self.speed))
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    fn occupied(feedback: Feedback, reply: &Reply) -> Vec<u16> {
        feedback.detections(reply).filter(|(_, occupied)| *occupied).map(|(number, _)| number).collect()
    }

    #[test]
    fn inputs_are_counted_through_modules_and_groups() {
        let mut inputs = [0; GROUP_MODULES];
        (inputs[0], inputs[2], inputs[9]) = (0x01, 0x81, 0x80);
        let group = |group| Reply::Feedback { group, inputs };
        // Module 3, input 1 is 17, as a widespread program counts too.
        assert_eq!(occupied(Feedback::RBus, &group(0)), [1, 17, 24, 80]);
        assert_eq!(occupied(Feedback::RBus, &group(1)), [81, 97, 104, 160]);
        assert_eq!(occupied(Feedback::Can, &group(0)), [0; 0], "another source");
    }

    #[test]
    fn detectors_report_one_sensor_at_a_time() {
        let can = |kind, value| {
            Reply::Can(CanDetection { network: 0xd001, address: 2, port: 3, kind, value, more: 0 })
        };
        assert_eq!(Feedback::Can.detections(&can(1, 0x1100)).collect::<Vec<_>>(), [(12, true)]);
        assert_eq!(Feedback::Can.detections(&can(1, 0x0100)).collect::<Vec<_>>(), [(12, false)]);
        assert_eq!(Feedback::Can.detections(&can(0x11, 0x8003)).count(), 0, "a locomotive's address");
        let loco_net = |kind, info| Reply::LocoNet(LocoNetDetection { kind, address: 17, info });
        assert_eq!(Feedback::LocoNet.detections(&loco_net(1, 1)).collect::<Vec<_>>(), [(17, true)]);
        assert_eq!(Feedback::LocoNet.detections(&loco_net(2, 1)).count(), 0, "a transponder");
    }
}
