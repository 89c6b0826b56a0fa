//! `footplate doctor`: whether the line to a station is in order, and how fast it is.

mod answers;
mod board_figures;
mod can_figures;
mod figures;
mod jmri_figures;
mod loconet_figures;
mod z21_figures;

use std::any::Any;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use footplate_core::control::{Machine, Output};
use footplate_core::link::RoundTrips;
use footplate_core::{Command, Event, TimeSpan, Timestamp};
use footplate_store::layout_named;
use footplate_wire::marklin_serial::{Interface, ModuleReads};
use footplate_wire::{CommandError, LinkNotice, loconet, z21};

use self::figures::{Figures, StationFigures};
use super::Outcome;
use super::plot::PictureFile;
use crate::clock::now;
use crate::link::{Address, Link, MeasuredLine, Passed, Speed, TappedLink, open, open_session};
use crate::runtime::{Attendant, Ended, Runtime, StopFlag, Wish};
use crate::standard_error::say;

/// A command now and then, to see what one costs; as rare as commands are when trains are driven.
const COMMAND_EVERY: TimeSpan = TimeSpan::from_ms(500);
/// The shortest and the longest time of listening (s): a poll or two, and a day.
const SECONDS: [f64; 2] = [1.0, 1e5];
/// More lost replies than this and the line needs a look.
const LOST_SHARE: f64 = 0.01;

/// Whether the line is in order, by the share of what was lost.
fn outcome(lost_share: f64) -> Outcome {
    if lost_share > LOST_SHARE { Outcome::FallsShort } else { Outcome::Done }
}

/// Listen to a line: how often sensors are read, and what is lost.
///
/// No train is moved. Power is put on the track; trains that stand stay, and at the end the power is taken off.
/// The exit status is 1 when more than one reply in a hundred was lost, or the line itself.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate doctor --link marklin-serial:/dev/ttyUSB0
  footplate doctor --link dcc-ex:tcp://192.168.4.1:2560
  footplate doctor --link z21:192.168.0.111
  footplate doctor --link marklin-can:192.168.0.5
  footplate doctor --link loconet:192.168.0.20
  footplate doctor --link jmri:192.168.0.20")]
