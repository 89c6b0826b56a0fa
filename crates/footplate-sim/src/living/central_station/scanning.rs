//! The S88 bus: all inputs are loaded at once, a cycle apart, then shifted out one by one.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::marklin_can::{InputChange, Message};
use footplate_wire::marklin_serial::INPUTS_PER_MODULE;

use crate::draws::Draws;
use crate::living::due_queue::DueQueue;
use crate::living::world::LivingLayout;

/// What one bit takes on the bus (Link S88: 167 µs unless its owner has set another).
const BIT_TIME: TimeSpan = TimeSpan::from_us(167);
/// What the station needs from there until the report is on the CAN bus (s; chosen).
const HANDS_ON_S: std::ops::Range<f64> = 0.000_5..0.003;
/// The unit of the time that a report carries.
const TICK: TimeSpan = TimeSpan::from_ms(10);

/// The bus, and what the station knows of its inputs.
#[derive(Debug, Clone)]
pub(super) struct Scanning {
    cycle: TimeSpan,
    due: Timestamp,
    /// By the input's number from 0: whether it is occupied, and since which scan.
    inputs: Vec<(bool, Timestamp)>,
    reports: DueQueue<Message>,
}

impl Scanning {
    pub(super) fn begin(
        world: &mut LivingLayout<'_>,
        now: Timestamp,
        cycle: TimeSpan,
        draws: &mut Draws,
    ) -> Self {
        let count =
            world.s88.sensors().iter().map(|sensor| usize::from(sensor.0) + 1).max().unwrap_or_default();
        let due = now + TimeSpan::from_s(draws.uniform(0.0..cycle.as_s()));
        // What closed before the station was switched on is forgotten.
        let per_module = usize::from(INPUTS_PER_MODULE);
        let held: Vec<u16> = (0..count.div_ceil(per_module))
            .flat_map(|module| {
                world.s88.read(module as u8 + 1, now, true, false).closed().collect::<Vec<_>>()
            })
            .map(|sensor| sensor.0)
            .collect();
        let inputs = (0..count).map(|place| (held.contains(&(place as u16)), now)).collect();
        Self { cycle, due, inputs, reports: DueQueue::new() }
    }

    /// When all inputs are loaded next.
    pub(super) const fn due(&self) -> Timestamp {
        self.due
    }

    /// Loads all inputs; what has changed is reported when it has been shifted out.
    pub(super) fn scan(&mut self, world: &mut LivingLayout<'_>, has_times: bool, draws: &mut Draws) {
        let at = self.due;
        self.due += self.cycle;
        let per_module = usize::from(INPUTS_PER_MODULE);
        let modules = self.inputs.len().div_ceil(per_module);
        for module in 0..modules {
            let state = world.s88.read(module as u8 + 1, at, true, true);
            let occupied: Vec<u16> = state.closed().map(|sensor| sensor.0).collect();
            let places = module * per_module..((module + 1) * per_module).min(self.inputs.len());
            for place in places {
                let is_occupied = occupied.contains(&(place as u16));
                let (was_occupied, since) = self.inputs[place];
                if was_occupied == is_occupied {
                    continue;
                }
                self.inputs[place] = (is_occupied, at);
                let ticks = (at - since).as_ns() / TICK.as_ns();
                let lasted = has_times.then(|| u16::try_from(ticks).unwrap_or(u16::MAX)).or(Some(0));
                let input = place as u16 + 1;
                let shifted = TimeSpan::from_ns(BIT_TIME.as_ns() * i64::from(input));
                let due = at + shifted + TimeSpan::from_s(draws.uniform(HANDS_ON_S));
                let change = Some(InputChange { was_occupied, is_occupied, lasted });
                self.reports.add(due, Message::Input { device: 0, input, change });
            }
        }
    }

    pub(super) fn next_report(&self) -> Option<Timestamp> {
        self.reports.due()
    }

    pub(super) fn take_report(&mut self) -> Option<Message> {
        self.reports.take()
    }

    /// The inputs of a module, the first in the lowest bit.
    pub(super) fn module(&self, module: u8) -> u16 {
        let first = (usize::from(module.max(1)) - 1) * usize::from(INPUTS_PER_MODULE);
        let inputs = self.inputs.iter().skip(first).take(usize::from(INPUTS_PER_MODULE));
        inputs.enumerate().fold(0, |bits, (bit, (occupied, _))| bits | u16::from(*occupied) << bit)
    }

    /// Whether an input is occupied, and for how long it has been so or free.
    pub(super) fn input(&self, input: u16, now: Timestamp) -> Option<InputChange> {
        let (occupied, since) = *self.inputs.get(usize::from(input.checked_sub(1)?))?;
        let ticks = (now - since).as_ns() / TICK.as_ns();
        let lasted = Some(u16::try_from(ticks).unwrap_or(u16::MAX));
        Some(InputChange { was_occupied: occupied, is_occupied: occupied, lasted })
    }
}
