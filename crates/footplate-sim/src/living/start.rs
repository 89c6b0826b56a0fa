//! How trains get onto a living layout: drawn, and put down by a hand that does not measure.

use footplate_core::track::{Layout, Position};
use footplate_core::{EdgeId, Length, TrainId};

use crate::circuit::{Circuit, CircuitError};
use crate::draws::{Draws, Purpose};
use crate::law::LawFamily;
use crate::living::live_train::End;
use crate::living::switches::LivingSwitches;
use crate::living::world::LivingLayout;
use crate::train::Train;

/// What is left free before and behind a train that is put down (chosen: a finger's breadth).
const FREE_MM: f64 = 15.0;
/// Places tried for a train for which there is no circuit of its own.
const TRIES: usize = 1000;

impl<'l> LivingLayout<'l> {
    /// A layout with trains, all drawn from the seed, standing where a person has put them: each on a circuit that
    /// shares no rails with the others' as long as there are such circuits, facing either way, somewhere between
    /// contacts. Turnouts lie anyhow, unless the switches say otherwise.
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
            for (turnout, leg) in circuits.iter().flat_map(Circuit::turnouts) {
                world.lay(turnout, leg);
            }
        }
        for (nth, id) in trains.iter().enumerate() {
            // Seeds of neighbouring worlds share no train.
            let own = seed.wrapping_mul(1000).wrapping_add(nth as u64 + 1);
            let laws = LawFamily::ALL;
            let law = switches.law.unwrap_or(laws[(own % laws.len() as u64) as usize]);
            world.add(*id, Train::draw(own, law), switches.warmth);
            world.put_down(*id, circuits.get(nth), &mut draws);
        }
        Ok(world)
    }

    /// Puts a train on its circuit, or anywhere if it has none; it stays lifted when there is no room.
    fn put_down(&mut self, train: TrainId, circuit: Option<&Circuit>, draws: &mut Draws) {
        let anywhere: Vec<EdgeId> = self.layout().edges().map(|(id, _)| id).collect();
        let Some(engine) = self.truth().engine(train) else { return };
        let [ahead, behind] = [engine.nose, engine.shoe + engine.tail].map(|length| length.as_mm() + FREE_MM);
        for _ in 0..TRIES {
            let edges = circuit.map_or(anywhere.as_slice(), Circuit::edges);
            let Some(&edge) = edges.get(draws.below(edges.len())) else { return };
            let edge = if draws.chance(0.5) { edge } else { edge.twin() };
            let length = self.truth().track().length(edge).as_mm();
            let offset = draws.uniform(behind..(length - ahead).max(behind + 1.0));
            let position = Position { edge, offset: Length::from_mm(offset) };
            if offset + ahead < length && self.place(train, position, End::Nose).is_ok() {
                return;
            }
        }
    }
}
