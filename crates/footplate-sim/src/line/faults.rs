//! What goes wrong between a tooth and a number: the faults of tachometers and of the recorder.

use super::recording::{Turned, WheelSample};
use super::tachometer::Edges;
use crate::draws::Draws;
use footplate_core::Timestamp;

/// The fault of a run, if it has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Fault {
    /// None.
    #[default]
    None,
    /// A tooth of the first wheelset is broken off: one pulse less a turn, always at the same angle.
    MissingTooth,
    /// Now and then a sensor misses some pulses.
    MissedPulses,
    /// Bursts of interference add pulses on one channel or on both.
    Bursts,
    /// Passive sensors see nothing of teeth that come too slowly, and no direction.
    DeadWhenSlow,
    /// The second sensor goes on reporting what it reported last, for a while.
    Stuck,
    /// The second sensor reports zeros from some time on.
    DeadSensor,
    /// The phases of the second sensor are swapped: it says backward when it goes forward.
    SwappedDirection,
    /// Only running counters are reported, and they wrap.
    CountersOnly,
    /// The recorder's clock drifts, rows are lost, and some are read late.
    Clock,
    /// Isolated spikes and drop-outs on both channels.
    SpikesAndDropouts,
}

/// How often pulses are missed, on each channel (1 per period), and how many at most.
const MISSED_RATE: f64 = 1e-3;
const MOST_MISSED: usize = 6;
/// How often a burst comes (1 per period), and how many pulses it adds at most.
const BURST_RATE: f64 = 1e-3;
const MOST_IN_A_BURST: usize = 30;
/// Passive sensors see no fewer teeth a second than this.
const SLOWEST_TEETH_PER_S: (f64, f64) = (1.0, 5.0);
/// How often a channel shows a spike, and how often it drops out (1 per period).
const SPIKE_RATE: f64 = 1e-3;
const DROPOUT_RATE: f64 = 1e-3;
/// When a lasting fault begins (s), and how long a sensor is stuck (s).
const BEGINS_S: (f64, f64) = (30.0, 70.0);
const STUCK_S: (f64, f64) = (10.0, 30.0);

/// The two channels from the sensors to the recorder.
#[derive(Debug, Clone)]
pub(crate) struct Channels {
    fault: Fault,
    /// When a lasting fault begins and ends (s).
    lasts: (f64, f64),
    slowest: f64,
    modulus: i64,
    counters: [i64; 2],
    turned: [Option<Turned>; 2],
    stuck_at: i64,
    draws: Draws,
}

impl Channels {
    /// Channels with a fault and counters of a size.
    pub(crate) fn draw(fault: Fault, modulus: i64, draws: &mut Draws) -> Self {
        let mut draws = draws.split();
        let begins = draws.uniform(BEGINS_S.0..BEGINS_S.1);
        let ends = match fault {
            Fault::Stuck => begins + draws.uniform(STUCK_S.0..STUCK_S.1),
            _ => f64::INFINITY,
        };
        let anywhere = |draws: &mut Draws| draws.below(modulus as usize) as i64;
        let counters = [anywhere(&mut draws), anywhere(&mut draws)];
        let slowest = draws.uniform(SLOWEST_TEETH_PER_S.0..SLOWEST_TEETH_PER_S.1);
        Self {
            fault,
            lasts: (begins, ends),
            slowest,
            modulus,
            counters,
            turned: [None; 2],
            stuck_at: 0,
            draws,
        }
    }

    /// When a fault begins and ends that lasts (s).
    pub(crate) fn lasts(&self) -> Option<(f64, f64)> {
        matches!(self.fault, Fault::Stuck | Fault::DeadSensor).then_some(self.lasts)
    }

    /// What arrives of what the sensors saw, at a time (s).
    pub(crate) fn report(&mut self, time: f64, seen: [Edges; 2]) -> [WheelSample; 2] {
        let shared = match self.fault {
            Fault::Bursts if self.draws.chance(BURST_RATE) => Some((self.draws.below(3), self.burst())),
            _ => None,
        };
        [0, 1].map(|at| {
            let noise = match shared {
                // On the first, the second, or both.
                Some((hit, pulses)) if hit == at || hit == 2 => pulses,
                _ => 0,
            };
            self.channel(at, time, seen[at], noise)
        })
    }

    fn burst(&mut self) -> i64 {
        1 + self.draws.below(MOST_IN_A_BURST) as i64
    }

    fn channel(&mut self, at: usize, time: f64, mut seen: Edges, noise: i64) -> WheelSample {
        let lasting = self.lasts.0 <= time && time < self.lasts.1 && at == 1;
        let mut is_lost = false;
        if self.fault == Fault::DeadWhenSlow {
            // One coil knows no direction.
            (seen.forward, seen.backward) = (seen.forward + seen.backward, 0);
        }
        match self.fault {
            Fault::DeadWhenSlow if seen.rate.abs() < self.slowest => {
                seen = Edges { rate: seen.rate, ..Edges::default() }
            }
            Fault::DeadSensor if lasting => seen = Edges::default(),
            Fault::SwappedDirection if at == 1 => {
                (seen.forward, seen.backward) = (seen.backward, seen.forward);
            }
            Fault::MissedPulses if self.draws.chance(MISSED_RATE) => {
                let missed = 1 + self.draws.below(MOST_MISSED) as i64;
                seen.forward = (seen.forward - missed).max(0);
            }
            Fault::Stuck if lasting => {
                (seen.forward, seen.backward) = (self.stuck_at, 0);
            }
            Fault::SpikesAndDropouts => {
                if self.draws.chance(SPIKE_RATE) {
                    seen.forward += self.burst();
                }
                if self.draws.chance(DROPOUT_RATE) {
                    // Half of the time the report is lost and the counter goes on, half of the time the pulses are.
                    is_lost = self.draws.chance(0.5);
                    if !is_lost {
                        seen = Edges { rate: seen.rate, ..Edges::default() };
                    }
                }
            }
            _ => {}
        }
        seen.forward += noise;
        if !lasting {
            self.stuck_at = if at == 1 { seen.forward } else { self.stuck_at };
        }
        let net = seen.forward - seen.backward;
        self.counters[at] = (self.counters[at] + net).rem_euclid(self.modulus);
        if net != 0 {
            self.turned[at] = Some(if net > 0 { Turned::Forward } else { Turned::Backward });
        }
        if is_lost {
            return WheelSample { pulses: None, counter: None, turned: None, last_edge: None };
        }
        let pulses = seen.forward + seen.backward;
        WheelSample {
            pulses: (self.fault != Fault::CountersOnly).then_some(pulses),
            counter: Some(self.counters[at]),
            turned: self.turned[at].filter(|_| self.fault != Fault::DeadWhenSlow),
            last_edge: seen.last.filter(|_| pulses > 0).map(to_microsecond),
        }
    }
}

