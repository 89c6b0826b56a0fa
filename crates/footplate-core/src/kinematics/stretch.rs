//! The shape of a profile: when it speeds up, cruises and slows down.

use crate::time::TimeSpan;

/// How the speed of a train changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Running {
    /// Getting faster.
    Accelerating,
    /// Keeping its speed.
    Cruising,
    /// Getting slower.
    Decelerating,
}

/// An interval of a profile with one sign of acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// How the speed changes.
    pub running: Running,
    /// Since the start of the profile.
    pub start: TimeSpan,
    /// Since the start of the profile; the start of the next stretch.
    pub end: TimeSpan,
}

/// Stretches from phases in order of time, each given as its end and its acceleration (only the sign counts). Phases
/// without duration are omitted; neighbours of the same sign are merged.
pub(super) fn stretches(phases: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = Stretch> {
    let mut start = TimeSpan::ZERO;
    let mut phases = phases
        .filter_map(move |(end, acceleration)| {
            let end = TimeSpan::from_s(end);
            let running = if acceleration > 0.0 {
                Running::Accelerating
            } else if acceleration < 0.0 {
                Running::Decelerating
            } else {
                Running::Cruising
            };
            let stretch = Stretch { running, start, end };
            start = end;
            (stretch.start < end).then_some(stretch)
        })
        .peekable();
    core::iter::from_fn(move || {
        let mut stretch = phases.next()?;
        while let Some(next) = phases.next_if(|next| next.running == stretch.running) {
            stretch.end = next.end;
        }
        Some(stretch)
    })
}
