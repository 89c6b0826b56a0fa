//! `footplate demo`: two trains that nobody has measured, calibrated and stopped to the millimetre.

mod beginning;
mod calibrating;
mod driving;
mod outcome;
mod railway;
mod screen;
mod stage;
mod targets;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, MotionFile, Store, TrainAtStart};
use serde_json::json;

use super::Outcome;
use super::serve::open_dashboard;
use super::written_layout::WrittenLayout;
use crate::clock::{local, now};
use crate::dashboard::{ServedAt, Showing};
use crate::link::Speed;
use crate::session_journal::{IfUnkept, SessionJournal, WhenFull};
pub(crate) use beginning::TourBeginning;
use driving::Tour;
use railway::{Railway, SharedRecord};
use screen::{Manner, Screen};
use stage::Stage;
use targets::Dice;

/// The trains of the recordings in `testdata`; what they are like is drawn from the seed.
const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(58)];
/// Stops that each of them makes.
const STOPS: usize = 5;
/// Times real time where somebody watches: fast enough to end within a minute, slow enough to follow.
const WATCHED_SPEED: f64 = 25.0;

/// Watch two unknown trains being calibrated and driven to exact stops, on a simulated layout.
///
/// The program knows the layout and nothing of the trains. It finds each of them over the bytes of a simulated Märklin
/// 6051, learns within five minutes of track time how it moves, and then stops it at places drawn from the seed. The
/// table at the end has the truth of the simulator, which nothing else has seen, beside what was promised.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate demo
  footplate demo --seed 7 --speed 100
  footplate demo --json --store railway.db")]
pub(crate) struct Arguments {
    /// Which railway: other rails, other trains, other stops.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Times real time; 25 where a terminal shows what happens, and as fast as it goes otherwise.
    #[arg(long, value_name = "TIMES", value_parser = speed)]
    speed: Option<f64>,
    /// Write the session down in this store, as a real one would be.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Show it live in a browser: at a port of this machine (8417 unless named, 0 for any that is free), or at an address.
    /// At a terminal it is shown anyway.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    serve: Option<ServedAt>,
    /// Write a line of JSON for whatever is learnt, stopped and kept.
    #[arg(long)]
    json: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse::<f64>().ok().filter(|speed| speed.is_finite() && *speed >= 0.1);
    speed.ok_or_else(|| "write how many times faster than real, such as 10".to_owned())
}

