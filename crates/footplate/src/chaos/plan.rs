//! What a seed draws: a station, failures with their times, and how each life of the program ends.

use footplate_core::{TimeSpan, Timestamp};
use footplate_eval::seeds::Choice;

use super::life::{Death, Spell};
use super::selection::Selection;
use crate::link::StationKind;
use crate::session_journal::IfUnkept;

/// Lives of the program in one story, at most.
const MOST_LIVES: usize = 3;
/// The length of a life that nothing ends (s of track time). The last one continues after all failures, and shows whether
/// trains run again.
const LASTS_S: [f64; 2] = [15.0, 60.0];
const LAST_LIFE_S: f64 = 240.0;
/// Failures begin within this part of a life.
const TROUBLES_WITHIN: f64 = 0.8;
/// Steps of a life in which it may die: a loop makes some 100 a second.
const STEPS_PER_S: f64 = 100.0;
/// How long a guardian hangs that goes on afterwards (s): around the 0.6 s after which the program ends it.
const GUARDIAN_HANGS_S: [f64; 2] = [0.01, 1.0];
/// Steps of an orderly end, at most: some end after three, some after a hundred.
const FAREWELL_STEPS: usize = 40;
const MOST_TROUBLES: usize = 5;
/// Seeds below this one draw one of the first four stations, so that the stories of seeds that failed once stay what they are.
const FOUR_STATIONS_UNTIL: u64 = 20_000_000;
/// Seeds below this one draw no guardian that hangs, and no death while the last life ends, for the same reason.
pub(crate) const NO_GUARDIAN_HANGS_UNTIL: u64 = 70_000_000;
const STATIONS: [StationKind; 6] = [
    StationKind::Marklin,
    StationKind::DccEx,
    StationKind::Z21,
    StationKind::MarklinCan,
    StationKind::LocoNet,
    StationKind::Jmri,
];

/// A failure of the line, the disk or a clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trouble {
    /// No byte passes. A serial line notices.
    Cut,
    /// The percentage of bytes or datagrams that are garbled.
    Noise(f64),
    /// The percentage of bytes or datagrams that are lost.
    Loss(f64),
    /// The delay of everything that the station sends.
    Delay(TimeSpan),
    /// The station is off, loses its state, and restarts.
    StationOff,
    /// The program hangs, as on a computer that sleeps or swaps.
    Hang,
    /// The guardian hangs.
    GuardianHang,
    /// The disk is full in the middle of a write, or does not confirm what was written.
    DiskFails,
    /// The time that each commit takes.
    DiskSlow(TimeSpan),
    /// The computer's calendar jumps.
    Calendar(TimeSpan),
}

/// A failure and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Planned {
    pub(super) trouble: Trouble,
    /// Counted from the beginning of the life.
    pub(super) spell: Spell,
}

/// One life.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlannedLife {
    pub(super) lasts: TimeSpan,
    pub(super) ends: Option<(u64, Death)>,
    /// Whether the step at which it ends is counted from its orderly end.
    pub(super) ends_in_farewell: bool,
    pub(super) troubles: Vec<Planned>,
    pub(super) if_unkept: IfUnkept,
}

/// Everything that a seed draws before the world begins.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub(super) station: StationKind,
    pub(super) lives: Vec<PlannedLife>,
}

impl Plan {
    pub(super) fn draw(seed: u64, choice: &mut Choice) -> Self {
        let stations = if seed < FOUR_STATIONS_UNTIL { &STATIONS[..4] } else { &STATIONS };
        let station = choice.of(stations).copied().unwrap_or_default();
        let count = 1 + below(choice, MOST_LIVES);
        let mut lives: Vec<_> = (1..=count).map(|nth| PlannedLife::draw(choice, nth == count)).collect();
        if seed >= NO_GUARDIAN_HANGS_UNTIL {
            lives.iter_mut().for_each(|life| life.draw_guardian(choice));
        }
        Self { station, lives }
    }

    /// All troubles in words, by their numbers from 1 on; the death at the end of a life is its last one.
    pub(super) fn troubles(&self) -> Vec<String> {
        let of_life = |(nth, life): (usize, &PlannedLife)| {
            let mut troubles: Vec<String> = life.troubles.iter().map(|one| one.in_words(nth)).collect();
            let of = if life.ends_in_farewell { " of its farewell" } else { "" };
            troubles.extend(
                life.ends.map(|(step, death)| format!("life {nth} ends at step {step}{of}: {death:?}")),
            );
            troubles
        };
        (1..).zip(&self.lives).flat_map(of_life).collect()
    }

    /// Leaves out, or shortens, what is not selected.
    pub(super) fn select(&mut self, selection: &Selection) {
        let mut number = 0;
        let mut part = || {
            number += 1;
            selection.part(number)
        };
        for life in &mut self.lives {
            let kept = life.troubles.iter().filter_map(|one| part().map(|part| one.shortened(part)));
            life.troubles = kept.collect();
            life.ends = life.ends.filter(|_| part().is_some());
        }
    }
}

impl PlannedLife {
    fn draw(choice: &mut Choice, is_last: bool) -> Self {
        let lasts_s = choice.between(LASTS_S[0], LASTS_S[1]);
        let count = below(choice, MOST_TROUBLES + 1);
        let troubles = (0..count).map(|_| Planned::draw(choice, lasts_s)).collect();
        let dies_at = choice.between(1.0, STEPS_PER_S * lasts_s) as u64;
        let death = match below(choice, 5) {
            0 | 1 => Death::Killed,
            2 => Death::Hangs,
            3 => Death::GuardianKilled,
            _ => Death::PowerCut(TimeSpan::from_s(choice.between(0.5, 20.0))),
        };
        let ends = (!is_last).then_some((dies_at, death));
        let if_unkept = if below(choice, 2) == 0 { IfUnkept::Stop } else { IfUnkept::GoOn };
        let lasts_s = if is_last { lasts_s + LAST_LIFE_S } else { lasts_s };
        Self { lasts: TimeSpan::from_s(lasts_s), ends, ends_in_farewell: false, troubles, if_unkept }
    }
}

