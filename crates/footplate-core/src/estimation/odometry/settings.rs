//! Which of the ways to estimate is taken.

/// How an [`Odometer`](super::Odometer) works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct OdometrySettings {
    /// Everything beyond the published algorithm that has earned its place.
    pub beyond_the_paper: bool,
}

impl OdometrySettings {
    /// The published algorithm (Zhang, Yang, Cheng and Li, China Railway Science 43(1), 2022), as closely as it can be
    /// read.
    #[must_use]
    pub const fn paper() -> Self {
        Self { beyond_the_paper: false }
    }

    /// What is best on every scenario.
    #[must_use]
    pub const fn recommended() -> Self {
        Self { beyond_the_paper: true }
    }
}
