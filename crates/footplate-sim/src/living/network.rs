//! The network between clients and a station: datagrams are delayed, and may be lost, duplicated or overtaken.

use footplate_core::{Ratio, TimeSpan, Timestamp};

use crate::draws::Draws;
use crate::living::due_queue::DueQueue;

/// The transit time of a datagram (s; a wired network, or a wireless one that is not busy).
const TAKES_S: std::ops::Range<f64> = 0.000_2..0.002;
/// The same in a busy wireless network (s; chosen).
const TAKES_SLOW_S: std::ops::Range<f64> = 0.002..0.06;
/// The additional transit time of a datagram that is overtaken (s; chosen).
const OVERTAKEN_S: std::ops::Range<f64> = 0.005..0.04;

/// The faults of a network, with their rates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Disturbances {
    pub(crate) lost: Ratio,
    pub(crate) duplicated: Ratio,
    pub(crate) overtaken: Ratio,
    /// Whether it is a busy wireless network.
    pub(crate) is_slow: bool,
}

/// Datagrams that have not arrived yet, each with its client.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    draws: Draws,
    disturbances: Disturbances,
    to_station: Direction,
    to_client: Direction,
}

/// One direction.
#[derive(Debug, Clone)]
struct Direction {
    datagrams: DueQueue<(usize, Vec<u8>)>,
    /// When the last datagram arrives that is not overtaken: the others stay in order.
    last_due: Timestamp,
}

impl Network {
    pub(crate) fn new(draws: Draws, disturbances: Disturbances) -> Self {
        let direction = || Direction { datagrams: DueQueue::new(), last_due: Timestamp::ZERO };
        Self { draws, disturbances, to_station: direction(), to_client: direction() }
    }

    pub(crate) fn send_to_station(&mut self, now: Timestamp, client: usize, datagram: &[u8]) {
        self.to_station.send(&mut self.draws, self.disturbances, now, (client, datagram));
    }

    pub(crate) fn send_to_client(&mut self, leaves: Timestamp, client: usize, datagram: &[u8]) {
        self.to_client.send(&mut self.draws, self.disturbances, leaves, (client, datagram));
    }

    pub(crate) fn next_to_station(&self) -> Option<Timestamp> {
        self.to_station.datagrams.due()
    }

    pub(crate) fn next_to_client(&self) -> Option<Timestamp> {
        self.to_client.datagrams.due()
    }

    pub(crate) fn take_to_station(&mut self) -> Option<(usize, Vec<u8>)> {
        self.to_station.datagrams.take()
    }

    pub(crate) fn take_to_client(&mut self) -> Option<(usize, Vec<u8>)> {
        self.to_client.datagrams.take()
    }

    pub(crate) fn clear(&mut self) {
        self.to_station.datagrams.clear();
        self.to_client.datagrams.clear();
    }
}

impl Direction {
    /// A datagram leaves: it is lost, or arrives once or twice.
    fn send(
        &mut self,
        draws: &mut Draws,
        disturbances: Disturbances,
        leaves: Timestamp,
        (client, datagram): (usize, &[u8]),
    ) {
        let Disturbances { lost, duplicated, overtaken, is_slow } = disturbances;
        let copies = 1 + usize::from(happens(draws, duplicated));
        for _ in 0..copies {
            let takes_s = if is_slow { TAKES_SLOW_S } else { TAKES_S };
            let mut due = (leaves + TimeSpan::from_s(draws.uniform(takes_s))).max(self.last_due);
            if happens(draws, overtaken) {
                due += TimeSpan::from_s(draws.uniform(OVERTAKEN_S));
            } else {
                self.last_due = due;
            }
            if !happens(draws, lost) {
                self.datagrams.add(due, (client, datagram.to_vec()));
            }
        }
    }
}

fn happens(draws: &mut Draws, share: Ratio) -> bool {
    share > Ratio::ZERO && draws.chance(share.as_parts())
}
