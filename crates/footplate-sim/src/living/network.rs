//! The network between clients and a station: datagrams take their time, and may be lost, come twice or be overtaken.

use footplate_core::{Ratio, TimeSpan, Timestamp};

use crate::draws::Draws;

/// What a datagram takes (s; a wired network and a wireless one that is not busy).
const TAKES_S: std::ops::Range<f64> = 0.000_2..0.002;
/// The same in a wireless network that others use, too (s; chosen).
const TAKES_SLOW_S: std::ops::Range<f64> = 0.002..0.06;
/// What one takes more that is overtaken (s; chosen).
const OVERTAKEN_S: std::ops::Range<f64> = 0.005..0.04;

/// What happens to datagrams, and how often.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Disturbances {
    pub(crate) lost: Ratio,
    pub(crate) duplicated: Ratio,
    pub(crate) overtaken: Ratio,
    /// Whether others use it, too.
    pub(crate) is_slow: bool,
}

/// A datagram on its way.
#[derive(Debug, Clone)]
struct OnItsWay {
    due: Timestamp,
    /// Of those that are due at one time the one that left first.
    nth: u64,
    client: usize,
    datagram: Vec<u8>,
}

/// All datagrams on their way.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    draws: Draws,
    disturbances: Disturbances,
    count: u64,
    to_station: Way,
    to_client: Way,
}

/// One direction.
#[derive(Debug, Clone)]
struct Way {
    datagrams: Vec<OnItsWay>,
    /// When the last one arrives that is not overtaken: the others stay in order.
    last_due: Timestamp,
}

impl Network {
    pub(crate) fn new(draws: Draws, disturbances: Disturbances) -> Self {
        let way = || Way { datagrams: Vec::new(), last_due: Timestamp::ZERO };
        Self { draws, disturbances, count: 0, to_station: way(), to_client: way() }
    }

    pub(crate) fn send_to_station(&mut self, now: Timestamp, client: usize, datagram: &[u8]) {
        let last = self.to_station.last_due;
        let (sent, last) = self.sent(now, last, client, datagram);
        self.to_station.take(sent, last);
    }

    pub(crate) fn send_to_client(&mut self, leaves: Timestamp, client: usize, datagram: &[u8]) {
        let last = self.to_client.last_due;
        let (sent, last) = self.sent(leaves, last, client, datagram);
        self.to_client.take(sent, last);
    }

    pub(crate) fn next_to_station(&self) -> Option<Timestamp> {
        self.to_station.next()
    }

    pub(crate) fn next_to_client(&self) -> Option<Timestamp> {
        self.to_client.next()
    }

    pub(crate) fn take_to_station(&mut self) -> Option<(usize, Vec<u8>)> {
        self.to_station.take_first()
    }

    pub(crate) fn take_to_client(&mut self) -> Option<(usize, Vec<u8>)> {
        self.to_client.take_first()
    }

    pub(crate) fn clear(&mut self) {
        self.to_station.datagrams.clear();
        self.to_client.datagrams.clear();
    }

    /// A datagram leaves: nothing of it arrives, or once or twice, none before `last`; returns the new last.
    fn sent(
        &mut self,
        leaves: Timestamp,
        mut last: Timestamp,
        client: usize,
        datagram: &[u8],
    ) -> (Vec<OnItsWay>, Timestamp) {
        let copies = 1 + usize::from(self.happens(self.disturbances.duplicated));
        let mut sent = Vec::with_capacity(copies);
        for _ in 0..copies {
            let takes_s = if self.disturbances.is_slow { TAKES_SLOW_S } else { TAKES_S };
            let mut due = (leaves + TimeSpan::from_s(self.draws.uniform(takes_s))).max(last);
            if self.happens(self.disturbances.overtaken) {
                due += TimeSpan::from_s(self.draws.uniform(OVERTAKEN_S));
            } else {
                last = due;
            }
            if self.happens(self.disturbances.lost) {
                continue;
            }
            self.count += 1;
            sent.push(OnItsWay { due, nth: self.count, client, datagram: datagram.to_vec() });
        }
        (sent, last)
    }

    fn happens(&mut self, share: Ratio) -> bool {
        share > Ratio::ZERO && self.draws.chance(share.as_parts())
    }
}

impl Way {
    fn take(&mut self, sent: Vec<OnItsWay>, last_due: Timestamp) {
        self.datagrams.extend(sent);
        self.last_due = last_due;
    }

    fn next(&self) -> Option<Timestamp> {
        self.datagrams.iter().map(|datagram| datagram.due).min()
    }

    fn take_first(&mut self) -> Option<(usize, Vec<u8>)> {
        let first =
            self.datagrams.iter().enumerate().min_by_key(|(_, datagram)| (datagram.due, datagram.nth));
        let at = first.map(|(at, _)| at)?;
        let OnItsWay { client, datagram, .. } = self.datagrams.swap_remove(at);
        Some((client, datagram))
    }
}
