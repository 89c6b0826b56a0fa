//! Any bytes on the line of a DCC-EX board: none is kept for ever, and what is understood can be written again.

use footplate_wire::dcc_ex::{Framing, LONGEST_MESSAGE, Reply, Request};

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut framing = Framing::default();
    let mut read = 0;
    for byte in bytes {
        let Some(text) = framing.push(*byte) else { continue };
        assert!(text.len() <= LONGEST_MESSAGE);
        read += text.len();
        if let Some(request) = Request::read(text) {
            assert_eq!(again(&request.to_string(), Request::read), Some(request));
        }
        if let Ok(Some(reply)) = Reply::read(text) {
            assert_eq!(again(&reply.to_string(), |text| Reply::read(text).ok().flatten()), Some(reply));
        }
    }
    assert!(read + framing.take_unread() <= bytes.len());
}

/// Reads a message that was written.
fn again<M>(text: &str, read: impl Fn(&str) -> Option<M>) -> Option<M> {
    let mut framing = Framing::default();
    text.bytes().find_map(|byte| framing.push(byte).and_then(&read))
}
