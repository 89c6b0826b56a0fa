//! Broadcast flags: what the station reports to a client by itself.

use core::ops::BitOr;

/// Kinds of messages, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Broadcasts(pub u32);

impl Broadcasts {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Power, stops, short circuits, subscribed locomotives and turnouts.
    pub const STATES: Self = Self(0x0000_0001);
    /// Feedback modules on the R-BUS.
    pub const R_BUS: Self = Self(0x0000_0002);
    /// RailCom data of subscribed locomotives.
    pub const RAIL_COM: Self = Self(0x0000_0004);
    /// Currents, voltages and temperature.
    pub const SYSTEM_STATE: Self = Self(0x0000_0100);
    /// All locomotives, subscribed or not.
    pub const ALL_LOCOMOTIVES: Self = Self(0x0001_0000);
    /// RailCom data of all locomotives.
    pub const ALL_RAIL_COM: Self = Self(0x0004_0000);
    /// Occupancy detectors on the CAN bus.
    pub const CAN: Self = Self(0x0008_0000);
    /// Occupancy detectors on LocoNet. Do not ask for it where there are none: some stations then report nothing else.
    pub const LOCO_NET: Self = Self(0x0800_0000);

    /// Whether it holds all of another.
    #[must_use]
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl BitOr for Broadcasts {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
