//! Any bytes on the 6051's line: every one is used once, and what is understood can be said again as it came.

use footplate_wire::marklin_serial::{Message, decode_reply};

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut ahead = bytes;
    while let Some((message, rest)) = Message::decode(ahead) {
        let heard = &ahead[..ahead.len() - rest.len()];
        assert!(!heard.is_empty(), "a message without bytes would never end");
        if let Ok(frame) = message.encode() {
            assert_eq!(frame.as_bytes(), heard);
        }
        // What follows may be the reply, or noise of any length.
        if let Ok(states) = decode_reply(message, rest) {
            let written: Vec<u8> =
                states.flat_map(footplate_wire::marklin_serial::ModuleState::encode).collect();
            assert_eq!(written, rest);
        }
        ahead = rest;
    }
    assert!(ahead.len() < 2, "only a first byte may be left waiting for its second");
}
