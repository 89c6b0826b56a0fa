//! The network between the clients and the station: datagrams take their time, and may be lost, come twice or be overtaken.

use footplate_core::{Ratio, TimeSpan, Timestamp};

use crate::draws::Draws;
use crate::living::z21_switches::Z21Switches;

/// What a datagram takes (s; a wired network and a wireless one that is not busy).
const TAKES_S: std::ops::Range<f64> = 0.000_2..0.002;
/// What one takes more that is overtaken (s; chosen).
const OVERTAKEN_S: std::ops::Range<f64> = 0.005..0.04;

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
pub(super) struct Network {
    draws: Draws,
    lost: Ratio,
    duplicated: Ratio,
    overtaken: Ratio,
    count: u64,
    to_station: Vec<OnItsWay>,
    to_client: Vec<OnItsWay>,
}

impl Network {
    pub(super) const fn new(draws: Draws, switches: Z21Switches) -> Self {
        let Z21Switches { lost, duplicated, overtaken, .. } = switches;
        Self { draws, lost, duplicated, overtaken, count: 0, to_station: Vec::new(), to_client: Vec::new() }
    }

    pub(super) fn send_to_station(&mut self, now: Timestamp, client: usize, datagram: &[u8]) {
        let sent = self.sent(now, client, datagram);
        self.to_station.extend(sent);
    }

    pub(super) fn send_to_client(&mut self, leaves: Timestamp, client: usize, datagram: &[u8]) {
        let sent = self.sent(leaves, client, datagram);
        self.to_client.extend(sent);
    }

    pub(super) fn next_to_station(&self) -> Option<Timestamp> {
        self.to_station.iter().map(|datagram| datagram.due).min()
    }

    pub(super) fn next_to_client(&self) -> Option<Timestamp> {
        self.to_client.iter().map(|datagram| datagram.due).min()
    }

    pub(super) fn take_to_station(&mut self) -> Option<(usize, Vec<u8>)> {
        take_first(&mut self.to_station)
    }

    pub(super) fn take_to_client(&mut self) -> Option<(usize, Vec<u8>)> {
        take_first(&mut self.to_client)
    }

    pub(super) fn clear(&mut self) {
        self.to_station.clear();
        self.to_client.clear();
    }

    /// A datagram leaves: nothing of it arrives, or once or twice.
    fn sent(&mut self, leaves: Timestamp, client: usize, datagram: &[u8]) -> Vec<OnItsWay> {
        let copies = 1 + usize::from(self.happens(self.duplicated));
        let mut sent = Vec::with_capacity(copies);
        for _ in 0..copies {
            let mut takes_s = self.draws.uniform(TAKES_S);
            if self.happens(self.overtaken) {
                takes_s += self.draws.uniform(OVERTAKEN_S);
            }
            if self.happens(self.lost) {
                continue;
            }
            self.count += 1;
            let due = leaves + TimeSpan::from_s(takes_s);
            sent.push(OnItsWay { due, nth: self.count, client, datagram: datagram.to_vec() });
        }
        sent
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