/// Hardware stamps to a microsecond.
fn to_microsecond(seconds: f64) -> Timestamp {
    Timestamp::from_ns(1000 * (1e6 * seconds).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    fn channels(fault: Fault) -> Channels {
        Channels::draw(fault, 1 << 16, &mut Draws::new(11, Purpose::Faults))
    }

    fn ten() -> [Edges; 2] {
        [Edges { forward: 10, backward: 0, last: Some(0.0), rate: 200.0 }; 2]
    }

    /// How much more or less each of many periods says than ten pulses; missing ones as −10.
    fn differences(fault: Fault, periods: u32) -> Vec<[i64; 2]> {
        let mut channels = channels(fault);
        (0..periods)
            .map(|at| {
                channels.report(0.05 * f64::from(at), ten()).map(|wheel| wheel.pulses.unwrap_or(0) - 10)
            })
            .collect()
    }

    /// Whether so many of a number of tries are within five standard errors of a rate.
    fn as_often(found: usize, tries: f64, rate: f64) -> bool {
        (found as f64 - tries * rate).abs() <= 5.0 * libm::sqrt(tries * rate)
    }

    #[test]
    fn faults_come_as_often_as_they_should() {
        let n = 200_000;
        let tries = f64::from(n);
        let missed = differences(Fault::MissedPulses, n);
        assert!(as_often(missed.iter().filter(|two| two[0] < 0).count(), tries, MISSED_RATE));
        assert!(missed.iter().flatten().all(|less| (-6..=0).contains(less)));

        let bursts = differences(Fault::Bursts, n);
        let both = bursts.iter().filter(|two| two[0] > 0 && two[1] > 0);
        assert!(as_often(both.clone().count(), tries, BURST_RATE / 3.0));
        assert!(both.clone().all(|two| two[0] == two[1]));
        assert!(as_often(bursts.iter().filter(|two| **two != [0, 0]).count(), tries, BURST_RATE));

        let spiky = differences(Fault::SpikesAndDropouts, n);
        for at in [0, 1] {
            assert!(as_often(spiky.iter().filter(|two| two[at] > 0).count(), tries, SPIKE_RATE));
            assert!(as_often(spiky.iter().filter(|two| two[at] == -10).count(), tries, DROPOUT_RATE));
        }
        assert!(differences(Fault::None, n).iter().all(|two| *two == [0, 0]));
    }

    #[test]
    fn a_dead_sensor_says_zero_for_good_and_a_stuck_one_its_last_word_for_a_while() {
        let dead = differences(Fault::DeadSensor, 4000);
        assert!(dead.iter().all(|two| two[0] == 0));
        let first = dead.iter().position(|two| two[1] == -10).unwrap();
        assert!((600..=1400).contains(&first));
        assert!(dead.iter().skip(first).all(|two| two[1] == -10));

        let mut channels = channels(Fault::Stuck);
        let said: Vec<i64> = (0..4000_i64)
            .map(|at| {
                let edges = Edges { forward: at, ..ten()[1] };
                channels.report(0.05 * at as f64, [edges; 2])[1].pulses.unwrap()
            })
            .collect();
        let stuck = said.iter().zip(0_i64..).filter(|(said, at)| *said != at).count();
        assert!((200..=600).contains(&stuck), "{stuck}");
        assert_eq!(said[3999], 3999, "and comes back");
    }

    #[test]
    fn counters_wrap_and_swapped_phases_count_down() {
        let mut channels = Channels::draw(Fault::SwappedDirection, 64, &mut Draws::new(1, Purpose::Faults));
        let mut last = channels.report(0.0, ten()).map(|wheel| wheel.counter.unwrap());
        for _ in 0..100 {
            let wheels = channels.report(0.0, ten());
            let now = wheels.map(|wheel| wheel.counter.unwrap());
            assert!(now.iter().all(|counter| (0..64).contains(counter)));
            assert_eq!((now[0] - last[0]).rem_euclid(64), 10);
            assert_eq!((now[1] - last[1]).rem_euclid(64), 54);
            assert_eq!(wheels.map(|wheel| wheel.turned), [Some(Turned::Forward), Some(Turned::Backward)]);
            last = now;
        }
    }

    #[test]
    fn a_passive_sensor_sees_nothing_of_slow_teeth() {
        let mut channels = channels(Fault::DeadWhenSlow);
        let slow = Edges { forward: 1, rate: 0.9, ..ten()[0] };
        let fast = Edges { forward: 1, rate: 5.1, ..ten()[0] };
        assert_eq!(channels.report(0.0, [slow, fast]).map(|wheel| wheel.pulses), [Some(0), Some(1)]);
    }
}
