//! The kinds of disturbance, and how they are applied to the simulated world.

use footplate_core::track::Position;
use footplate_core::{Length, TimeSpan, TrainId};
use footplate_sim::{End, LawFamily, Train, VirtualStation};

use crate::seeds::Choice;

/// The time that the station is without power.
const POWER_CUT: TimeSpan = TimeSpan::from_s(4.0);
/// Speed with dirty wheels over speed with clean ones.
const DIRTY_SPEED: f64 = 0.8;
/// The warmth of an engine that was not in use: 0 is cold, 1 is warm.
const COLD_WARMTH: f64 = 0.1;

/// A kind of disturbance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// No disturbance: every alarm is a false alarm.
    Faultless,
    /// Another engine under the same address.
    Swapped,
    /// Dirty wheels.
    Dirty,
    /// The station restarts.
    Restarted,
    /// The train is lifted and put on the track elsewhere, in the same direction.
    Lifted,
    /// The same, in the opposite direction.
    Turned,
}

impl Kind {
    pub(super) const ALL: [Self; 6] =
        [Self::Faultless, Self::Swapped, Self::Dirty, Self::Restarted, Self::Lifted, Self::Turned];

    pub(super) const fn description(self) -> &'static str {
        match self {
            Self::Faultless => "nothing",
            Self::Swapped => "another engine under the number",
            Self::Dirty => "dirty wheels, 20 % slower",
            Self::Restarted => "station restarted, 4 s dark",
            Self::Lifted => "lifted and put elsewhere",
            Self::Turned => "the same, in the opposite direction",
        }
    }

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Faultless => "faultless",
            Self::Swapped => "swapped",
            Self::Dirty => "dirty",
            Self::Restarted => "restarted",
            Self::Lifted => "lifted",
            Self::Turned => "turned",
        }
    }

    /// Applies the disturbance; `places` are where a train may be put.
    pub(super) fn apply(
        self,
        station: &mut VirtualStation<'_>,
        train: TrainId,
        places: &[Position],
        seed: u64,
        choice: &mut Choice,
    ) -> anyhow::Result<()> {
        match self {
            Self::Faultless => {}
            Self::Swapped => {
                // An engine that no train of this world has, with any law.
                let other = seed.wrapping_mul(1000).wrapping_add(777);
                let law = LawFamily::ALL[(seed % LawFamily::ALL.len() as u64) as usize];
                station.world.swap(train, Train::draw(other, law), COLD_WARMTH)?;
            }
            Self::Dirty => station.world.dirty_wheels(train, DIRTY_SPEED),
            Self::Restarted => station.restart(POWER_CUT),
            Self::Lifted | Self::Turned => {
                station.world.lift(train);
                let layout = station.world.layout();
                // Try places until the train fits.
                for _ in 0..100 {
                    let Some(place) = choice.of(places).copied() else { break };
                    let turned = layout.reversed(place).filter(|_| self == Self::Turned);
                    let place = turned.unwrap_or(place);
                    if station.world.place(train, place, End::Nose).is_ok() {
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The middles of all edges long enough to be clear of sensors.
pub(super) fn places_along(
    layout: &footplate_core::track::Layout,
    loop_edges: &[footplate_core::EdgeId],
) -> Vec<Position> {
    let long = |edge: &footplate_core::EdgeId| {
        let length = layout.edge(*edge)?.length;
        (length > Length::from_mm(150.0)).then_some(Position { edge: *edge, offset: length * 0.5 })
    };
    loop_edges.iter().filter_map(long).collect()
}
