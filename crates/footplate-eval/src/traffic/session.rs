//! Some hours of traffic on one simulated layout, compared with its truth.

use std::collections::BTreeMap;

use anyhow::bail;
use footplate_core::control::{Dispatcher, Finished, Journey, Notice, Span, TrainLengths};
use footplate_core::track::{Landmark, Layout, Position};
use footplate_core::tracking::PathPoint;
use footplate_core::{Length, NodeId, TimeSpan, Timestamp, TrainId};
use footplate_sim::{Incident, LivingLayout, LivingSwitches};
use footplate_wire::LinkNotice;

use crate::say;
use crate::seeds::Choice;
use crate::testbed::PreparedTrains;

/// The interval at which the truth is compared with reservations.
const LOOK: TimeSpan = TimeSpan::from_ms(50);
/// Rounding between true and surveyed lengths.
const ROUNDING: Length = Length::from_mm(1.0);
/// The longer overhang and the pickup of the engines, measured and rounded up to a centimetre.
pub const LENGTHS: TrainLengths =
    TrainLengths { overhang: Length::from_mm(110.0), pickup: Length::from_mm(45.0) };
/// The standard deviation of a position that an operator reads off.
pub const HAND: Length = Length::from_mm(12.0);
/// The largest error of an estimated position at rest, in standard deviations: exceeded once in 15 000.
const CERTAIN: f64 = 4.0;
/// A larger error is counted from a sensor that the train passed in the opposite direction.
const FAR: Length = Length::from_mm(1_000.0);
/// The time after which an operator helps a lost train.
const HELP_AFTER: TimeSpan = TimeSpan::from_s(20.0);
/// The distance of trains past a sensor at the start.
const PAST: Length = Length::from_mm(150.0);
/// The trains, in the order in which they are put down.
const TRAINS: [TrainId; 6] = [TrainId(24), TrainId(58), TrainId(1), TrainId(43), TrainId(54), TrainId(35)];
/// Places tried for a train at the start.
const TRIES: usize = 1_000;

/// How much further than estimated a train really is that has come to rest; `None` if its sensor does not tell.
pub fn rest_error(layout: &Layout, world: &LivingLayout<'_>, finished: &Finished) -> Option<Length> {
    let achieved = finished.achieved?;
    let past = world.truth().past(finished.train, layout.sensor_at(achieved.at.node)?)?;
    // A train that has reversed since does not come from that sensor.
    Some(past - achieved.at.offset).filter(|error| error.abs() <= FAR)
}

/// The settings of a session.
#[derive(Debug, Clone, Copy)]
pub struct Asked {
    /// How many trains.
    pub trains: usize,
    /// Track time.
    pub time: TimeSpan,
    /// Track time that the calibration of each train may take.
    pub budget: TimeSpan,
    /// Whether the track between sensors is reserved as a whole.
    pub by_blocks: bool,
}

/// The counts of a session.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// The seed.
    pub seed: u64,
    /// Track time, in hours.
    pub hours: f64,
    /// How many trains.
    pub trains: usize,
    /// Destinations reached.
    pub arrivals: u32,
    /// Destinations without a route, and orders that failed, by their reasons.
    pub refused: BTreeMap<String, u32>,
    /// Routes that the driver refused and that were withdrawn, by their reasons.
    pub withdrawn: BTreeMap<String, u32>,
    /// Routes that were set, and reversals on them.
    pub routes: u32,
    /// Reversals on these routes.
    pub turns: usize,
    /// Trains that made room for others.
    pub aside: u32,
    /// Deadlocks.
    pub deadlocks: u32,
    /// Trains found on another route.
    pub diverged: u32,
    /// Trains whose position became unknown.
    pub lost: u32,
    /// Times that the watchdog stopped a train because it did not run as it should.
    pub dangers: u32,
    /// Interventions of the operator.
    pub hands: u32,
    /// Collisions, derailments and overruns.
    pub incidents: Vec<Incident>,
    /// Times that a train entered track without a reservation.
    pub intrusions: Vec<(Timestamp, TrainId)>,
    /// How long trains waited for their routes, in s.
    pub waits: Vec<f64>,
    /// How long journeys took, in s.
    pub took: Vec<f64>,
    /// The longest time without an arrival of a train, in s.
    pub starved: f64,
    /// Rests past a sensor at which the position was compared with the truth.
    pub rests: u32,
    /// Of these, those with too large an error.
    pub mistaken: u32,
    /// Estimated errors of arrivals, in mm.
    pub errors: Vec<f64>,
}

