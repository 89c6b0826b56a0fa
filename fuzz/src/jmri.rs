//! Any bytes in the place of JMRI's messages: nothing panics, what is understood can be written again, and the session goes on.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::jmri::{Client, LONGEST_LINE, Lines, Reply, Request, Settings};
use footplate_wire::{Session, Transmit};

/// Between two bytes.
const STEP: TimeSpan = TimeSpan::from_us(500);

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut lines = Lines::default();
    for byte in bytes {
        let Some(text) = lines.push(*byte) else { continue };
        assert!(text.len() <= LONGEST_LINE);
        if let Ok(Some(reply)) = Reply::read(text) {
            assert_eq!(Reply::read(&reply.text()), Ok(Some(reply)));
        }
        if let Ok(Some(request)) = Request::read(text) {
            assert_eq!(Request::read(&request.text()), Ok(Some(request)));
        }
    }
    let (mut client, mut now) = (Client::new(Timestamp::ZERO, Settings::default()), Timestamp::ZERO);
    for byte in bytes {
        now += STEP;
        client.handle_bytes(now, &[*byte]);
        while let Some(output) = client.poll_output() {
            if let Transmit::Message(text) = output {
                let text = String::from_utf8(text).expect("text");
                assert!(matches!(Request::read(&text), Ok(Some(_))), "{text}");
            }
        }
    }
    client.close(now);
    assert!(client.next_timeout().is_none_or(|next| next > now), "a session that is never done");
}
