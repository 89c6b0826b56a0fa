//! What a replay says.

use std::collections::BTreeMap;
use std::io::{self, Write};

use footplate_core::TimeSpan;
use footplate_store::{StoredMachine, StoredRecording};
use serde_json::{Value, json};

use crate::clock::{local, rfc3339};
use crate::counted::counted;
use crate::recorded::{Difference, Ending, Replay};

/// How it is said.
#[derive(Debug, Clone, Copy)]
pub(super) struct Page {
    pub(super) is_json: bool,
    /// All that differs.
    pub(super) is_diff: bool,
}

impl Page {
    /// The sessions that can be replayed.
    pub(super) fn list(
        self,
        machines: &[StoredMachine],
        recordings: &[StoredRecording],
        output: &mut dyn Write,
    ) -> io::Result<()> {
        for machine in machines {
            let recording = recordings.iter().find(|recording| recording.key == machine.recording);
            let (name, layout) = recording
                .map_or(("?", "?"), |recording| (recording.name.as_str(), recording.layout.as_str()));
            if self.is_json {
                let line = json!({
                    "session": machine.recording.0,
                    "name": name,
                    "layout": layout,
                    "machine": machine.kind,
                    "program": machine.program,
                    "began_at": rfc3339(machine.stored_at),
                    "inputs": machine.inputs,
                    "decisions": machine.decisions,
                });
                writeln!(output, "{line}")?;
            } else {
                writeln!(
                    output,
                    "{:>5}  {}  {name} on {layout}, {} and {}, version {}",
                    machine.recording.0,
                    local(machine.stored_at),
                    counted(machine.inputs, "input"),
                    counted(machine.decisions, "decision"),
                    machine.program
                )?;
            }
        }
        if machines.is_empty() && !self.is_json {
            writeln!(output, "no session in this store can be replayed")?;
        }
        Ok(())
    }

    /// What came of one machine.
    pub(super) fn write(
        self,
        machine: &StoredMachine,
        replay: &Replay,
        output: &mut dyn Write,
    ) -> io::Result<()> {
        let differences = &replay.differences;
        if self.is_json {
            let line = json!({
                "session": machine.recording.0,
                "machine": machine.kind,
                "recorded_by": machine.program,
                "inputs": replay.inputs,
                "decisions": replay.decisions,
                "same": differences.is_empty(),
                "ending": word(&replay.ending),
                "until_s": replay.at.as_s(),
                "differences": differences.iter().map(value).collect::<Vec<_>>(),
            });
            return writeln!(output, "{line}");
        }
        let of = format!(
            "session {} ({}, recorded by version {})",
            machine.recording, machine.kind, machine.program
        );
        let decisions = counted(replay.decisions, "decision");
        match differences.first() {
            None => writeln!(output, "{of}: {decisions}, all the same")?,
            Some(first) if !self.is_diff => {
                writeln!(output, "{of}: {decisions}, the last of them not the same")?;
                writeln!(output, "  {}, after {}", sentence(first), first.after)?;
                writeln!(output, "  --diff shows all that differs")?;
            }
            Some(_) => {
                for difference in differences {
                    writeln!(output, "{}", sentence(difference))?;
                }
                writeln!(output, "{of}: {decisions}, {}", tally(differences))?;
            }
        }
        if let Some(remark) = remark(replay) {
            writeln!(output, "  {remark}")?;
        }
        Ok(())
    }
}

/// How many of each kind differ.
fn tally(differences: &[Difference]) -> String {
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    differences.iter().for_each(|difference| *kinds.entry(&difference.kind).or_default() += 1);
    let each: Vec<String> = kinds.into_iter().map(|(kind, count)| counted(count, kind)).collect();
    format!("other now: {}", each.join(", "))
}

fn sentence(difference: &Difference) -> String {
    let at = format!("{:12.6} s  {:<9}", difference.time.as_s(), difference.kind);
    match (&difference.then, &difference.now, difference.later_by) {
        (Some(then), _, Some(by)) if by < TimeSpan::ZERO => {
            format!("{at} {then}: now {} ns earlier", by.abs().as_ns())
        }
        (Some(then), _, Some(by)) => format!("{at} {then}: now {} ns later", by.as_ns()),
        (Some(then), Some(now), None) => format!("{at} then: {then}; now: {now}"),
        (Some(then), None, None) => format!("{at} then: {then}; now: nothing"),
        (None, Some(now), _) => format!("{at} then: nothing; now: {now}"),
        (None, None, _) => at,
    }
}

fn value(difference: &Difference) -> Value {
    json!({
        "time_ns": difference.time.as_ns(),
        "kind": difference.kind,
        "then": difference.then,
        "now": difference.now,
        "later_by_ns": difference.later_by.map(TimeSpan::as_ns),
        "after": difference.after,
    })
}

const fn word(ending: &Ending) -> &'static str {
    match ending {
        Ending::Whole => "whole",
        Ending::Asked => "asked",
        Ending::Differs => "differs",
        Ending::CutOff => "cut-off",
        Ending::Gap { .. } => "gap",
        Ending::Unreadable { .. } => "unreadable",
    }
}

/// Why it did not go to the end of the session.
fn remark(replay: &Replay) -> Option<String> {
    let at = replay.at.as_s();
    match &replay.ending {
        Ending::Whole | Ending::Differs => None,
        Ending::Asked => Some(format!("until {at:.3} s, as asked")),
        Ending::CutOff => Some(format!(
            "the recording ends at {at:.3} s, and the session did not: it was killed, or the power went"
        )),
        Ending::Gap { number } => Some(format!(
            "not replayed beyond {at:.3} s: rows are missing from number {number} on, which came faster than the disk \
             took them or are lost with a damaged page"
        )),
        Ending::Unreadable { number, why } => {
            Some(format!("not replayed beyond {at:.3} s: row {number} is {why}"))
        }
    }
}
