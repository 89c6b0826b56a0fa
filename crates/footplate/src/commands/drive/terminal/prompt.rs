//! The line editor of the prompt, with a history.

use ratatui::crossterm::event::KeyCode;

/// Lines kept in the history.
const REMEMBERED: usize = 200;

/// A line with a cursor.
#[derive(Debug, Default)]
pub(super) struct Prompt {
    letters: Vec<char>,
    cursor: usize,
    before: Vec<String>,
    /// The place of the shown line in the history, counted from its end; 0 for a new line.
    back: usize,
}

impl Prompt {
    pub(super) fn text(&self) -> String {
        self.letters.iter().collect()
    }

    /// The number of characters before the cursor.
    pub(super) const fn cursor(&self) -> usize {
        self.cursor
    }

    pub(super) fn insert(&mut self, letter: char) {
        self.letters.insert(self.cursor, letter);
        self.cursor += 1;
    }

    /// Takes the finished line; `None` if it is blank.
    pub(super) fn take(&mut self) -> Option<String> {
        let line = self.text();
        self.write("");
        self.back = 0;
        if line.trim().is_empty() {
            return None;
        }
        if self.before.last() != Some(&line) {
            self.before.push(line.clone());
        }
        if self.before.len() > REMEMBERED {
            self.before.remove(0);
        }
        Some(line)
    }

    /// Handles a key that is not a character.
    pub(super) fn press(&mut self, key: KeyCode) {
        match key {
            KeyCode::Backspace if self.cursor > 0 => {
                self.cursor -= 1;
                self.letters.remove(self.cursor);
            }
            KeyCode::Delete if self.cursor < self.letters.len() => drop(self.letters.remove(self.cursor)),
            KeyCode::Left => self.cursor = self.cursor.saturating_sub(1),
            KeyCode::Right => self.cursor = (self.cursor + 1).min(self.letters.len()),
            KeyCode::Home => self.cursor = 0,
            KeyCode::End => self.cursor = self.letters.len(),
            KeyCode::Esc => self.write(""),
            KeyCode::Up => self.turn(self.back + 1),
            KeyCode::Down => self.turn(self.back.saturating_sub(1)),
            _ => {}
        }
    }

    /// Shows the line `back` places before the end of the history.
    fn turn(&mut self, back: usize) {
        let back = back.min(self.before.len());
        let line = self.before.len().checked_sub(back).and_then(|place| self.before.get(place));
        let line = line.cloned().unwrap_or_default();
        self.write(&line);
        self.back = back;
    }

    fn write(&mut self, line: &str) {
        self.letters = line.chars().collect();
        self.cursor = self.letters.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(prompt: &mut Prompt, text: &str) {
        text.chars().for_each(|letter| prompt.insert(letter));
    }

    #[test]
    fn a_line_is_edited_and_recalled() {
        let mut prompt = Prompt::default();
        write(&mut prompt, "speed ä4 8");
        for _ in 0..4 {
            prompt.press(KeyCode::Left);
        }
        prompt.press(KeyCode::Delete);
        prompt.insert('2');
        assert_eq!(prompt.take().as_deref(), Some("speed 24 8"));
        assert_eq!((prompt.text().as_str(), prompt.take()), ("", None));
        write(&mut prompt, "where");
        assert_eq!(prompt.take().as_deref(), Some("where"));
        prompt.press(KeyCode::Up);
        assert_eq!(prompt.text(), "where");
        prompt.press(KeyCode::Up);
        prompt.press(KeyCode::Up);
        assert_eq!((prompt.text().as_str(), prompt.cursor()), ("speed 24 8", 10));
        prompt.press(KeyCode::Down);
        prompt.press(KeyCode::Down);
        assert_eq!(prompt.text(), "");
    }
}