/// Some hours of traffic.
pub struct Session<'l> {
    layout: &'l Layout,
    prepared: PreparedTrains<'l>,
    dispatcher: Dispatcher,
    choice: Choice,
    tally: Tally,
    trains: Vec<TrainId>,
    is_inside: BTreeMap<TrainId, bool>,
    /// When each train arrived last.
    since: BTreeMap<TrainId, Timestamp>,
    waits: BTreeMap<TrainId, Timestamp>,
    /// When each train first needed an operator.
    needs_person: BTreeMap<TrainId, Timestamp>,
    /// When an unauthorised movement was first reported.
    warned: Option<Timestamp>,
    talk: bool,
}

impl<'l> Session<'l> {
    /// Draws trains and rails from the seed, and calibrates the trains; `talk` prints everything that happens.
    ///
    /// # Errors
    /// When there is no room for the trains.
    pub fn new(layout: &'l Layout, seed: u64, asked: Asked, talk: bool) -> anyhow::Result<Self> {
        let (prepared, choice) = set_out(layout, seed, asked)?;
        let trains = TRAINS[..asked.trains.min(TRAINS.len())].to_vec();
        let dispatcher = dispatcher(&prepared, asked.by_blocks);
        let began = prepared.line.now();
        let tally =
            Tally { seed, trains: trains.len(), hours: asked.time.as_s() / 3600.0, ..Tally::default() };
        Ok(Self {
            layout,
            prepared,
            dispatcher,
            choice,
            tally,
            is_inside: trains.iter().map(|train| (*train, true)).collect(),
            since: trains.iter().map(|train| (*train, began)).collect(),
            trains,
            waits: BTreeMap::new(),
            needs_person: BTreeMap::new(),
            warned: None,
            talk,
        })
    }

    /// Runs for so long.
    pub fn run(mut self, time: TimeSpan) -> Tally {
        let began = self.prepared.line.now();
        let end = began + time;
        let before = self.prepared.world().incidents().len();
        for train in self.trains.clone() {
            self.send(train);
        }
        while self.prepared.line.now() < end && self.prepared.world().incidents().len() == before {
            let until = end.min(self.prepared.line.now() + LOOK);
            let hear_of_line = |dispatcher: &mut Dispatcher, now, notice: &LinkNotice| {
                if let Some(news) = notice.news() {
                    dispatcher.handle_link(now, news);
                }
            };
            let notice = self.prepared.line.drive_hearing(&mut self.dispatcher, until, hear_of_line);
            match notice {
                Some(notice) => self.hear(&notice),
                None => self.look(),
            }
        }
        let now = self.prepared.line.now();
        self.tally.hours = (now - began).as_s() / 3600.0;
        for train in self.trains.clone() {
            self.came_somewhere(train, now);
        }
        self.tally.incidents = self.prepared.world().incidents().iter().skip(before).copied().collect();
        for incident in self.tally.incidents.iter().filter(|_| self.talk) {
            say!("{:9.2} {:?}", incident.at.as_s(), incident.kind);
        }
        self.trains.iter().filter(|_| self.talk).for_each(|train| self.print_truth(*train));
        self.tally
    }

    fn hear(&mut self, notice: &Notice) {
        let now = self.prepared.line.now();
        if self.talk && !matches!(notice, Notice::Planned(_)) {
            say!("{:9.2} {notice:?}", now.as_s());
        }
        match notice {
            Notice::Arrived { train, error, took, .. } => {
                self.tally.arrivals += 1;
                self.tally.took.push(took.as_s());
                self.tally.errors.extend(error.map(Length::as_mm));
                self.came_somewhere(*train, now);
                self.send(*train);
            }
            Notice::GivenUp { train, why, .. } if self.dispatcher.journey(*train).is_none() => {
                *self.tally.refused.entry(kind_of(&format!("{why:?}"))).or_default() += 1;
                self.send(*train);
            }
            Notice::RouteSet { train, turns, .. } => {
                self.tally.routes += 1;
                self.tally.turns += turns;
                if let Some(since) = self.waits.remove(train) {
                    self.tally.waits.push((now - since).as_s());
                }
            }
            Notice::Withdrawn { train, why } => {
                if self.talk {
                    self.print_truth(*train);
                }
                *self.tally.withdrawn.entry(kind_of(&format!("{why:?}"))).or_default() += 1;
            }
            Notice::Done(finished) => self.check_position(finished),
            Notice::StepsAside { .. } => self.tally.aside += 1,
            Notice::Deadlock { .. } => self.tally.deadlocks += 1,
            Notice::Diverged { .. } => self.tally.diverged += 1,
            Notice::ReservedAsUnknown { .. } => self.tally.lost += 1,
            Notice::Danger { .. } => self.tally.dangers += 1,
            Notice::UnauthorisedMovement { .. } => {
                self.tally.dangers += 1;
                self.warned.get_or_insert(now);
            }
            Notice::TrackClear => self.warned = None,
            Notice::NeedsOperator { train, .. } => {
                self.needs_person.insert(*train, now);
            }
            _ => {}
        }
    }

