//! The worlds that are scored, by name.

use std::fmt;

use anyhow::anyhow;
use footplate_sim::PhysicsRange;

/// One of the worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WorldName {
    /// Physics drawn from a range.
    Range(PhysicsRange),
    /// The usual world, in which one start from rest comes 45 mm early in the first session.
    EarlyStart,
}

impl WorldName {
    const EARLY_START: &str = "early-start";

    /// All of them, in the order of the table.
    pub(super) fn every() -> Vec<Self> {
        let ranges = PhysicsRange::EVERY.into_iter().map(Self::Range);
        ranges.chain([Self::EarlyStart]).collect()
    }

    pub(super) fn parse(name: &str) -> anyhow::Result<Self> {
        if name == Self::EARLY_START {
            return Ok(Self::EarlyStart);
        }
        PhysicsRange::named(name).map(Self::Range).ok_or_else(|| {
            let names: Vec<String> = Self::every().iter().map(ToString::to_string).collect();
            anyhow!("there is no world `{name}`; there are {}", names.join(", "))
        })
    }

    /// What its physics are drawn from.
    pub(super) const fn physics(self) -> PhysicsRange {
        match self {
            Self::Range(range) => range,
            Self::EarlyStart => PhysicsRange::Usual,
        }
    }
}

impl fmt::Display for WorldName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Range(range) => range.name(),
            Self::EarlyStart => Self::EARLY_START,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_world_is_found_by_its_name() {
        for world in WorldName::every() {
            assert_eq!(WorldName::parse(&world.to_string()).unwrap(), world);
        }
        assert!(WorldName::parse("mars").unwrap_err().to_string().contains("there are usual, "));
    }
}