impl PlannedLife {
    /// Half of the time it is the guardian that hangs, a guardian that is killed hangs, and a process fails while the last life ends.
    fn draw_guardian(&mut self, choice: &mut Choice) {
        for Planned { trouble, spell } in &mut self.troubles {
            if *trouble == Trouble::Hang && below(choice, 2) == 0 {
                let lasts = TimeSpan::from_s(choice.between(GUARDIAN_HANGS_S[0], GUARDIAN_HANGS_S[1]));
                (*trouble, spell.until) = (Trouble::GuardianHang, spell.from + lasts);
            }
        }
        if let Some((_, death @ Death::GuardianKilled)) = &mut self.ends
            && below(choice, 2) == 0
        {
            *death = Death::GuardianHangs;
        }
        if self.ends.is_none() && below(choice, 2) == 0 {
            let deaths = [Death::Killed, Death::Hangs, Death::GuardianKilled, Death::GuardianHangs];
            let death = choice.of(&deaths).copied();
            self.ends = death.map(|death| (1 + below(choice, FAREWELL_STEPS) as u64, death));
            self.ends_in_farewell = true;
        }
    }
}

impl Planned {
    fn lasts(&self) -> TimeSpan {
        self.spell.until - self.spell.from
    }

    fn in_words(&self, life: usize) -> String {
        let (from, lasts) = (self.spell.from.as_s(), self.lasts().as_s());
        format!("life {life}, from {from:.1} s for {lasts:.2} s: {:?}", self.trouble)
    }

    fn shortened(&self, part: f64) -> Self {
        let until = self.spell.from + TimeSpan::from_s(part * self.lasts().as_s());
        // Not through seconds, whose last digit differs: the whole of it is as it was planned.
        let until = if part < 1.0 { until } else { self.spell.until };
        Self { spell: Spell { until, ..self.spell }, ..*self }
    }

    fn draw(choice: &mut Choice, lasts_s: f64) -> Self {
        let from_s = choice.between(0.0, TROUBLES_WITHIN * lasts_s);
        let (trouble, for_s) = match below(choice, 10) {
            0 | 1 => (Trouble::Cut, choice.between(0.05, 9.0)),
            2 => (Trouble::Noise(choice.between(0.1, 5.0)), choice.between(0.5, 15.0)),
            3 => (Trouble::Loss(choice.between(0.1, 5.0)), choice.between(0.5, 15.0)),
            4 => (Trouble::Delay(ms(choice, 5.0, 300.0)), choice.between(0.5, 15.0)),
            5 => (Trouble::StationOff, choice.between(0.2, 6.0)),
            6 => (Trouble::Hang, choice.between(0.01, 0.7)),
            7 => (Trouble::DiskFails, choice.between(0.2, 20.0)),
            8 => (Trouble::DiskSlow(ms(choice, 20.0, 3_000.0)), choice.between(1.0, 30.0)),
            // Up to a day forward or back.
            _ => (Trouble::Calendar(TimeSpan::from_s(choice.between(-86_400.0, 86_400.0))), lasts_s),
        };
        let from = Timestamp::from_s(from_s);
        Self { trouble, spell: Spell { from, until: from + TimeSpan::from_s(for_s) } }
    }
}

fn ms(choice: &mut Choice, from: f64, to: f64) -> TimeSpan {
    TimeSpan::from_s(1e-3 * choice.between(from, to))
}

fn below(choice: &mut Choice, count: usize) -> usize {
    (choice.between(0.0, count as f64) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// The plan of the first seed that draws three lives, a death at the end of each of the first two.
    fn plan() -> Plan {
        let plans = (1..).map(|seed| Plan::draw(seed, &mut Choice::new(seed)));
        plans.filter(|plan| plan.lives.len() == MOST_LIVES).find(|plan| plan.troubles().len() > 5).unwrap()
    }

    #[test]
    fn a_plan_with_all_of_its_troubles_is_as_it_was() {
        let whole = plan();
        let mut selected = whole.clone();
        selected.select(&Selection::all(whole.troubles().len()));
        assert_eq!(selected, whole);
    }

    #[test]
    fn later_seeds_draw_all_six_stations_and_earlier_ones_the_four_of_their_stories() {
        let drawn = |first: u64| {
            let seeds = first..first + 100;
            let kinds: BTreeSet<_> =
                seeds.map(|seed| Plan::draw(seed, &mut Choice::new(seed)).station.key()).collect();
            kinds.into_iter().collect::<Vec<_>>()
        };
        assert_eq!(drawn(FOUR_STATIONS_UNTIL - 100), ["dcc-ex", "marklin", "marklin-can", "z21"]);
        let all = ["dcc-ex", "jmri", "loconet", "marklin", "marklin-can", "z21"];
        assert_eq!(drawn(FOUR_STATIONS_UNTIL), all);
    }

    #[test]
    fn what_is_not_selected_does_not_happen() {
        let whole = plan();
        let mut none = whole.clone();
        none.select(&"none".parse().unwrap());
        assert!(none.troubles().is_empty());
        assert_eq!(none.lives.len(), MOST_LIVES);
        // The last death alone.
        let mut one = whole.clone();
        let numbers = (1..).zip(whole.troubles());
        let (number, words) = numbers.filter(|(_, words)| words.starts_with("life 2 ends")).last().unwrap();
        one.select(&number.to_string().parse().unwrap());
        assert_eq!(one.troubles(), [words]);
    }
}
