//! Cuts a stream into lines of text.

use alloc::vec::Vec;

/// Cuts a stream into lines, whatever portions it arrives in; a line longer than `LONGEST` is taken for noise.
#[derive(Debug, Clone, Default)]
pub struct Lines<const LONGEST: usize> {
    text: Vec<u8>,
    is_too_long: bool,
    unread: usize,
}

impl<const LONGEST: usize> Lines<LONGEST> {
    /// Takes the next byte; returns the line that it ends.
    pub fn push(&mut self, byte: u8) -> Option<&str> {
        if self.is_too_long || self.text.last().is_some_and(|last| matches!(last, b'\r' | b'\n')) {
            self.text.clear();
        }
        let ends = matches!(byte, b'\r' | b'\n');
        if self.is_too_long {
            self.unread = self.unread.saturating_add(1);
            self.is_too_long = !ends;
            return None;
        }
        if !ends && self.text.len() >= LONGEST {
            self.unread = self.unread.saturating_add(self.text.len() + 1);
            self.is_too_long = true;
            return None;
        }
        self.text.push(byte);
        let (_, line) = self.text.split_last().filter(|_| ends)?;
        if line.iter().all(u8::is_ascii_whitespace) {
            return None;
        }
        let read = core::str::from_utf8(line);
        if read.is_err() {
            self.unread = self.unread.saturating_add(line.len());
        }
        read.ok()
    }

    /// The bytes since the last call that belong to no line that can be read.
    pub const fn take_unread(&mut self) -> usize {
        core::mem::replace(&mut self.unread, 0)
    }
}
