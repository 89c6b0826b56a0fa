//! Balises along the line, and the antenna that reads them.

use crate::draws::Draws;

/// From one to the next (m): drawn from these.
const APART_M: (f64, f64) = (1350.0, 1650.0);
/// Where the first one is (m).
const FIRST_M: (f64, f64) = (150.0, 600.0);
/// How well places are surveyed (m, one standard deviation; the worst is three times that).
const PLACE_M: f64 = 0.3;
/// The error of the assumed place of the antenna (m, one standard deviation).
const ANTENNA_M: f64 = 0.02;
/// What the reader takes to report (s).
const LATENCY_S: (f64, f64) = (0.008, 0.012);
/// How often a balise is passed and not read (chosen: far more often than on a railway, to show what happens).
const MISSED: f64 = 0.02;

/// How well a place is known that is marked by hand or by satellites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MarkAccuracy {
    /// What is said of it (m, one standard deviation).
    pub(crate) deviation: f64,
    /// How often it is wrong, and between which amounts then (m).
    pub(crate) wrong: f64,
    pub(crate) wrong_by: (f64, f64),
}

impl MarkAccuracy {
    /// How far a mark is off.
    fn draw(&self, draws: &mut Draws) -> f64 {
        let (least, most) = self.wrong_by;
        let right = draws.normal_within(0.0, self.deviation, 3.0);
        let wrong = draws.uniform(least..most) * if draws.chance(0.5) { 1.0 } else { -1.0 };
        if draws.chance(self.wrong) { wrong } else { right }
    }
}

/// The line's balises and the train's reader.
#[derive(Debug, Clone)]
pub(crate) struct Balises {
    /// The next one: where it is (m).
    next: f64,
    antenna: f64,
    marks: Option<MarkAccuracy>,
    draws: Draws,
}

/// A balise that was passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Passed {
    /// It was read: where the map has it (m), and when it was reported (s).
    Read {
        /// The place in the map.
        place: f64,
        /// The time of the report.
        at: f64,
    },
    /// It was not.
    Missed,
}

impl Balises {
    /// Balises ahead of a place (m).
    pub(crate) fn draw(place: f64, marks: Option<MarkAccuracy>, draws: &mut Draws) -> Self {
        let mut draws = draws.split();
        Self {
            marks,
            next: place + draws.uniform(FIRST_M.0..FIRST_M.1),
            antenna: draws.normal_within(0.0, ANTENNA_M, 3.0),
            draws,
        }
    }

    /// The balise that the train passed while it went forward from one place and time to another (m, s).
    pub(crate) fn pass(&mut self, [from, to]: [f64; 2], [begins, ends]: [f64; 2]) -> Option<Passed> {
        let reached = self.next + self.antenna;
        if to < reached {
            return None;
        }
        let place = self.next;
        self.next += self.draws.uniform(APART_M.0..APART_M.1);
        let off = match &self.marks {
            Some(marks) => marks.draw(&mut self.draws),
            None => self.draws.normal_within(0.0, PLACE_M, 3.0),
        };
        let surveyed = place + off;
        let part = if to > from { ((reached - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        let at = begins + part * (ends - begins) + self.draws.uniform(LATENCY_S.0..LATENCY_S.1);
        Some(if self.draws.chance(MISSED) { Passed::Missed } else { Passed::Read { place: surveyed, at } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    #[test]
    fn balises_come_every_one_and_a_half_kilometres_and_are_where_the_map_has_them_to_a_metre() {
        let mut balises = Balises::draw(0.0, None, &mut Draws::new(3, Purpose::Line));
        let (mut read, mut missed) = (0, 0);
        for step in 0..4_000_000_u32 {
            // 0.5 m every 10 ms.
            let (place, time) = (0.5 * f64::from(step), 0.01 * f64::from(step));
            match balises.pass([place, place + 0.5], [time, time + 0.01]) {
                Some(Passed::Read { place: surveyed, at }) => {
                    read += 1;
                    assert!((surveyed - place).abs() < 0.9 + 0.06 + 0.5);
                    assert!((0.008..0.022).contains(&(at - time)));
                }
                Some(Passed::Missed) => missed += 1,
                None => {}
            }
        }
        // 2000 km.
        assert!((1200..1450).contains(&(read + missed)));
        assert!((10..50).contains(&missed), "{missed}");
    }
}
