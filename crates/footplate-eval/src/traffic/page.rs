//! The table of how trains fare in traffic: for people, for the documentation, and for machines.

use std::io::{self, Write};

use footplate_sim::IncidentKind;
use serde_json::{Value, json};

use super::session::Tally;
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# How several trains fare on one layout

Random simulated trains, each calibrated from nothing while the others were lifted. Each is sent to one random place after the
other: a sensor and an offset past it, from whichever side. The dispatcher and its watchdog drive them, as in `drive`. Sensors
miss trains, stick and report without a train, and turnouts fail, at the rates of a well-kept laboratory. Only these figures
use the simulator's truth.
";

const LEGEND: &str = "\
*Waited* is the mean time from the order until the route was reserved, *took* until arrival. *Nowhere* is the longest time that
a train came to no destination. *Runs*: of these, one in a thousand may end beyond its reservation. *Intrusions*: times that any
part of a train was on track that it had not reserved. *Mistaken*: of all rests past a sensor, those more than four standard
deviations from the estimate. *Alarms*: times that the watchdog stopped a train to locate it again. *Person*: times that it
needed a person to read off where the train was. *No route*: destinations too near to the end of a track, for which another was
drawn. *By blocks*: the same trains, orders and stops, but the track between sensors is reserved as a whole, with all its
turnouts, as block systems do.
";

/// No train should come to no destination for longer than this (s).
pub const LONGEST_NOWHERE_S: f64 = 900.0;

/// All that was scored.
pub struct Page<'r> {
    /// What every seed came to.
    pub tallies: &'r [Tally],
    /// The same seeds with whole blocks reserved, if that was asked for.
    pub by_blocks: &'r [Tally],
    /// What was asked for, as on the command line.
    pub asked: String,
}

impl WrittenScores for Page<'_> {
    const SCORER: &'static str = "traffic";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate traffic {}`.\n\n{LEGEND}", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| seed | hours | arrivals | per hour and train | waited s | took s | nowhere s | runs | stepped aside | \
             collisions | derailments | overruns | intrusions | mistaken | wrong legs | alarms | person | no route |\n\
             | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | \
             ---: | ---: | ---: |"
        )?;
        for tally in self.tallies {
            row(output, &tally.seed.to_string(), &[tally])?;
        }
        if self.tallies.len() > 1 {
            row(output, "all", &self.tallies.iter().collect::<Vec<_>>())?;
        }
        if self.by_blocks.is_empty() {
            return Ok(());
        }
        row(output, "all, by blocks", &self.by_blocks.iter().collect::<Vec<_>>())
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{}", json!({ "seeds": seeds(self.tallies), "by_blocks": seeds(self.by_blocks) }))
    }

    fn rates(&self) -> Vec<Rate> {
        let incidents = self.tallies.iter().filter(|tally| !tally.incidents.is_empty()).count();
        let sum = |of: fn(&Tally) -> usize| self.tallies.iter().map(of).sum::<usize>();
        let runs = sum(|tally| tally.routes as usize + tally.turns);
        let stuck = self.tallies.iter().filter(|tally| tally.starved > LONGEST_NOWHERE_S).count();
        vec![
            Rate::grief(incidents, self.tallies.len()),
            Rate::new("runs onto track of others", sum(|tally| tally.intrusions.len()), runs),
            Rate::new("sessions with a train nowhere for more than 900 s", stuck, self.tallies.len()),
            Rate::new("trains that needed a person", sum(|tally| tally.hands as usize), runs),
        ]
    }
}

/// What is to be said of each seed.
fn seeds(tallies: &[Tally]) -> Value {
    let one = |tally: &Tally| {
        json!({
                "seed": tally.seed, "hours": tally.hours, "trains": tally.trains, "arrivals": tally.arrivals,
                "waited_s": tally.waits, "took_s": tally.took, "nowhere_s": tally.starved,
                "errors_mm": tally.errors, "routes": tally.routes, "turns": tally.turns, "aside": tally.aside,
                "deadlocks": tally.deadlocks, "diverged": tally.diverged, "lost": tally.lost, "alarms": tally.dangers,
                "hands": tally.hands, "rests": tally.rests, "mistaken": tally.mistaken, "refused": tally.refused, "withdrawn": tally.withdrawn,
                "intrusions": tally.intrusions.iter().map(|(at, train)| json!([at.as_s(), train.0]))
                    .collect::<Vec<Value>>(),
                "incidents": tally.incidents.iter().map(|incident| format!("{incident:?}")).collect::<Vec<_>>(),
        })
    };
    tallies.iter().map(one).collect()
}

fn row(output: &mut dyn Write, name: &str, tallies: &[&Tally]) -> io::Result<()> {
    let sum = |of: fn(&Tally) -> usize| tallies.iter().map(|tally| of(tally)).sum::<usize>();
    let train_hours: f64 = tallies.iter().map(|tally| tally.hours * tally.trains as f64).sum();
    let arrivals = sum(|tally| tally.arrivals as usize);
    let longest = tallies.iter().map(|tally| tally.starved).fold(0.0, f64::max);
    let mean = |of: fn(&Tally) -> &Vec<f64>| {
        let all = || tallies.iter().flat_map(|tally| of(tally));
        all().sum::<f64>() / all().count().max(1) as f64
    };
    writeln!(
        output,
        "| {name} | {:.1} | {arrivals} | {:.1} | {:.1} | {:.1} | {longest:.0} | {} | {} | {} | {} | {} | {} | \
         {} of {} | {} | {} | {} | {} |",
        tallies.iter().map(|tally| tally.hours).sum::<f64>(),
        arrivals as f64 / train_hours.max(1e-9),
        mean(|tally| &tally.waits),
        mean(|tally| &tally.took),
        sum(|tally| tally.routes as usize + tally.turns),
        sum(|tally| tally.aside as usize),
        sum(|tally| incidents(tally, |kind| matches!(kind, IncidentKind::Collision { .. })) / 2),
        sum(|tally| incidents(tally, |kind| matches!(kind, IncidentKind::Derailment { .. }))),
        sum(|tally| incidents(tally, |kind| matches!(kind, IncidentKind::Overrun))),
        sum(|tally| tally.intrusions.len()),
        sum(|tally| tally.mistaken as usize),
        sum(|tally| tally.rests as usize),
        sum(|tally| tally.diverged as usize),
        sum(|tally| tally.dangers as usize),
        sum(|tally| tally.hands as usize),
        sum(|tally| tally.refused.values().sum::<u32>() as usize),
    )
}

/// The number of incidents of a kind; every collision has two entries.
fn incidents(tally: &Tally, is: fn(IncidentKind) -> bool) -> usize {
    tally.incidents.iter().filter(|incident| is(incident.kind)).count()
}
