//! The station's list of locomotives stays what the station has sent last, whatever else is sent over the bus.

use footplate_core::TrainId;
use footplate_wire::Session;
use footplate_wire::marklin_can::{MOST_DATA, Message, Settings, Uid};
use miniz_oxide::deflate::compress_to_vec_zlib;

use crate::desk::{ms, speed};
use crate::marklin_can_session::{Desk, drives};

/// The number that the list gives to the locomotive with address 24.
const LISTED: u32 = 0x4005;
const LIST: &str = "[lokomotive]\nlokomotive\n .uid=0x4005\n .name=BR 03\n .adresse=0x18\n";
const OTHER_FILE: &str = "[magnetartikel]\nartikel\n .id=1\n .name=Weiche 1\n";

/// Sends a file as the station does.
fn sends(desk: &mut Desk, text: &str) {
    let length = u32::try_from(text.len()).unwrap().to_be_bytes();
    let stream: Vec<u8> = length.into_iter().chain(compress_to_vec_zlib(text.as_bytes(), 6)).collect();
    let length = u32::try_from(stream.len()).unwrap();
    desk.hear(Message::StreamBegins { length, check: 0 }, true);
    for chunk in stream.chunks(MOST_DATA) {
        let mut frame = [0; MOST_DATA];
        frame[..chunk.len()].copy_from_slice(chunk);
        desk.hear(Message::StreamGoesOn(frame), true);
    }
}

/// A session that has just asked for the list.
fn asking() -> Desk {
    let mut desk = Desk::new(Settings { modules: 2, ..Settings::default() });
    while !desk.messages().iter().any(|message| matches!(message, Message::File(_))) {
        desk.run_until(desk.now + footplate_core::TimeSpan::from_ms(1));
    }
    desk
}

/// A session that has read the list.
fn listed() -> Desk {
    let mut desk = asking();
    sends(&mut desk, LIST);
    desk.run_until(ms(2_000));
    assert_eq!(desk.client.listed_locomotives().len(), 1);
    desk.client.handle_command(desk.now, speed(TrainId(24), 8)).unwrap();
    desk.run_until(ms(3_000));
    desk
}

fn stops_the_listed_locomotive(mut desk: Desk) -> bool {
    desk.written.clear();
    desk.client.handle_command(desk.now, speed(TrainId(24), 0)).unwrap();
    desk.run_until(desk.now + footplate_core::TimeSpan::from_ms(500));
    assert!(desk.client.listed_locomotives().iter().all(|listed| listed.uid == Uid(LISTED)));
    desk.messages().contains(&drives(LISTED, 0))
}

#[test]
fn another_file_on_the_bus_leaves_the_list_as_it_is() {
    for other in [OTHER_FILE, "[lokomotive]\n", ""] {
        let mut desk = listed();
        sends(&mut desk, other);
        desk.hear(Message::StreamBegins { length: 8, check: 0 }, true);
        desk.hear(Message::StreamGoesOn([0xFF; MOST_DATA]), true);
        assert!(stops_the_listed_locomotive(desk), "{other}");
    }
}

#[test]
fn another_file_that_comes_first_is_not_taken_for_the_list() {
    for other in [OTHER_FILE, ""] {
        let mut desk = asking();
        sends(&mut desk, other);
        sends(&mut desk, LIST);
        desk.run_until(ms(3_000));
        assert_eq!(desk.client.listed_locomotives().len(), 1, "{other}");
        assert!(stops_the_listed_locomotive(desk), "{other}");
    }
}
