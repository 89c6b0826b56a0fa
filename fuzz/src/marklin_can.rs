//! Any bytes on the line of a Märklin CAN bus: none is kept for ever, and what is understood can be written again.

use footplate_wire::marklin_can::{Frame, Framing, Message, Transport, read_list};

pub(crate) fn fuzz(bytes: &[u8]) {
    for transport in [Transport::Network, Transport::Adapter] {
        let mut framing = Framing::new(transport);
        for byte in bytes {
            let Some(frame) = framing.push(*byte) else { continue };
            assert_eq!(Frame::decode(frame.encode()), Some(frame));
            assert_eq!(Frame::of_text(&frame.to_text()), Some(frame));
            let message = Message::of(&frame);
            assert_eq!(Message::of(&message.frame(frame.is_response, frame.hash)), message);
        }
        assert!(framing.take_unread() <= bytes.len());
    }
    let _ = read_list(bytes);
}
