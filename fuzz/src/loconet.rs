//! Any bytes in the place of a LocoNet server's lines: nothing panics, memory is bounded, and what is understood can be written again.

use footplate_wire::loconet::{LONGEST_LINE, Line, Lines, Message};

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut lines = Lines::default();
    for byte in bytes {
        let Some(text) = lines.push(*byte) else { continue };
        assert!(text.len() <= LONGEST_LINE);
        if let Ok(Line::Receive(message)) = Line::read(text)
            && !matches!(message, Message::Other { .. })
        {
            assert_eq!(Line::read(Line::Receive(message).text().trim_end()), Ok(Line::Receive(message)));
        }
    }
    if let Ok(message) = Message::decode(bytes)
        && !matches!(message, Message::Other { .. })
    {
        assert_eq!(Message::decode(&message.encode()), Ok(message));
    }
}
