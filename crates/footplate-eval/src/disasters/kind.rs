//! What befalls a train, and how it is done to the simulated world.

use footplate_core::track::Position;
use footplate_core::{Length, TimeSpan, TrainId};
use footplate_sim::{End, LawFamily, Train, VirtualStation};

use crate::choice::Choice;

/// How long the station is without power.
const DARK: TimeSpan = TimeSpan::from_s(4.0);
/// Speed with dirty wheels over speed with clean ones.
const DIRTY: f64 = 0.8;
/// How warm an engine is that comes from the shelf.
const COLD: f64 = 0.1;

/// What is scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Nothing happens: what is said then is a false alarm.
    Faultless,
    /// Another engine under the same number.
    Swapped,
    /// Wheels get dirty.
    Dirty,
    /// The station restarts.
    Restarted,
    /// Lifted and put on the track elsewhere, facing the same way round.
    Lifted,
    /// The same, facing the other way round.
    Turned,
}

impl Kind {
    pub(super) const ALL: [Self; 6] =
        [Self::Faultless, Self::Swapped, Self::Dirty, Self::Restarted, Self::Lifted, Self::Turned];

    pub(super) const fn says(self) -> &'static str {
        match self {
            Self::Faultless => "nothing",
            Self::Swapped => "another engine under the number",
            Self::Dirty => "dirty wheels, 20 % slower",
            Self::Restarted => "station restarted, 4 s dark",
            Self::Lifted => "lifted and put elsewhere",
            Self::Turned => "the same, facing the other way",
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

    /// Lets it happen. Places are where a train may be put, in true rails.
    pub(super) fn befall(
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
                // No train of this seed's world, and of any law.
                let other = seed.wrapping_mul(1000).wrapping_add(777);
                let law = LawFamily::ALL[(seed % LawFamily::ALL.len() as u64) as usize];
                station.world_mut().swap(train, Train::draw(other, law), COLD)?;
            }
            Self::Dirty => station.world_mut().dirty_wheels(train, DIRTY),
            Self::Restarted => station.restart(DARK),
            Self::Lifted | Self::Turned => {
                station.world_mut().lift(train);
                let layout = station.world().layout();
                // Wherever there is room.
                for _ in 0..100 {
                    let Some(place) = choice.of(places).copied() else { break };
                    let turned = layout.reversed(place).filter(|_| self == Self::Turned);
                    let place = turned.unwrap_or(place);
                    if station.world_mut().place(train, place, End::Nose).is_ok() {
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Places along a way, a hand's breadth apart from contacts.
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
