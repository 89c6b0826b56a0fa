//! The end of a life: what its disk kept, and how soon its guardian, or the program itself, stopped the trains.

use footplate_core::{TimeSpan, Timestamp};

use super::disk::FaultyDisk;
use super::failure::FailureKind;
use super::life::{Death, Spell, time_outside};
use super::pair::{Guardian, Pair};
use super::story::Teller;

/// Stops are on the line within this time after a death, unless the line is cut (a requirement).
const STOPPED_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
/// From a byte on the line to its effect on a decoder: the refresh of the slowest station, with a margin.
const HEARD_WITHIN: TimeSpan = TimeSpan::from_ms(500);

impl<'l> Teller<'_, 'l> {
    /// The end of a life, in order or not.
    pub(super) fn bury(
        &mut self,
        death: Option<Death>,
        died: Timestamp,
        is_complete: bool,
        pair: &mut Pair<'l>,
        disk: FaultyDisk,
    ) -> anyhow::Result<()> {
        self.fate.deaths += u32::from(death.is_some());
        let kept = match death {
            None | Some(Death::GuardianKilled | Death::GuardianHangs) if is_complete => disk.finish(),
            Some(Death::PowerCut(_)) => disk.lose_power(),
            _ => disk.die(),
        };
        if let Err(error) = kept {
            self.fail(FailureKind::NotKept, format!("{error:#}"));
        }
        if let Some(Death::PowerCut(dark)) = death {
            // No process is left; trains run on.
            let until = self.now() + dark;
            while self.now() < until {
                let _ = self.station.borrow_mut().advance(until);
            }
            return Ok(());
        }
        let (hangs, were_stopped) = (death == Some(Death::Hangs), pair.line.all_stopped());
        self.tell_truth();
        let burial = pair.bury(hangs);
        self.fate.notes.append(&mut pair.line.notes);
        let (stopped_at, cuts) = (pair.line.stopped_at, pair.line.unreachable());
        let allowed = STOPPED_WITHIN + HEARD_WITHIN;
        match (burial, pair.guardian()) {
            (Some(burial), _) => {
                // A program that hung while no train ran was ended by a person.
                let died =
                    pair.hung_since.unwrap_or(if hangs && !burial.was_late { burial.began } else { died });
                let stopped_at = if were_stopped { Some(died) } else { stopped_at };
                let failed = [cuts, pair.without_guardian.clone()].concat();
                self.judge_stop(died, stopped_at, failed, allowed, &format!("said: {}", burial.is_said));
            }
            (None, Guardian::Runs) if pair.line.all_stopped() || pair.line.is_unreachable() => {}
            (None, Guardian::Runs) => {
                self.fail(FailureKind::RanOn, "trains run, and their guardian does nothing".to_owned());
            }
            (None, Guardian::Dead { .. } | Guardian::Hangs { .. })
                if matches!(death, Some(Death::Killed | Death::Hangs)) =>
            {
                self.note("neither the program nor its guardian is left".to_owned());
            }
            (None, Guardian::Dead { .. }) if !is_complete && pair.tried_in_vain() => {
                let words = "the station never confirmed to a program without a guardian that all is stopped";
                self.fail(FailureKind::RanOn, words.to_owned());
            }
            // The program has stopped its trains itself.
            (None, Guardian::Dead { since } | Guardian::Hangs { since, .. }) => {
                let stopped_at = stopped_at.filter(|_| pair.line.all_stopped());
                self.judge_stop(since, stopped_at, cuts, allowed, "its guardian had failed");
            }
        }
        Ok(())
    }

    /// Judges when all trains were stopped after a process died, leaving out the time in which no command could reach the station.
    fn judge_stop(
        &mut self,
        died: Timestamp,
        stopped_at: Option<Timestamp>,
        unreachable: Vec<Spell>,
        allowed: TimeSpan,
        how: &str,
    ) {
        let Some(at) = stopped_at else {
            return self.fail(FailureKind::RanOn, format!("trains were not stopped after a death ({how})"));
        };
        let took = time_outside(died, at, unreachable);
        self.fate.stopped_ms.push(took.as_ms());
        self.note(format!(
            "all trains were stopped {:.0} ms after the death, {:.0} ms of them over a line that was there",
            (at - died).as_ms(),
            took.as_ms()
        ));
        if took > allowed {
            let words = format!("trains were stopped only {:.0} ms after a death ({how})", took.as_ms());
            self.fail(FailureKind::RanOn, words);
        }
    }
}