    fn came_somewhere(&mut self, train: TrainId, now: Timestamp) {
        if let Some(since) = self.since.insert(train, now) {
            self.tally.starved = self.tally.starved.max((now - since).as_s());
        }
    }

    /// Sends a train to a random place.
    fn send(&mut self, train: TrainId) {
        let sensors: Vec<NodeId> = self.layout.sensors().map(|(_, node)| node).collect();
        for _ in 0..TRIES {
            let Some(node) = self.choice.of(&sensors).copied() else { return };
            let length = self.layout.outgoing(node).edges().next().and_then(|edge| self.layout.edge(edge));
            let offset =
                Length::from_mm(self.choice.between(0.0, length.map_or(0.0, |edge| edge.length.as_mm())));
            let journey = Journey::to(Landmark { node, offset });
            let now = self.prepared.line.now();
            if self.dispatcher.go(now, train, journey).is_ok() {
                self.waits.insert(train, now);
                return;
            }
        }
    }

    /// Compares the track under trains with their reservations, and helps those that are lost.
    fn look(&mut self) {
        let now = self.prepared.line.now();
        if self.warned.is_some_and(|since| now - since >= HELP_AFTER) {
            self.dispatcher.switch_power(now, true);
        }
        for train in self.trains.clone() {
            let is_inside = is_on_reserved_track(self.layout, self.prepared.world(), &self.dispatcher, train);
            if let Some(was) = self.is_inside.insert(train, is_inside)
                && was
                && !is_inside
            {
                self.tally.intrusions.push((now, train));
                if self.talk {
                    say!("{:9.2} train {train} is on track that it does not hold", now.as_s());
                    self.print_truth(train);
                }
            }
            if self.needs_person.get(&train).is_some_and(|since| now - *since >= HELP_AFTER) {
                self.help(train, now);
            }
            if self.dispatcher.journey(train).is_none() {
                self.send(train);
            }
        }
    }

    /// Compares the estimated position of a train at rest with the truth.
    fn check_position(&mut self, finished: &Finished) {
        let Some(achieved) = finished.achieved else { return };
        let Some(error) = rest_error(self.layout, self.prepared.world(), finished) else { return };
        let sigmas = error / achieved.uncertainty;
        self.tally.rests += 1;
        if sigmas.abs() > CERTAIN {
            self.tally.mistaken += 1;
            if self.talk {
                let (train, mm) = (finished.train, error.as_mm());
                say!("{:9.2} train {train} is {mm:.0} mm ({sigmas:.1} sd) beyond", finished.time.as_s());
            }
        }
    }

    /// Prints the true and the estimated state of a train, and turnouts whose state is not the known one.
    fn print_truth(&self, train: TrainId) {
        let (truth, driver) = (self.prepared.world().truth(), self.dispatcher.driver());
        let name = |edge| {
            let edge = self.layout.edge(edge)?;
            Some([edge.from, edge.to].map(|node| self.layout.node_name(node)).join(" to "))
        };
        let place = |place: Position| {
            format!("{:.0} mm from {}", place.offset.as_mm(), name(place.edge).unwrap_or_default())
        };
        let really = truth.train(train).and_then(|train| train.position).map(place);
        let estimated = driver.position(train, self.prepared.line.now()).map(place);
        let journey = self.dispatcher.journey(train).map(|(_, journey)| self.layout.display(journey.target));
        let journey = journey.map(|to| to.to_string());
        say!("          {train} wants to {journey:?}, is really {really:?}, estimated {estimated:?}");
        let under = driver.turnouts_under(train, self.prepared.line.now()).into_iter();
        let under: Vec<_> = under.map(|turnout| (turnout.0, driver.turnouts().get(turnout))).collect();
        say!("          on turnouts {under:?}");
        for (turnout, _) in self.layout.turnouts() {
            let (lies, known) = (self.prepared.world().lies(turnout), driver.turnouts().get(turnout));
            if lies != known {
                say!("          turnout {turnout} lies {lies:?}, known as {known:?}");
            }
        }
    }

