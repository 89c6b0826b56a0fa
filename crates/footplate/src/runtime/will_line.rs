//! A line over which a last will is sent, and how it is sent: again and again until the station has shown that it heard it.

use std::time::Duration;

use crate::link::Lost;

/// A last will repeats every stop within this time (the slowest, of JMRI, every 500 ms): a station that is heard so long before the end
/// of it receives them all.
const ROUND: Duration = Duration::from_secs(1);

/// Between two attempts to open a line again.
const REOPEN_EVERY: Duration = Duration::from_millis(250);
/// How long a byte waits for the handshake. After that it is sent all the same.
const HAND_SHAKE_WITHIN: Duration = Duration::from_millis(100);
/// How often the handshake line is read meanwhile.
const HAND_SHAKE_EVERY: Duration = Duration::from_micros(500);
/// How long the handshake line may take to go down after a byte; before that, "up" means nothing.
const HAND_SHAKE_FALLS: Duration = Duration::from_millis(10);

/// A line over which a last will is sent.
pub(crate) trait WillLine {
    fn is_open(&self) -> bool;

    /// Opens it, anew if it is open.
    fn open(&mut self) -> Result<(), Lost>;

    /// Closes it, because it is gone.
    fn close(&mut self);

    /// Puts bytes on the line now.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost>;

    /// The station's hand-shake line; `None` where there is none that could be read.
    fn cts(&self) -> Option<bool>;

    fn pause(&mut self, span: Duration);

    /// Whether the station has answered anything since [`expect_answer`](Self::expect_answer); `true` for one that does not answer
    /// commands.
    fn has_answered(&self) -> bool;

    fn expect_answer(&mut self);

    /// Whether a person does not want to wait any longer.
    fn gives_up(&self) -> bool;

    fn say(&self, words: &str);
}

/// Sends a last will. Starts again each time the line has to be reopened, and until the station has shown that it heard all of it, or a
/// person gives up; it is tried at least once. Returns whether it was sent.
pub(crate) fn carry_out(line: &mut impl WillLine, will: &[u8]) -> bool {
    let mut was_gone = false;
    loop {
        let said = if line.is_open() { Ok(()) } else { line.open() };
        if said.is_ok() && std::mem::take(&mut was_gone) {
            line.say("the line is open again");
        }
        match said.and_then(|()| try_to_carry_out(line, will)) {
            Ok(Answer::InTime) => return true,
            // The line stays open: a board that starts anew whenever it is opened would never be heard in time.
            Ok(Answer::OutOfTime) => line.say("the station may not have heard all of it; sending it again"),
            Err(lost) => {
                if !was_gone {
                    line.say(&format!(
                        "{lost}; trying for ever (Ctrl-C gives up, and leaves trains running)"
                    ));
                }
                was_gone = true;
                line.close();
            }
        }
        line.pause(REOPEN_EVERY);
        if line.gives_up() {
            return false;
        }
    }
}

/// When a station was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// While every stop was yet to be repeated.
    InTime,
    /// Only at the beginning, which may answer what came before, or at the end, which it may have said of itself.
    OutOfTime,
}

fn try_to_carry_out(line: &mut impl WillLine, will: &[u8]) -> Result<Answer, Lost> {
    line.expect_answer();
    let whole: Duration = Parts(will).map(|(pause, _)| pause).sum();
    let is_long = whole > 2 * ROUND;
    let (mut elapsed, mut at_first, mut in_time) = (Duration::ZERO, None, None);
    for (pause, bytes) in Parts(will) {
        line.pause(pause);
        elapsed += pause;
        if is_long && elapsed >= ROUND && at_first.is_none() {
            at_first = Some(line.has_answered());
            line.expect_answer();
        }
        if is_long && elapsed + ROUND > whole {
            in_time.get_or_insert_with(|| line.has_answered());
        }
        await_hand_shake(line);
        line.write(bytes)?;
    }
    // A line that went during the last bytes did not carry them.
    line.pause(REOPEN_EVERY);
    if !line.is_open() {
        return Err(Lost("the line is gone".to_owned()));
    }
    // Datagrams vanish without notice, and so do bytes on a connection whose other end is gone.
    let at_last = line.has_answered();
    match in_time.unwrap_or(at_last) {
        true => Ok(Answer::InTime),
        false if at_first == Some(true) || at_last => Ok(Answer::OutOfTime),
        false => Err(Lost("the station does not answer".to_owned())),
    }
}

/// The parts of a last will that was [`written`]: the pause before each, and its bytes.
struct Parts<'w>(&'w [u8]);

impl<'w> Iterator for Parts<'w> {
    type Item = (Duration, &'w [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let [a, b, c, d, low, high, more @ ..] = self.0 else { return None };
        let pause = u32::from_le_bytes([*a, *b, *c, *d]);
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let (bytes, rest) = more.split_at_checked(length).unwrap_or((more, &[]));
        self.0 = rest;
        Some((Duration::from_micros(pause.into()), bytes))
    }
}

