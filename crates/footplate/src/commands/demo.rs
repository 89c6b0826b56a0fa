//! `footplate demo`: calibrates two unknown trains of a simulated layout and stops them at given places.

mod calibrating;
mod driving;
mod outcome;
mod railway;
mod running_demo;
mod screen;
mod targets;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{SpeedStep, Timestamp, TrainId};
use footplate_eval::seeds::Choice;
use footplate_store::{Journal, MotionFile, Store, TrainAtStart};
use serde_json::json;

use super::Outcome;
use super::calibrate::minutes;
use super::dashboard_routes::{SetUpRoute, open_dashboard};
use super::written_layout::WrittenLayout;
use crate::clock::{local, now};
use crate::dashboard::{ReadOnlyDashboard, ServedAt};
use crate::link::Speed;
use crate::session_journal::{IfUnkept, SessionJournal, WhenFull};
use driving::Tour;
pub(crate) use driving::TourBeginning;
use railway::{Railway, SharedRecord};
use running_demo::Demo;
use screen::{Manner, Screen};

/// The trains of the recordings in `testdata`; the seed determines their properties.
const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(58)];
/// Stops per train.
const STOPS: usize = 5;
/// Simulated time over real time if an operator watches: it ends within a minute and can still be followed.
const WATCHED_SPEED: f64 = 25.0;

/// Calibrate two unknown trains of a simulated layout and stop them at exact places.
///
/// The program knows the layout but not the trains. Through the bytes of a simulated Märklin 6051 it locates each
/// train, calibrates it within five minutes of simulated time, and then stops it at places drawn from the seed. The
/// table at the end compares each predicted interval with the true place of rest, which only the simulator knows.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate demo
  footplate demo --seed 7 --speed 100
  footplate demo --json --store railway.db")]
pub(crate) struct Arguments {
    /// The seed of rails, trains and stops.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulated time over real time; 25 by default at a terminal, otherwise unlimited.
    #[arg(long, value_name = "TIMES", value_parser = speed)]
    speed: Option<f64>,
    /// Record the session in this store, as a session of a real railway.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Serve the live dashboard: on a port of this machine (default 8417; 0 for any free port), or on an address. At a
    /// terminal it is always served.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    serve: Option<ServedAt>,
    /// Print one line of JSON for each calibration, stop and acknowledgement.
    #[arg(long)]
    json: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse::<f64>().ok().filter(|speed| speed.is_finite() && *speed >= 0.1);
    speed.ok_or_else(|| "write how many times faster than real, such as 10".to_owned())
}