    /// An operator reads off the position of a train.
    fn help(&mut self, train: TrainId, now: Timestamp) {
        self.needs_person.remove(&train);
        let Some(at) = place_by_hand(self.layout, self.prepared.world(), train) else { return };
        self.tally.hands += 1;
        self.dispatcher.place(now, train, at, HAND);
    }
}

/// Draws trains and rails from the seed, calibrates the trains, and puts them on reservations that do not overlap. The stream of
/// random numbers goes on from there.
///
/// # Errors
/// When there is no room for the trains.
pub fn set_out(layout: &Layout, seed: u64, asked: Asked) -> anyhow::Result<(PreparedTrains<'_>, Choice)> {
    let trains = &TRAINS[..asked.trains.min(TRAINS.len())];
    let switches = LivingSwitches::well_kept();
    let mut prepared = PreparedTrains::prepare(layout, seed, trains, &switches, asked.budget)?;
    let mut choice = Choice::new(seed);
    let sensors: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
    for nth in 0..trains.len() {
        let mut is_put = false;
        for _ in 0..TRIES {
            let Some(node) = choice.of(&sensors) else { break };
            if prepared.put(trains[nth], *node, PAST).is_err() {
                continue;
            }
            let dispatcher = dispatcher(&prepared, asked.by_blocks);
            let holds = |train: &TrainId| dispatcher.reservation(*train);
            let is_apart = trains[..nth]
                .iter()
                .all(|other| holds(other).zip(holds(&trains[nth])).is_some_and(|(one, two)| !one.meets(two)));
            let is_off_turnouts = holds(&trains[nth]).is_some_and(|held| held.turnouts().next().is_none());
            // Hardly a block has none.
            if is_apart && (is_off_turnouts || asked.by_blocks) {
                is_put = true;
                break;
            }
        }
        if !is_put {
            bail!("there is no room for {} trains on this layout; ask for fewer", asked.trains);
        }
    }
    Ok((prepared, choice))
}

/// Whether all track under a train is truly reserved for it.
pub fn is_on_reserved_track(
    layout: &Layout,
    world: &LivingLayout<'_>,
    dispatcher: &Dispatcher,
    train: TrainId,
) -> bool {
    let truth = world.truth();
    let Some(held) = dispatcher.reservation(train) else { return false };
    truth.under(train).all(|(id, part)| {
        let Some(edge) = layout.edge(id) else { return false };
        let scale = edge.length.as_mm() / truth.track().length(id).as_mm().max(1e-9);
        let [from, to] = part.map(|at| at * scale);
        let span = if id < id.twin() {
            Span { from, to }
        } else {
            Span { from: edge.length - to, to: edge.length - from }
        };
        held.covers(id.stretch(), span, ROUNDING)
    })
}

/// The position that an operator would read off, in surveyed lengths.
pub fn place_by_hand(layout: &Layout, world: &LivingLayout<'_>, train: TrainId) -> Option<PathPoint> {
    let truth = world.truth();
    let position = truth.train(train)?.position?;
    let edge = layout.edge(position.edge)?;
    let scale = edge.length.as_mm() / truth.track().length(position.edge).as_mm().max(1e-9);
    Some(PathPoint { node: edge.from, distance: position.offset * scale })
}

fn dispatcher(prepared: &PreparedTrains<'_>, by_blocks: bool) -> Dispatcher {
    let now = prepared.line.now();
    let mut dispatcher = Dispatcher::watched(now, prepared.driver());
    if by_blocks {
        dispatcher.reserve_blocks();
    }
    let trains: Vec<TrainId> = dispatcher.driver().trains().collect();
    for train in trains {
        dispatcher.set_lengths(now, train, LENGTHS);
    }
    dispatcher
}

/// The name of what was refused, without its numbers.
fn kind_of(refusal: &str) -> String {
    refusal.trim_start_matches("Some(").split([' ', '(', '{']).next().unwrap_or_default().to_owned()
}
