//! A DCC-EX board for tests: it answers what a test has it answer.

use footplate_core::TimeSpan;
use footplate_wire::Session;
use footplate_wire::dcc_ex::{Client, Settings};

use crate::desk::{Station, ms};

/// A board that answers what a table says, and nothing else.
pub(crate) struct Board {
    pub(crate) answers: Vec<(&'static str, &'static str)>,
}

impl Station for Board {
    type Written = String;
    /// The median that was measured.
    const ANSWER: TimeSpan = TimeSpan::from_us(3_400);

    fn hear(&mut self, bytes: Vec<u8>) -> (Vec<String>, Vec<Vec<u8>>) {
        let text = String::from_utf8(bytes).unwrap();
        let answer = self.answers.iter().find(|(request, _)| *request == text);
        let answer = answer.map(|(_, answer)| answer.as_bytes().to_vec());
        (vec![text], answer.into_iter().collect())
    }
}

pub(crate) type Desk = crate::desk::Desk<Client, Board>;

/// As the firmware answers when one locomotive is known to run backwards.
const ANSWERS: [(&str, &str); 15] = [
    ("<s>", "<iDCC-EX V-5.6.0 / MEGA / STANDARD_MOTOR_SHIELD G-x>\n<p0 A>\n<p0 B>\n<p0>\n"),
    ("<Q>", "<q 0>\n<Q 3>\n<q 5>\n"),
    ("<T>", "<H 7 0>\n<H 9 1>\n"),
    ("<1 MAIN>", "<p1 A>\n<p0 B>\n<p1 MAIN>\n"),
    ("<0>", "<p0 A>\n<p0 B>\n<p0>\n"),
    ("<#>", "<# 50>\n"),
    ("<t 24>", "<l 24 0 0 0>\n"),
    ("<t 58>", "<l 58 -1 128 0>\n"),
    ("<t 24 72 0>", "<l 24 0 73 0>\n"),
    ("<t 24 0 0>", "<l 24 0 0 0>\n"),
    ("<t 24 0 1>", "<l 24 0 128 0>\n"),
    ("<t 24 72 1>", "<l 24 0 201 0>\n"),
    ("<t 58 81 1>", "<l 58 1 210 0>\n"),
    ("<t 58 81 0>", "<l 58 1 82 0>\n"),
    ("<t 58 0 1>", "<l 58 1 128 0>\n"),
];

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        Self::with(Client::new(ms(0), settings), Board { answers: ANSWERS.to_vec() })
    }

    pub(crate) fn opened() -> Self {
        let mut desk = Self::new(Settings::default());
        desk.run_until(ms(1_000));
        desk.written.clear();
        desk
    }

    pub(crate) fn hear(&mut self, text: &str) {
        self.client.handle_bytes(self.now, text.as_bytes());
    }

    pub(crate) fn texts(&self) -> Vec<&str> {
        self.written.iter().map(|(_, text)| text.as_str()).collect()
    }
}