impl Default for Arguments {
    /// The demo that runs without arguments.
    fn default() -> Self {
        Self { seed: 1, speed: None, store: None, serve: None, json: false }
    }
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let written = WrittenLayout::named("track-a")?;
        let layout = &written.layout;
        let screen = Screen::new(output, if self.json { Manner::Json } else { Manner::Text });
        let is_watched = screen.is_watched();
        let dashboard = match &self.serve {
            Some(at) => Some(open_dashboard(at, &written, self.store.clone(), SetUpRoute::fixed())?),
            // Another program may use the default port.
            None if is_watched => {
                open_dashboard(&ServedAt::USUAL, &written, self.store.clone(), SetUpRoute::fixed())
                    .or_else(|_| {
                        open_dashboard(&ServedAt::ANY, &written, self.store.clone(), SetUpRoute::fixed())
                    })
                    .ok()
            }
            None => None,
        };
        let watched = (is_watched || dashboard.is_some()).then_some(WATCHED_SPEED);
        let speed = self.speed.or(watched).map_or(Speed::Unpaced, Speed::Times);
        let record = SharedRecord::default();
        let mut recorder = record.clone();
        let railway = Railway::new(layout, self.seed, &TRAINS, speed, &mut recorder)?;
        record.0.borrow_mut().journal = self.journal(layout, railway.now())?;
        let dashboard_view =
            dashboard.as_ref().map(|dashboard| ReadOnlyDashboard::new(dashboard, layout, railway.now()));
        let mut demo = Demo::new(railway, screen, speed, record, &TRAINS);
        demo.dashboard_view = dashboard_view;
        self.greet(&mut demo)?;
        let mut choice = Choice::new(self.seed);
        let mut turnouts = TurnoutStates::unknown();
        for train in TRAINS {
            turnouts = turn(&mut demo, &written, train, &turnouts, &mut choice)?;
        }
        demo.end()?;
        self.conclude(&mut demo)
    }

    fn journal(&self, layout: &Layout, at: Timestamp) -> anyhow::Result<Option<SessionJournal>> {
        let Some(path) = &self.store else { return Ok(None) };
        let now = now();
        // The link's clock reads `at` now.
        let began_at = now + (Timestamp::ZERO - at);
        let name = format!("demo {}", local(now));
        let store = Store::open_or_create(path)?;
        let first = TrainAtStart { train: TRAINS[0], step: SpeedStep::STAND };
        let journal = Journal::begin(store, &name, layout.name(), Some(began_at), &[first], now)?;
        Ok(Some(SessionJournal::start(journal, Some(began_at), WhenFull::Wait, IfUnkept::Stop)?))
    }

    fn greet(&self, demo: &mut Demo<'_, '_, '_>) -> std::io::Result<()> {
        let [first, second] = TRAINS;
        demo.screen.announce(&format!(
            "Footplate calibrates and drives trains {first} and {second}, which it has never seen, on \
             track A"
        ))?;
        demo.screen
            .mention(&format!("through a simulated Märklin 6051, byte by byte; seed {}", self.seed))?;
        demo.screen.say("")
    }

    fn conclude(&self, demo: &mut Demo<'_, '_, '_>) -> anyhow::Result<Outcome> {
        let wall = demo.wall().as_secs_f64();
        let track = demo.now().as_s();
        let made = demo.stops.len();
        let inside = demo.stops.iter().filter(|stop| stop.is_inside()).count();
        demo.screen.record(&json!({ "result": {
            "seed": self.seed,
            "learnt": demo.learnt.iter().map(outcome::Learnt::value).collect::<Vec<_>>(),
            "stops": demo.stops.iter().map(outcome::MadeStop::value).collect::<Vec<_>>(),
            "inside": inside,
            "track_time_s": track,
            "wall_time_s": wall,
        }}))?;
        if let Some(summary) = outcome::summary(&demo.stops) {
            demo.screen.say("")?;
            let stops = std::mem::take(&mut demo.stops);
            demo.screen.table(&stops)?;
            demo.screen.say("")?;
            demo.screen.announce(&summary)?;
        }
        demo.screen.mention(&format!(
            "Errors are measured against the simulator's truth, hidden from everything else. {} of \
             track time took {wall:.0} s.",
            minutes(demo.now() - Timestamp::ZERO)
        ))?;
        demo.screen.mention(
            "For another railway: footplate demo --seed 2. For all commands: footplate \
                              --help.",
        )?;
        let done = made == STOPS * TRAINS.len() && !demo.is_broken();
        Ok(if done { Outcome::Done } else { Outcome::FallsShort })
    }
}

/// Puts one train on the rails, calibrates it, makes its stops and lifts it off again. All circuits of track A share
/// rails, so the other train is off the layout meanwhile.
fn turn(
    demo: &mut Demo<'_, '_, '_>,
    written: &WrittenLayout,
    train: TrainId,
    turnouts: &TurnoutStates,
    choice: &mut Choice,
) -> anyhow::Result<TurnoutStates> {
    if train != TRAINS[0] {
        demo.begin_run(train);
    }
    demo.railway.put_down(train)?;
    let known = calibrating::calibrate(demo, written, train, turnouts)?;
    if let Some(known) = &known {
        demo.models.push(MotionFile::of(&written.layout, known.fit.model(), Some(now())));
        Tour::new(demo, written, train, known)?.run(demo, known, STOPS, choice)?;
    }
    demo.railway.lift(train);
    demo.set_idle(train, "is done");
    Ok(known.map_or_else(TurnoutStates::unknown, |known| known.turnouts))
}