pub(crate) struct Arguments {
    /// The station: sim:track-a, marklin-serial:/dev/ttyUSB0, dcc-ex:/dev/ttyACM0, z21:192.168.0.111,
    /// marklin-can:192.168.0.5, loconet:192.168.0.20, jmri:192.168.0.20, or tcp://host:port in place of a device.
    #[arg(long)]
    link: Address,
    /// The layout, whose sensors show how many feedback modules there are; a simulated link names its own.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// For how long to listen, in seconds of the station's time.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Keep what was measured of the line beside this store, so that `calibrate` and `drive` with the same --store count with it.
    /// Not for a 6050 or 6051, whose line is as fast on every railway.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Draw how latencies are spread to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE")]
    plot: Option<PictureFile>,
    /// Say it as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        if !(SECONDS[0]..=SECONDS[1]).contains(&self.seconds) {
            bail!(
                "--seconds {}: use a time from {} to {} s, such as 10",
                self.seconds,
                SECONDS[0],
                SECONDS[1]
            );
        }
        let layout = self.link.simulated().map_or(&self.layout, |simulated| &simulated.layout);
        let layout = layout_named(layout)?.layout;
        let link = open(&self.link, &layout, Speed::Unpaced)?;
        let session = open_session(&self.link, &link, &layout)?;
        let mut patient = Patient { next: link.now() + COMMAND_EVERY, due: false };
        let mut ear = Ear {
            until: link.now() + TimeSpan::from_s(self.seconds),
            noticed: BTreeMap::new(),
            lost: 0,
            noise: None,
        };
        let mut runtime = Runtime::new(TappedLink::new(link), session, None, Some(StopFlag::install()));
        let ended = runtime.run(&mut patient, &mut ear)?;
        runtime.close();
        match ended {
            Ended::Finished | Ended::Interrupted => {}
            Ended::LineLost(lost) => {
                writeln!(output, "line          lost: {lost}")?;
                return Ok(Outcome::FallsShort);
            }
            Ended::NoAnswer(_) => return Err(anyhow!("{ended}")),
        }
        let heard =
            Heard { passed: runtime.link().passed(), ear: &ear, has_cts: runtime.link().cts().is_some() };
        let session: &dyn Any = runtime.session();
        let passed = heard.passed;
        let figures = if let Some(interface) = session.downcast_ref() {
            return self.report_interface(interface, &heard, output).map(outcome);
        } else if let Some(session) = session.downcast_ref::<z21::Client>() {
            z21_figures::figures_of(passed, session.settings())
        } else if let Some(session) = session.downcast_ref() {
            can_figures::figures_of(passed, session)
        } else if let Some(session) = session.downcast_ref::<loconet::Client>() {
            loconet_figures::figures_of(passed, session.settings())
        } else if let Some(session) = session.downcast_ref() {
            jmri_figures::figures_of(passed, session)
        } else {
            board_figures::figures_of(passed)
        };
        self.report(figures, &heard, output).map(outcome)
    }

    /// Reports on a 6051; returns the share of replies that were lost.
    fn report_interface(
        &self,
        interface: &Interface,
        heard: &Heard<'_>,
        output: &mut dyn Write,
    ) -> anyhow::Result<f64> {
        let (reads, lateness) = (interface.module_reads(), interface.reply_lateness());
        let figures = Figures::of(heard.passed, heard.ear.lost);
        if !figures.has_replies() {
            let noise = heard.ear.noise.as_ref().map_or_else(String::new, |noise| format!(" ({noise})"));
            bail!(
                "no reply to any poll was read{noise}: check that the port belongs to a 6050 or 6051, its speed (2400 baud) and that \
                 no other program writes to it"
            );
        }
        if let Some(plot) = &self.plot {
            plot.write(&figures.picture())?;
        }
        if self.json {
            let mut json = figures.json();
            json["answers_single_modules"] = reads.map(|reads| reads == ModuleReads::Single).into();
            json["reply_lateness_ms"] = lateness.map(TimeSpan::as_ms).into();
            writeln!(output, "{json}")?;
        } else {
            let hand_shake = if heard.has_cts { "CTS" } else { "by the clock" };
            writeln!(
                output,
                "line          {} sensor modules, hand-shake {hand_shake}",
                interface.modules()
            )?;
            match reads {
                Some(reads) => writeln!(output, "interface     {reads}")?,
                None => {
                    writeln!(output, "interface     not seen long enough to know which reads it answers")?;
                }
            }
            if let Some(lateness) = lateness {
                let ms = lateness.as_ms();
                writeln!(output, "replies       come up to {ms:.0} ms later than their bytes take")?;
            }
            figures.write(output)?;
            heard.ear.write(output)?;
        }
        Ok(figures.lost_share())
    }

    /// Reports on a station that reports by itself; returns the share of requests that were not answered.
    fn report(
        &self,
        figures: StationFigures,
        heard: &Heard<'_>,
        output: &mut dyn Write,
    ) -> anyhow::Result<f64> {
        // Noise is the best explanation of a station that was not found.
        if let Some(missing) = figures.missing {
            bail!(heard.ear.noise.clone().unwrap_or_else(|| missing.to_owned()));
        }
        let StationFigures { answers, mut json, station, reports, .. } = figures;
        let line = answers.round_trips();
        if let Some(plot) = &self.plot {
            plot.write(&answers.picture())?;
        }
        if self.json {
            answers.add_to(&mut json);
            writeln!(output, "{json}")?;
        } else {
            station.iter().try_for_each(|line| writeln!(output, "{line}"))?;
            answers.write(output)?;
            reports.iter().try_for_each(|line| writeln!(output, "{line}"))?;
            self.advise(line.as_ref(), output)?;
            heard.ear.write(output)?;
        }
        if let Some(store) = &self.store {
            let Some(round_trips) = line else {
                bail!("too few answers to measure the line: listen longer, such as --seconds 60");
            };
            let line = MeasuredLine {
                measured_at_s: (now() - Timestamp::ZERO).as_ns() / 1_000_000_000,
                round_trips,
            };
            let file = line.keep(&self.link, store)?;
            say!("kept in {}; `calibrate` and `drive` with this --store count with it", file.display());
        }
        Ok(answers.lost_share())
    }

    /// Prints how the line changes the time model.
    fn advise(&self, line: Option<&RoundTrips>, output: &mut dyn Write) -> anyhow::Result<()> {
        let Some((line, usual)) = line.zip(self.link.kind().usual_line()) else { return Ok(()) };
        let (excess, repeats) = (line.excess(usual), line.repeats());
        let within = usual.answers_within.as_ms();
        if excess == TimeSpan::ZERO && repeats == 0 {
            writeln!(output, "line          as fast as usual: 99 of 100 answers within {within:.0} ms")?;
            return Ok(());
        }
        writeln!(
            output,
            "line          {:.0} ms slower than usual ({within:.0} ms), {:.1} % lost: a command may need {repeats} more tries",
            excess.as_ms(),
            100.0 * line.lost_share()
        )?;
        if self.store.is_none() {
            writeln!(
                output,
                "              measure it with --store railway.db, so that trains are driven by it; a cable is better"
            )?;
        }
        Ok(())
    }
}

