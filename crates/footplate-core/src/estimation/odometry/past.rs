//! What the train did a moment ago, before a slide or spin that is only seen now pulled the estimate along.

use crate::wheels::Loss;

/// How far back is far enough (s): a slide can set in gently for a second before it is seen. At most twice that.
const FAR_ENOUGH_S: f64 = 0.8;

/// Too far (s): something else has happened since.
const TOO_FAR_S: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct Moment {
    speed: f64,
    acceleration: f64,
    clock: f64,
}

/// Two moments that take turns: one old enough to be sound, one that will be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Past {
    sound: Option<Moment>,
    next: Option<Moment>,
}

impl Past {
    pub(super) const fn new() -> Self {
        Self { sound: None, next: None }
    }

    /// Now (`clock` in s) the train moves so (m/s, m/s²).
    pub(super) fn remember(&mut self, speed: f64, acceleration: f64, clock: f64) {
        if self.next.is_none_or(|next| clock - next.clock >= FAR_ENOUGH_S) {
            self.sound = self.next;
            self.next = Some(Moment { speed, acceleration, clock });
        }
    }

    /// The speed (m/s) at which a slide or spin begins that is seen now, at an estimate that it has pulled along.
    pub(super) fn speed_without(&self, kind: Loss, speed: f64, clock: f64) -> f64 {
        let Some(Moment { speed: then, acceleration, clock: since }) = self.sound else {
            return speed;
        };
        if clock - since > TOO_FAR_S {
            return speed;
        }
        let gone_on = then + acceleration * (clock - since);
        // A slide can only have pulled it down, a spin up.
        match kind {
            Loss::Slide => speed.max(gone_on),
            Loss::Spin => speed.min(gone_on.max(0.0)),
        }
    }
}
