//! Trains in danger come back into service, or wait where creeping is not permitted.

use footplate_core::control::{Notice, Reservation};
use footplate_core::{Command, SpeedStep};

use crate::watching::{FIRST, Watched};

#[test]
fn a_train_stopped_in_the_instant_of_its_start_is_recovered() {
    // Its start is confirmed after its stop was commanded, and does not revoke it.
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    watched.dog.distrust(watched.world.now, FIRST);
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:?}", watched.notices);
}

#[test]
fn the_first_train_asked_waits_for_the_answer() {
    let mut watched = Watched::asking();
    let asked = |notice: &Notice| matches!(notice, Notice::AsksToCreep { train: FIRST });
    assert_eq!(watched.notices.iter().filter(|notice| asked(notice)).count(), 1);
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
}

#[test]
fn a_train_lost_again_on_reserved_track_does_not_creep_on() {
    // Given a train under a dispatcher that is located and measured again,
    let mut watched = Watched::asking();
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    let is_located =
        |watched: &Watched| watched.notices.iter().any(|notice| matches!(notice, Notice::Located { .. }));
    assert!(watched.run_until(60.0, is_located), "{:#?}", watched.notices);
    watched.run(1.0);
    let from = watched.commanded.len();
    // when its position is lost,
    watched.dog.lose(watched.world.now, FIRST);
    watched.run(0.5);
    // then it reverses towards the sensor that it ran over, instead of creeping on into track that may end.
    let first = watched.commanded.get(from).map(|(_, command)| *command);
    assert_eq!(first, Some(Command::Speed { train: FIRST, step: SpeedStep::STAND }));
    assert!(watched.run_until(10.0, |watched| {
        watched.commanded.iter().skip(from).any(|(_, command)| matches!(command, Command::Reverse { .. }))
    }));
}