/// What came of listening.
struct Heard<'h> {
    passed: &'h [Passed],
    ear: &'h Ear,
    has_cts: bool,
}

/// A machine that moves nothing.
struct Patient {
    next: Timestamp,
    due: bool,
}

impl Machine for Patient {
    type Notice = ();

    fn handle_event(&mut self, _: Timestamp, _: &Event) {}

    fn handle_timeout(&mut self, now: Timestamp) {
        self.due = now >= self.next;
        if self.due {
            self.next = now + COMMAND_EVERY;
        }
    }

    fn poll_output(&mut self) -> Option<Output<()>> {
        // The power is on already, so that this changes nothing.
        std::mem::take(&mut self.due).then_some(Output::Command(Command::PowerOn))
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        Some(self.next)
    }
}

/// Hears what the line has to say, until the time is over.
struct Ear {
    until: Timestamp,
    noticed: BTreeMap<String, usize>,
    lost: usize,
    /// The notice about unreadable bytes.
    noise: Option<String>,
}

impl Ear {
    fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        for (notice, count) in &self.noticed {
            writeln!(output, "{count:>4} x        {notice}")?;
        }
        Ok(())
    }
}

impl<M: Machine> Attendant<M> for Ear {
    fn hear(&mut self, _: Timestamp, _: M::Notice) {}

    fn hear_of_line(&mut self, _: Timestamp, notice: &LinkNotice) {
        match notice {
            // The kind of reads has its own line in the report, and finding it out loses some replies.
            LinkNotice::Answers | LinkNotice::Identified(_) => return,
            LinkNotice::LimitedReads { .. } => {
                self.lost = self.lost.saturating_sub(ModuleReads::READS_TRIED);
                return;
            }
            LinkNotice::ReplyLost { .. } => self.lost += 1,
            LinkNotice::Unreadable { .. } | LinkNotice::UnexpectedBytes { .. } => {
                self.noise = Some(notice.to_string());
            }
            _ => {}
        }
        *self.noticed.entry(notice.to_string()).or_default() += 1;
    }

    fn hear_of_refusal(&mut self, _: Timestamp, _: Command, error: CommandError) {
        *self.noticed.entry(error.to_string()).or_default() += 1;
    }

    fn attend(&mut self, now: Timestamp, _: &mut M) -> Wish {
        if now >= self.until { Wish::Finish } else { Wish::GoOn }
    }
}
