//! Names of things as small integers that cannot be mixed up.

/// One newtype over a small integer that is only a name.
macro_rules! id {
    ($(#[$doc:meta])* $name:ident($repr:ty)) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
        pub struct $name(pub $repr);

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id!(
    /// A train by its number on the command station.
    TrainId(u16)
);
id!(
    /// A trackside contact, counted from 0 in the order of the station's modules.
    SensorId(u16)
);
id!(
    /// A turnout by its number on the command station.
    TurnoutId(u16)
);
id!(
    /// A node of the track graph by its place in the layout's list.
    NodeId(u16)
);
id!(
    /// A directed edge of the track graph by its place in the layout's list.
    EdgeId(u16)
);
id!(
    /// A stretch of rail, whichever way it is run over: what an edge and its twin share.
    StretchId(u16)
);
id!(
    /// A run: one stretch of a recording in which the clock is continuous and the train is not lifted.
    RunId(u32)
);

/// A throttle step as the command station counts it; 0 stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct SpeedStep(u8);

impl SpeedStep {
    /// The step at which a train stands.
    pub const STAND: Self = Self(0);
    /// The highest step of any decoder (NMRA S-9.2.1: 126 of the 128 codes are speeds).
    pub const HIGHEST: u8 = 126;

    /// The step, or `None` beyond [`HIGHEST`](Self::HIGHEST).
    #[must_use]
    pub const fn new(step: u8) -> Option<Self> {
        if step <= Self::HIGHEST { Some(Self(step)) } else { None }
    }

    /// The plain number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl core::fmt::Display for SpeedStep {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.fmt(f)
    }
}
