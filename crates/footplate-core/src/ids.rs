//! Identifiers as small integers of distinct types.

/// Defines a newtype over a small integer that serves only as a name.
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
    /// A train, by its number on the command station.
    TrainId(u16)
);
id!(
    /// A trackside sensor, counted from 0 in the order of the station's modules.
    SensorId(u16)
);
id!(
    /// A turnout, by its number on the command station.
    TurnoutId(u16)
);
id!(
    /// A node of the track graph, by its index in the layout.
    NodeId(u16)
);
id!(
    /// A directed edge of the track graph, by its index in the layout.
    EdgeId(u16)
);
id!(
    /// A stretch of rail in either direction: an edge and its twin.
    StretchId(u16)
);
id!(
    /// A run: a stretch of a recording in which the clock is continuous and no train is lifted.
    RunId(u32)
);

/// A throttle step as the command station counts it; 0 is stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct SpeedStep(u8);

impl SpeedStep {
    /// The step of a train at rest.
    pub const STAND: Self = Self(0);
    /// The highest step of any decoder (NMRA S-9.2.1: 126 of the 128 codes are speeds).
    pub const HIGHEST: u8 = 126;

    /// The step, or `None` above [`HIGHEST`](Self::HIGHEST).
    pub const fn new(step: u8) -> Option<Self> {
        if step <= Self::HIGHEST { Some(Self(step)) } else { None }
    }

    /// The number of the step.
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

/// How many speed steps a decoder has (NMRA S-9.2 and S-9.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DecoderSteps {
    /// 14 steps.
    Fourteen,
    /// 28 steps.
    TwentyEight,
    /// 126 steps; some stations say 128, because they count stop and emergency stop.
    All,
}

impl DecoderSteps {
    /// The kinds of decoders, fewest steps first.
    pub const EVERY: [Self; 3] = [Self::Fourteen, Self::TwentyEight, Self::All];

    /// The highest step.
    #[must_use]
    pub const fn highest(self) -> SpeedStep {
        SpeedStep(match self {
            Self::Fourteen => 14,
            Self::TwentyEight => 28,
            Self::All => SpeedStep::HIGHEST,
        })
    }

    /// The decoder with the fewest steps that has this one.
    pub fn with(step: SpeedStep) -> Self {
        Self::EVERY.into_iter().find(|steps| steps.highest() >= step).unwrap_or(Self::All)
    }

    /// A step on a scale whose highest number is that of the highest step, to the nearest; `None` beyond the highest step.
    #[must_use]
    pub fn scaled(self, step: SpeedStep, highest: u8) -> Option<u8> {
        let own = u16::from(self.highest().get());
        let scaled = (2 * u16::from(step.get()) * u16::from(highest) + own) / (2 * own);
        u8::try_from(scaled).ok().filter(|_| step <= self.highest())
    }
}

impl core::fmt::Display for DecoderSteps {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.highest().fmt(f)
    }
}

/// A function of a decoder, F0 to F28; F0 is the headlight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct FunctionNumber(u8);

impl FunctionNumber {
    /// F0, the headlight.
    pub const LIGHT: Self = Self(0);
    /// The highest function of any decoder that every station can switch (NMRA S-9.2.1: function groups one and two, and expansion to F28).
    pub const HIGHEST: u8 = 28;

    /// The function, or `None` above [`HIGHEST`](Self::HIGHEST).
    pub const fn new(number: u8) -> Option<Self> {
        if number <= Self::HIGHEST { Some(Self(number)) } else { None }
    }

    /// The number of the function.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }

    /// All functions, F0 first.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..=Self::HIGHEST).map(Self)
    }

    /// Whether this function is in a set with F0 in the lowest bit.
    #[must_use]
    pub const fn is_in(self, functions: u32) -> bool {
        functions & self.bit() != 0
    }

    /// The bit of this function in a set with F0 in the lowest bit.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self.0
    }
}

impl core::fmt::Display for FunctionNumber {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "F{}", self.0)
    }
}
