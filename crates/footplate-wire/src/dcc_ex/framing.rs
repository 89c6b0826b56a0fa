//! Finds the messages between `<` and `>` in a stream of bytes, whatever portions it arrives in.

use alloc::vec::Vec;

/// The longest message that is read, without its brackets. Replies of the firmware stay below 100 characters but for names of
/// turnouts and routes that a person has given; a longer one is taken for noise.
pub const LONGEST_MESSAGE: usize = 256;

/// The longest diagnostic text (`<* … *>`) that is skipped as one; after that its end is taken for lost. The firmware writes
/// at most a few lines at once.
pub const LONGEST_DIAGNOSTIC: usize = 1024;

/// Cuts a stream into messages. Text outside the brackets and diagnostic text are skipped; memory is bounded.
#[derive(Debug, Clone, Default)]
pub struct Framing {
    place: Place,
    text: Vec<u8>,
    unread: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Place {
    #[default]
    Outside,
    Message,
    Diagnostic {
        length: usize,
        ends_with_star: bool,
    },
}

impl Framing {
    /// Takes the next byte; returns what stood between the brackets when it completes a message.
    pub fn push(&mut self, byte: u8) -> Option<&str> {
        match self.place {
            Place::Outside if byte == b'<' => self.begin(),
            Place::Outside => {
                self.unread = self.unread.saturating_add(usize::from(!byte.is_ascii_whitespace()));
            }
            Place::Message if byte == b'>' => {
                self.place = Place::Outside;
                if core::str::from_utf8(&self.text).is_err() {
                    self.drop_text();
                }
                return core::str::from_utf8(&self.text).ok().filter(|text| !text.is_empty());
            }
            Place::Message if byte == b'<' => {
                // The end of the message before was lost.
                self.drop_text();
                self.begin();
            }
            Place::Message if byte == b'*' && self.text.is_empty() => {
                self.place = Place::Diagnostic { length: 1, ends_with_star: true };
            }
            Place::Message if self.text.len() >= LONGEST_MESSAGE => {
                self.drop_text();
                self.place = Place::Outside;
            }
            Place::Message => self.text.push(byte),
            Place::Diagnostic { ends_with_star: true, .. } if byte == b'>' => self.place = Place::Outside,
            Place::Diagnostic { length, .. } if length >= LONGEST_DIAGNOSTIC => {
                self.unread = self.unread.saturating_add(length);
                self.place = Place::Outside;
            }
            Place::Diagnostic { length, .. } => {
                self.place = Place::Diagnostic { length: length + 1, ends_with_star: byte == b'*' };
            }
        }
        None
    }

    /// The bytes since the last call that belong to no message: printable text outside brackets, messages without an end, and
    /// what is too long to be one.
    pub const fn take_unread(&mut self) -> usize {
        core::mem::replace(&mut self.unread, 0)
    }

    fn begin(&mut self) {
        self.text.clear();
        self.place = Place::Message;
    }

    fn drop_text(&mut self) {
        self.unread = self.unread.saturating_add(self.text.len());
        self.text.clear();
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::{String, ToString};

    use super::*;

    fn read(bytes: &[u8]) -> (Vec<String>, usize) {
        let mut framing = Framing::default();
        let mut read = Vec::new();
        for byte in bytes {
            read.extend(framing.push(*byte).map(ToString::to_string));
        }
        (read, framing.take_unread())
    }

    #[test]
    fn messages_are_found_between_other_text() {
        assert_eq!(
            read(b"<p1 A>\r\n<Q 5>boot<q 5>\n"),
            (alloc::vec!["p1 A".into(), "Q 5".into(), "q 5".into()], 4)
        );
        assert_eq!(read(b"<* WiFi <ok> \n on *><Q 5>"), (alloc::vec!["Q 5".into()], 0));
    }

    #[test]
    fn a_message_that_was_cut_off_does_not_swallow_the_next() {
        assert_eq!(read(b"<l 24 0 1<Q 5>"), (alloc::vec!["Q 5".into()], 8));
        assert_eq!(read(b"<Q \xff5><q 5><>"), (alloc::vec!["q 5".into()], 4));
    }

    #[test]
    fn what_has_no_end_is_given_up() {
        let long =
            [b'<'].into_iter().chain([b'x'; 2 * LONGEST_MESSAGE]).chain(*b"<Q 5>").collect::<Vec<u8>>();
        let (messages, unread) = read(&long);
        assert_eq!(messages, ["Q 5"]);
        assert!(unread >= 2 * LONGEST_MESSAGE - 1, "{unread}");
        let open =
            b"<* ".iter().copied().chain([b'x'; LONGEST_DIAGNOSTIC]).chain(*b"<Q 5>").collect::<Vec<u8>>();
        assert_eq!(read(&open).0, ["Q 5"]);
    }
}