/// Waits until the station takes the next byte, where its hand-shake line can be read.
fn await_hand_shake(line: &mut impl WillLine) {
    let mut waited = Duration::ZERO;
    while line.cts() == Some(true) && waited < HAND_SHAKE_FALLS {
        line.pause(HAND_SHAKE_EVERY);
        waited += HAND_SHAKE_EVERY;
    }
    while line.cts() == Some(false) && waited < HAND_SHAKE_WITHIN {
        line.pause(HAND_SHAKE_EVERY);
        waited += HAND_SHAKE_EVERY;
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::TimeSpan;

    use super::*;
    use crate::link::Bequest;
    use crate::runtime::written;

    /// A line that is open from its nth attempt on, and a person who does not wait.
    struct Impatient {
        opens_after: usize,
        attempts: usize,
        written: Vec<u8>,
    }

    impl WillLine for Impatient {
        fn is_open(&self) -> bool {
            self.attempts > self.opens_after
        }
        fn open(&mut self) -> Result<(), Lost> {
            self.attempts += 1;
            if self.is_open() { Ok(()) } else { Err(Lost("it is gone".to_owned())) }
        }
        fn close(&mut self) {}
        fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
            self.written.extend(bytes);
            Ok(())
        }
        fn cts(&self) -> Option<bool> {
            None
        }
        fn pause(&mut self, _: Duration) {}
        fn has_answered(&self) -> bool {
            true
        }
        fn expect_answer(&mut self) {}
        fn gives_up(&self) -> bool {
            true
        }
        fn say(&self, _: &str) {}
    }

    #[test]
    fn a_will_is_tried_once_even_if_a_person_gives_up() {
        let will = written(&[Bequest { after: TimeSpan::ZERO, bytes: b"stop".to_vec() }], 1.0);
        for (opens_after, sent) in [(0, true), (1, false)] {
            let mut line = Impatient { opens_after, attempts: 0, written: Vec::new() };
            assert_eq!(carry_out(&mut line, &will), sent);
            assert_eq!((line.attempts, line.written == b"stop"), (1, sent));
        }
    }

    /// A line whose station is reached from a time on, and then says something of itself.
    struct CutOff {
        back: Duration,
        /// When something is heard that was sent before the line was cut.
        in_flight: Option<Duration>,
        now: Duration,
        heard: bool,
        arrived: Vec<Duration>,
        closes: usize,
    }

    impl WillLine for CutOff {
        fn is_open(&self) -> bool {
            true
        }
        fn open(&mut self) -> Result<(), Lost> {
            Ok(())
        }
        fn close(&mut self) {
            self.closes += 1;
        }
        fn write(&mut self, _: &[u8]) -> Result<(), Lost> {
            if self.now >= self.back {
                self.arrived.push(self.now);
            }
            Ok(())
        }
        fn cts(&self) -> Option<bool> {
            None
        }
        fn pause(&mut self, span: Duration) {
            self.now += span;
            let now = self.now;
            self.heard |= now > self.back || self.in_flight.take_if(|at| *at <= now).is_some();
        }
        fn has_answered(&self) -> bool {
            self.heard
        }
        fn expect_answer(&mut self) {
            self.heard = false;
        }
        fn gives_up(&self) -> bool {
            false
        }
        fn say(&self, _: &str) {}
    }

    #[test]
    fn a_station_that_may_not_have_heard_the_last_stop_is_stopped_again() {
        // A stop every 100 ms for 5 s, as a session writes it on a line without answers.
        let stop = |nth: i64| Bequest { after: TimeSpan::from_ms(100 * nth.min(1)), bytes: b"stop".to_vec() };
        let will = written(&(0..=50).map(stop).collect::<Vec<_>>(), 1.0);
        // When the line is back, whether something was sent before it was cut, when the end comes, and how often the line is closed.
        let cases = [
            (0, false, 5_250, 0),
            (3_900, false, 5_250, 0),
            (4_100, false, 10_750, 0),
            (5_100, false, 10_750, 0),
            (5_600, true, 10_750, 0),
            (5_600, false, 10_750, 1),
        ];
        for (back_ms, is_in_flight, ends_ms, closes) in cases {
            let back = Duration::from_millis(back_ms);
            let in_flight = is_in_flight.then_some(Duration::from_millis(5));
            let mut line =
                CutOff { back, in_flight, now: Duration::ZERO, heard: false, arrived: Vec::new(), closes: 0 };
            assert!(carry_out(&mut line, &will));
            assert_eq!(
                (line.now, line.closes),
                (Duration::from_millis(ends_ms), closes),
                "back after {back_ms} ms"
            );
            let first = *line.arrived.first().expect("a stop");
            assert!(first - back <= Duration::from_millis(500), "{first:?}");
            assert!(line.arrived.len() >= 10, "{}", line.arrived.len());
        }
    }
}
