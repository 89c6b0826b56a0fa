//! The network between clients and a station: datagrams take their time, and may be lost, come twice or be overtaken.

use footplate_core::{Ratio, TimeSpan, Timestamp};

use crate::draws::Draws;

/// What a datagram takes (s; a wired network and a wireless one that is not busy).
const TAKES_S: std::ops::Range<f64> = 0.000_2..0.002;
/// What one takes more that is overtaken (s; chosen).
const OVERTAKEN_S: std::ops::Range<f64> = 0.005..0.04;

/// What happens to datagrams, and how often.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Disturbances {
    pub(crate) lost: Ratio,
    pub(crate) duplicated: Ratio,
    pub(crate) overtaken: Ratio,
    /// Whether all others arrive in the order in which they left, however close they follow one another.
    pub(crate) keeps_order: bool,
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
    /// When the last of those that keep their order arrives.
    last_to_station: Timestamp,
    last_to_client: Timestamp,
    to_station: Vec<OnItsWay>,
    to_client: Vec<OnItsWay>,
}

impl Network {
    pub(crate) fn new(draws: Draws, disturbances: Disturbances) -> Self {
        let (last_to_station, last_to_client) = (Timestamp::ZERO, Timestamp::ZERO);
        let (to_station, to_client) = (Vec::new(), Vec::new());
        Self { draws, disturbances, count: 0, last_to_station, last_to_client, to_station, to_client }
    }

    pub(crate) fn send_to_station(&mut self, now: Timestamp, client: usize, datagram: &[u8]) {
        let (sent, last) = self.sent(now, self.last_to_station, client, datagram);
        self.last_to_station = last;
        self.to_station.extend(sent);
    }

    pub(crate) fn send_to_client(&mut self, leaves: Timestamp, client: usize, datagram: &[u8]) {
        let (sent, last) = self.sent(leaves, self.last_to_client, client, datagram);
        self.last_to_client = last;
        self.to_client.extend(sent);
    }

    pub(crate) fn next_to_station(&self) -> Option<Timestamp> {
        self.to_station.iter().map(|datagram| datagram.due).min()
    }

    pub(crate) fn next_to_client(&self) -> Option<Timestamp> {
        self.to_client.iter().map(|datagram| datagram.due).min()
    }

    pub(crate) fn take_to_station(&mut self) -> Option<(usize, Vec<u8>)> {
        take_first(&mut self.to_station)
    }

    pub(crate) fn take_to_client(&mut self) -> Option<(usize, Vec<u8>)> {
        take_first(&mut self.to_client)
    }

    pub(crate) fn clear(&mut self) {
        self.to_station.clear();
        self.to_client.clear();
    }

    /// A datagram leaves: nothing of it arrives, or once or twice. Returns also when the last of those that keep their order
    /// arrives, which was `last` before.
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
            let mut takes_s = self.draws.uniform(TAKES_S);
            let is_overtaken = self.happens(self.disturbances.overtaken);
            if is_overtaken {
                takes_s += self.draws.uniform(OVERTAKEN_S);
            }
            if self.happens(self.disturbances.lost) {
                continue;
            }
            self.count += 1;
            let mut due = leaves + TimeSpan::from_s(takes_s);
            if self.disturbances.keeps_order && !is_overtaken {
                due = due.max(last);
                last = due;
            }
            sent.push(OnItsWay { due, nth: self.count, client, datagram: datagram.to_vec() });
        }
        (sent, last)
    }

    fn happens(&mut self, share: Ratio) -> bool {
        share > Ratio::ZERO && self.draws.chance(share.as_parts())
    }
}

fn take_first(datagrams: &mut Vec<OnItsWay>) -> Option<(usize, Vec<u8>)> {
    let first = datagrams.iter().enumerate().min_by_key(|(_, datagram)| (datagram.due, datagram.nth));
    let at = first.map(|(at, _)| at)?;
    let OnItsWay { client, datagram, .. } = datagrams.swap_remove(at);
    Some((client, datagram))
}
