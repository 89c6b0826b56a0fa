//! The trains of a living layout at its start: drawn from the seed, and put down without measuring.

use footplate_core::track::{Layout, Position};
use footplate_core::{EdgeId, Length, TrainId};

use crate::circuit::{Circuit, CircuitError};
use crate::draws::{Draws, Purpose};
use crate::law::LawFamily;
use crate::living::live_train::End;
use crate::living::switches::LivingSwitches;
use crate::living::world::LivingLayout;
use crate::physics_range::PhysicsRange;
use crate::train::Train;

/// What is left free before and behind a train that is put down (chosen: a finger's breadth).
const FREE_MM: f64 = 15.0;
/// The length of what a train pulls on a layout of blocks (chosen: none longer than the shortest block of a home layout).
const CARRIAGES_MM: core::ops::Range<f64> = 100.0..500.0;
/// Places tried for a train for which there is no circuit of its own.
const TRIES: usize = 1000;

impl<'l> LivingLayout<'l> {
    /// A layout with trains, all drawn from the seed, at rest where an operator has put them, facing either direction,
    /// somewhere between sensors: each on a circuit of its own (see [`homes`](Self::homes)) and off those of the
    /// others, so that one at a time can run round; trains for which there is none, anywhere. Turnouts lie anyhow,
    /// unless the switches say otherwise.
    ///
    /// Circuits need not be apart altogether: all of Track A's lead through two of its three necks.
    ///
    /// # Errors
    /// [`CircuitError`] when no train can run round on the layout.
    pub fn draw(
        layout: &'l Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
    ) -> Result<Self, CircuitError> {
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let circuits = Circuit::draw_apart(layout, trains.len(), &mut draws)?;
        let mut world = Self::without_trains(layout, seed, switches);
        if switches.turnouts_set {
            for (turnout, leg) in circuits.iter().rev().flat_map(Circuit::turnouts) {
                world.lay(turnout, leg);
            }
        }
        let every: Vec<&Circuit> = circuits.iter().collect();
        let anywhere: Vec<(EdgeId, [f64; 2])> =
            layout.edges().map(|(id, edge)| (id, [0.0, edge.length.as_mm()])).collect();
        for (nth, id) in trains.iter().enumerate() {
            // Seeds of neighbouring worlds share no train.
            let own = seed.wrapping_mul(1000).wrapping_add(nth as u64 + 1);
            let laws = LawFamily::ALL;
            let law = switches.law.unwrap_or(laws[(own % laws.len() as u64) as usize]);
            let mut train = Train::draw(own, law);
            switches.physics.shape(own, &mut train);
            train.set_decoder(switches.decoder);
            if !layout.blocks().is_empty() {
                train.couple(Length::from_mm(Draws::new(own, Purpose::Living).uniform(CARRIAGES_MM)));
            }
            let warmth = if switches.physics.includes(PhysicsRange::WarmUp) { 0.0 } else { switches.warmth };
            world.add(*id, train, warmth);
            let sidings = Circuit::sidings(layout, &every, nth);
            world.put_down(*id, if sidings.is_empty() { &anywhere } else { &sidings }, &mut draws);
        }
        world.homes = trains.iter().copied().zip(circuits).collect();
        Ok(world)
    }

    /// The circuit that each train was put on: what an operator could enter into a program.
    pub fn homes(&self) -> &[(TrainId, Circuit)] {
        &self.homes
    }

    /// Puts a train on one of several edges between offsets; it stays lifted when there is no room.
    fn put_down(&mut self, train: TrainId, edges: &[(EdgeId, [f64; 2])], draws: &mut Draws) {
        let Some(engine) = self.truth().engine(train) else { return };
        let [ahead, behind] = [engine.nose, engine.shoe + engine.tail].map(|length| length.as_mm() + FREE_MM);
        for _ in 0..TRIES {
            let Some(&(edge, [from, to])) = edges.get(draws.below(edges.len())) else { return };
            let length = self.truth().track().length(edge).as_mm();
            let (edge, [from, to]) = if draws.chance(0.5) {
                (edge, [from, to])
            } else {
                (edge.twin(), [length - to, length - from])
            };
            let offset = draws.uniform(from + behind..(to - ahead).max(from + behind + 1.0));
            let position = Position { edge, offset: Length::from_mm(offset) };
            if offset + ahead < to && self.place(train, position, End::Nose).is_ok() {
                return;
            }
        }
    }
}