impl Default for Arguments {
    /// What somebody sees who says nothing at all.
    fn default() -> Self {
        Self { seed: 1, speed: None, store: None, serve: None, json: false }
    }
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let on = WrittenLayout::named("track-a")?;
        let layout = &on.layout;
        let screen = Screen::new(output, if self.json { Manner::Json } else { Manner::Text });
        let is_watched = screen.is_watched();
        let dashboard = match &self.serve {
            Some(at) => Some(open_dashboard(at, &on, self.store.clone())?),
            // Somebody else may sit at the usual port.
            None if is_watched => open_dashboard(&ServedAt::USUAL, &on, self.store.clone())
                .or_else(|_| open_dashboard(&ServedAt::ANY, &on, self.store.clone()))
                .ok(),
            None => None,
        };
        let watched = (is_watched || dashboard.is_some()).then_some(WATCHED_SPEED);
        let speed = self.speed.or(watched).map_or(Speed::Unpaced, Speed::Times);
        let record = SharedRecord::default();
        let mut recorder = record.clone();
        let railway = Railway::new(layout, self.seed, &TRAINS, speed, &mut recorder)?;
        record.0.borrow_mut().journal = self.journal(layout, railway.now())?;
        let showing = dashboard.as_ref().map(|dashboard| Showing::new(dashboard, layout, railway.now()));
        let mut stage = Stage::new(railway, screen, speed, record, &TRAINS);
        stage.showing = showing;
        self.greet(&mut stage)?;
        let mut dice = Dice::new(self.seed);
        let mut turnouts = TurnoutStates::unknown();
        for train in TRAINS {
            turnouts = turn(&mut stage, &on, train, &turnouts, &mut dice)?;
        }
        stage.end()?;
        self.conclude(&mut stage)
    }

    fn journal(&self, layout: &Layout, at: Timestamp) -> anyhow::Result<Option<SessionJournal>> {
        let Some(path) = &self.store else { return Ok(None) };
        let now = now();
        // The railway's clock stands at `at`.
        let began_at = now + (Timestamp::ZERO - at);
        let name = format!("demo {}", local(now));
        let store = Store::open_or_create(path)?;
        let first = TrainAtStart { train: TRAINS[0], step: SpeedStep::STAND };
        let journal = Journal::begin(store, &name, layout.name(), Some(began_at), &[first], now)?;
        Ok(Some(SessionJournal::start(journal, Some(began_at), WhenFull::Wait, IfUnkept::Stop)?))
    }

    fn greet(&self, stage: &mut Stage<'_, '_, '_>) -> std::io::Result<()> {
        let [first, second] = TRAINS;
        stage.screen.announce(&format!(
            "Footplate calibrates and drives trains {first} and {second}, which it has never seen, on \
             track A"
        ))?;
        stage
            .screen
            .mention(&format!("through a simulated Märklin 6051, byte by byte; seed {}", self.seed))?;
        stage.screen.say("")
    }

    fn conclude(&self, stage: &mut Stage<'_, '_, '_>) -> anyhow::Result<Outcome> {
        let wall = stage.wall().as_secs_f64();
        let track = stage.now().as_s();
        let made = stage.stops.len();
        let inside = stage.stops.iter().filter(|stop| stop.is_inside()).count();
        stage.screen.record(&json!({ "result": {
            "seed": self.seed,
            "learnt": stage.learnt.iter().map(outcome::Learnt::value).collect::<Vec<_>>(),
            "stops": stage.stops.iter().map(outcome::MadeStop::value).collect::<Vec<_>>(),
            "inside": inside,
            "track_time_s": track,
            "wall_time_s": wall,
        }}))?;
        if let Some(summary) = outcome::summary(&stage.stops) {
            stage.screen.say("")?;
            let stops = std::mem::take(&mut stage.stops);
            stage.screen.table(&stops)?;
            stage.screen.say("")?;
            stage.screen.announce(&summary)?;
        }
        stage.screen.mention(&format!(
            "Errors are measured against the simulator's truth, hidden from everything else. {} of \
             track time took {wall:.0} s.",
            outcome::minutes(stage.now() - Timestamp::ZERO)
        ))?;
        stage.screen.mention(
            "For another railway: footplate demo --seed 2. For all commands: footplate \
                              --help.",
        )?;
        let done = made == STOPS * TRAINS.len() && !stage.is_broken();
        Ok(if done { Outcome::Done } else { Outcome::FallsShort })
    }
}

/// One train's turn: it is put on the rails, learns, makes its stops, and makes room for the next. All circuits of track A
/// share rails, so the others are off them meanwhile.
fn turn(
    stage: &mut Stage<'_, '_, '_>,
    on: &WrittenLayout,
    train: TrainId,
    turnouts: &TurnoutStates,
    dice: &mut Dice,
) -> anyhow::Result<TurnoutStates> {
    if train != TRAINS[0] {
        stage.begin_run(train);
    }
    stage.railway.put_down(train)?;
    let known = calibrating::calibrate(stage, on, train, turnouts)?;
    if let Some(known) = &known {
        stage.models.push(MotionFile::of(&on.layout, known.fit.model(), Some(now())));
        Tour::new(stage, on, train, known)?.run(stage, known, STOPS, dice)?;
    }
    stage.railway.lift(train);
    stage.rests(train, "is done");
    Ok(known.map_or_else(TurnoutStates::unknown, |known| known.turnouts))
}
