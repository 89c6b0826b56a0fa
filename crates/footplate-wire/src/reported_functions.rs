//! What a station has reported of the functions of a locomotive.

use footplate_core::FunctionNumber;

/// What the station has reported of a locomotive's functions. Sets have F0 in the lowest bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReportedFunctions {
    /// The functions that it reported.
    pub known: u32,
    /// Those of them that are on.
    pub on: u32,
}

impl ReportedFunctions {
    /// All functions that a station can switch, these of them on.
    pub const fn all(on: u32) -> Self {
        Self { known: (1 << (FunctionNumber::HIGHEST + 1)) - 1, on }
    }

    /// The state of a function; `None` if the station never reported it.
    #[must_use]
    pub const fn is_on(self, function: FunctionNumber) -> Option<bool> {
        if function.is_in(self.known) { Some(function.is_in(self.on)) } else { None }
    }

    /// These, with what a newer report says.
    #[must_use]
    pub const fn with(self, newer: Self) -> Self {
        Self { known: self.known | newer.known, on: self.on & !newer.known | newer.on & newer.known }
    }
}
