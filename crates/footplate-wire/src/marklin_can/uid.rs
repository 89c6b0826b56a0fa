//! The numbers of locomotives and turnouts on the bus: 32 bits, of which a range belongs to each protocol of the track.

use core::ops::RangeInclusive;

/// The number of a locomotive, an accessory or a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Uid(pub u32);

impl Uid {
    /// All that can be meant.
    pub const ALL: Self = Self(0);
}

/// The protocol that the decoder of a locomotive understands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LocomotiveProtocol {
    /// Märklin-Motorola.
    #[default]
    Motorola,
    /// mfx; its numbers are those of the station's list of locomotives.
    Mfx,
    /// DCC.
    Dcc,
}

impl LocomotiveProtocol {
    /// The addresses: of Motorola decoders, of mfx registrations, of DCC decoders (NMRA S-9.2.1).
    #[must_use]
    pub const fn addresses(self) -> RangeInclusive<u16> {
        match self {
            Self::Motorola => 1..=255,
            Self::Mfx => 1..=0x3FFF,
            Self::Dcc => 1..=10_239,
        }
    }

    /// The number of an address.
    #[must_use]
    pub const fn uid(self, address: u16) -> Uid {
        let base = match self {
            Self::Motorola => 0x0000,
            Self::Mfx => 0x4000,
            Self::Dcc => 0xC000,
        };
        Uid(base + address as u32)
    }
}

/// The protocol that the decoder of a turnout understands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AccessoryProtocol {
    /// Märklin-Motorola.
    #[default]
    Motorola,
    /// DCC.
    Dcc,
}

impl AccessoryProtocol {
    /// The addresses that stations offer (320), and those of DCC accessory decoders (NMRA S-9.2.1).
    #[must_use]
    pub const fn addresses(self) -> RangeInclusive<u16> {
        match self {
            Self::Motorola => 1..=320,
            Self::Dcc => 1..=2044,
        }
    }

    /// The number of an address, which is counted from 1.
    #[must_use]
    pub const fn uid(self, address: u16) -> Uid {
        let base = match self {
            Self::Motorola => 0x3000,
            Self::Dcc => 0x3800,
        };
        Uid(base + address.saturating_sub(1) as u32)
    }

    /// The address of a number, if it is one of this protocol.
    #[must_use]
    pub fn address(self, uid: Uid) -> Option<u16> {
        let address = uid.0.checked_sub(self.uid(1).0)?.checked_add(1)?;
        u16::try_from(address).ok().filter(|address| self.addresses().contains(address))
    }
}
