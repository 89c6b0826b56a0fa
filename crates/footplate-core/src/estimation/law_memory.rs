//! What is known of the laws by which a train changes speed, from one change to the next.
//!
//! Getting slower need not mirror getting faster, so both directions are learnt apart. Every law is put to
//! the test at every report during a change; the evidence of each fades, so that a train whose decoder is
//! reprogrammed is believed again soon.

use super::belief::{A, Belief, C, Q, U};
use crate::calibration::{Direction, LawFamily};

/// Delay from a command to its effect before a train has shown its own (s): 0.1 to 1 s over published
/// decoders and stations.
const EXPECTED_DELAY_S: f64 = 0.4;
const DELAY_SPREAD_S: f64 = 0.3;
/// Evidence fades by this factor a report.
const FADING: f64 = 0.97;
/// One report can count against a law by this much at most (as ln probability density).
const WORST_EVIDENCE: f64 = -8.0;
/// Laws are doubted a little more after every report, so that they follow a train that changes.
const PACE_WANDER: f64 = 0.01;
const DELAY_WANDER_S: f64 = 0.01;

/// One law with its pace and delay as learnt so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownLaw {
    /// The law.
    pub family: LawFamily,
    /// Logarithm of its pace, and the delay in s.
    pub ln_pace_and_delay: [f64; 2],
    /// Their covariance.
    pub covariance: [[f64; 2]; 2],
    /// Faded sum of ln probability densities of the reports under this law.
    pub evidence: f64,
}

impl KnownLaw {
    /// Takes over pace (m/s² or s), delay (s), the covariance of ln pace and delay, and evidence from
    /// elsewhere, such as a calibration. A pace that is none leaves the law as it was.
    pub fn take_over(&mut self, pace: f64, delay: f64, covariance: [[f64; 2]; 2], evidence: f64) {
        let all = covariance.iter().flatten().chain([&delay, &evidence]);
        if pace > 0.0 && pace.is_finite() && all.into_iter().all(|value| value.is_finite()) {
            *self = Self { ln_pace_and_delay: [libm::log(pace), delay], covariance, evidence, ..*self };
        }
    }
}

/// The laws of both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawMemory {
    up: [KnownLaw; LawFamily::LIVE.len()],
    down: [KnownLaw; LawFamily::LIVE.len()],
}

impl Default for LawMemory {
    fn default() -> Self {
        let laws = LawFamily::LIVE.map(|family| {
            let (ln_pace, variance) = family.expected_ln_pace();
            KnownLaw {
                family,
                ln_pace_and_delay: [ln_pace, EXPECTED_DELAY_S],
                covariance: [[variance, 0.0], [0.0, DELAY_SPREAD_S * DELAY_SPREAD_S]],
                evidence: 0.0,
            }
        });
        Self { up: laws, down: laws }
    }
}

impl LawMemory {
    /// The laws of a direction, in the order of [`LawFamily::LIVE`].
    #[must_use]
    pub const fn laws(&self, direction: Direction) -> &[KnownLaw; LawFamily::LIVE.len()] {
        match direction {
            Direction::Up => &self.up,
            Direction::Down => &self.down,
        }
    }

    /// The same, to take over a calibration.
    pub const fn laws_mut(&mut self, direction: Direction) -> &mut [KnownLaw; LawFamily::LIVE.len()] {
        match direction {
            Direction::Up => &mut self.up,
            Direction::Down => &mut self.down,
        }
    }

    /// Which law explains the reports best; the first while none was tested.
    #[must_use]
    pub fn best(&self, direction: Direction) -> usize {
        let mut best = (0, f64::NEG_INFINITY);
        for (place, law) in self.laws(direction).iter().enumerate() {
            if law.evidence > best.1 {
                best = (place, law.evidence);
            }
        }
        best.0
    }

    /// Beliefs to begin a change with: laws known, place and speed not.
    pub(super) fn beliefs(&self, direction: Direction) -> [Belief; LawFamily::LIVE.len()] {
        self.laws(direction).map(|law| {
            let mut belief = Belief { family: law.family, x: [0.0; 4], p: [[0.0; 4]; 4] };
            let [ln_pace, delay] = law.ln_pace_and_delay;
            (belief.x[A], belief.x[Q]) = (ln_pace, delay);
            let [[pp, pd], [_, dd]] = law.covariance;
            (belief.p[A][A], belief.p[Q][Q]) = (pp, dd);
            (belief.p[A][Q], belief.p[Q][A]) = (pd, pd);
            (belief.p[C][C], belief.p[U][U]) = (0.0, 0.0);
            belief
        })
    }

    /// A report had this probability density under the law at `place`.
    pub(super) fn weigh(&mut self, direction: Direction, place: usize, density: f64) {
        if let Some(law) = self.laws_mut(direction).get_mut(place) {
            law.evidence = FADING * law.evidence + libm::log(density.max(1e-300)).max(WORST_EVIDENCE);
        }
    }

    /// Keeps what a belief has learnt of its law.
    pub(super) fn keep(&mut self, direction: Direction, place: usize, belief: &Belief) {
        if let Some(law) = self.laws_mut(direction).get_mut(place) {
            law.ln_pace_and_delay = [belief.x[A], belief.x[Q]];
            law.covariance = [
                [belief.p[A][A] + PACE_WANDER * PACE_WANDER, belief.p[A][Q]],
                [belief.p[Q][A], belief.p[Q][Q] + DELAY_WANDER_S * DELAY_WANDER_S],
            ];
        }
    }
}
