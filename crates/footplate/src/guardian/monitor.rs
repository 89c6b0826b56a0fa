//! What a guardian decides about its child. It has no thread, no clock and no socket, so that chaos can simulate a guardian
//! among everything that fails.

use footplate_core::{TimeSpan, Timestamp};

use super::frame::{Frame, MOST_BYTES};

/// A child that drives trains counts as dead after this time without a frame (requirement: stops within 1 s).
pub(crate) const LATE: TimeSpan = TimeSpan::from_ms(500);
/// A child that dies sooner than this is not restarted: it would die again.
pub(super) const LONG_ENOUGH: TimeSpan = TimeSpan::from_ms(10_000);

/// What a frame of the child asks the guardian for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request<'f> {
    /// Open the line, anew if it is open; answer [`Frame::Opened`] or [`Frame::NotOpened`].
    Open,
    /// Put the bytes on the line in one piece; answer [`Frame::Lost`] if it is gone.
    Write(&'f [u8]),
    /// Answer [`Frame::Here`].
    Answer,
}

/// What a guardian does once it has no child that drives, one after the other. Stopping trains comes before it finds out how the child
/// ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step<'m> {
    /// Kill the child, which is late. It cannot write any more: only the guardian holds the line.
    Kill,
    /// Stop all trains with this last will.
    CarryOut(&'m [u8]),
    /// Wait until the child has ended.
    AwaitEnd,
}

/// What becomes of a program whose child has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    End,
    /// It would be restarted, but died too soon.
    DiedSoon,
    Restart,
}

/// How far a guardian is with its child.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Serving,
    Late,
    Left,
    CarriedOut,
    Over,
}

/// State of the present child. Its size stays the same.
#[derive(Debug)]
pub(crate) struct Monitor {
    /// The bytes that stop its trains.
    will: Vec<u8>,
    has_will: bool,
    runs: bool,
    stage: Stage,
    began: Timestamp,
    /// When the last frame had been dealt with.
    heard: Timestamp,
}

impl Monitor {
    /// The monitor of a child that was just started.
    pub(crate) fn new(now: Timestamp) -> Self {
        let will = Vec::with_capacity(MOST_BYTES);
        Self { will, has_will: false, runs: false, stage: Stage::Serving, began: now, heard: now }
    }

    /// Takes a frame. Call [`dealt`](Self::dealt) after doing what it asks for.
    pub(crate) fn hear<'f>(&mut self, frame: Frame<'f>) -> Option<Request<'f>> {
        match frame {
            Frame::Open => return Some(Request::Open),
            Frame::Write(bytes) => return Some(Request::Write(bytes)),
            Frame::Will(will) => {
                self.will.clear();
                self.will.extend_from_slice(will);
                self.has_will = true;
            }
            Frame::Alive { runs } => {
                self.runs = runs;
                return Some(Request::Answer);
            }
            Frame::Goodbye => (self.has_will, self.runs) = (false, false),
            // Only a guardian sends these.
            Frame::Opened { .. }
            | Frame::NotOpened(_)
            | Frame::Here
            | Frame::Heard(_)
            | Frame::Cts(_)
            | Frame::Lost(_) => self.closed(),
        }
        None
    }

    /// A frame has been dealt with: the time that this took is not the child's silence.
    pub(crate) const fn dealt(&mut self, now: Timestamp) {
        self.heard = now;
    }

    /// The time until which the child may be silent; `None` while no train runs.
    pub(crate) fn deadline(&self) -> Option<Timestamp> {
        (self.stage == Stage::Serving && self.runs).then(|| self.heard + LATE)
    }

    /// Nothing has arrived from the child until now.
    pub(crate) fn silent(&mut self, now: Timestamp) {
        if self.deadline().is_some_and(|deadline| now >= deadline) {
            self.stage = Stage::Late;
        }
    }

    /// Whether the child has been silent for too long.
    pub(crate) fn is_late(&self) -> bool {
        self.stage == Stage::Late
    }

    /// The child has closed its connection, or sent what is no frame.
    pub(crate) fn closed(&mut self) {
        if self.stage == Stage::Serving {
            self.stage = Stage::Left;
        }
    }

    /// Whether the child is served.
    pub(crate) fn serves(&self) -> bool {
        self.stage == Stage::Serving
    }

    /// The next thing to do without a child; `None` while it is served, and after the last.
    pub(crate) fn step(&mut self) -> Option<Step<'_>> {
        let (step, stage) = match self.stage {
            Stage::Serving | Stage::Over => return None,
            Stage::Late => (Step::Kill, Stage::Left),
            Stage::Left if self.has_will => (Step::CarryOut(&self.will), Stage::CarriedOut),
            Stage::Left | Stage::CarriedOut => (Step::AwaitEnd, Stage::Over),
        };
        self.stage = stage;
        Some(step)
    }

    /// What becomes of a program whose child has ended, if restarts are wanted. One that ended in order, or whose trains could not be
    /// commanded to stop, is not restarted.
    pub(super) fn next(&self, now: Timestamp, has_stopped_trains: bool, is_in_order: bool) -> Next {
        match has_stopped_trains && !is_in_order {
            false => Next::End,
            true if now - self.began < LONG_ENOUGH => Next::DiedSoon,
            true => Next::Restart,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(ms)
    }

    /// A child that has left its last will and heartbeats at some times.
    fn monitor(heartbeats: &[(i64, bool)]) -> Monitor {
        let mut monitor = Monitor::new(at(0));
        assert_eq!(monitor.hear(Frame::Will(b"stop")), None);
        for (ms, runs) in heartbeats {
            assert_eq!(monitor.hear(Frame::Alive { runs: *runs }), Some(Request::Answer));
            monitor.dealt(at(*ms));
        }
        monitor
    }

    fn steps(monitor: &mut Monitor) -> Vec<String> {
        let mut all = Vec::new();
        while let Some(step) = monitor.step() {
            all.push(format!("{step:?}"));
        }
        all
    }

    const STOPS: &str = "CarryOut([115, 116, 111, 112])";

    #[test]
    fn a_child_is_late_500_ms_after_its_last_frame_if_a_train_runs() {
        let mut running = monitor(&[(0, true), (100, true)]);
        assert_eq!(running.deadline(), Some(at(600)));
        running.silent(at(599));
        assert_eq!(steps(&mut running), [""; 0]);
        running.silent(at(600));
        assert_eq!(steps(&mut running), ["Kill", STOPS, "AwaitEnd"]);
        // Without a running train, it may be silent for ever; if it closes, its trains are stopped all the same.
        let mut idle = monitor(&[(0, true), (100, false)]);
        assert_eq!(idle.deadline(), None);
        idle.silent(at(1_000_000));
        assert_eq!(steps(&mut idle), [""; 0]);
        idle.closed();
        assert_eq!(steps(&mut idle), [STOPS, "AwaitEnd"]);
    }

    #[test]
    fn the_time_that_a_request_takes_is_not_silence() {
        let mut monitor = monitor(&[(0, true)]);
        assert_eq!(monitor.hear(Frame::Open), Some(Request::Open));
        monitor.dealt(at(4_000));
        monitor.silent(at(4_499));
        assert_eq!(steps(&mut monitor), [""; 0]);
        assert_eq!(monitor.hear(Frame::Write(b"x")), Some(Request::Write(b"x")));
    }

    #[test]
    fn the_newest_will_counts_and_none_after_a_goodbye() {
        let mut newer = monitor(&[]);
        newer.hear(Frame::Will(b"halt"));
        newer.closed();
        assert_eq!(steps(&mut newer), ["CarryOut([104, 97, 108, 116])", "AwaitEnd"]);
        let mut ended = monitor(&[(0, true)]);
        ended.hear(Frame::Goodbye);
        assert_eq!(ended.deadline(), None);
        ended.closed();
        assert_eq!(steps(&mut ended), ["AwaitEnd"]);
        // What only a guardian sends ends the connection.
        let mut confused = monitor(&[(0, true)]);
        assert_eq!(confused.hear(Frame::Here), None);
        assert_eq!(steps(&mut confused), [STOPS, "AwaitEnd"]);
    }

    #[test]
    fn a_program_is_restarted_if_it_ran_for_long_and_its_trains_were_stopped() {
        let monitor = monitor(&[(0, true)]);
        assert_eq!(monitor.next(at(10_000), true, false), Next::Restart);
        assert_eq!(monitor.next(at(9_999), true, false), Next::DiedSoon);
        assert_eq!(monitor.next(at(10_000), false, false), Next::End);
        assert_eq!(monitor.next(at(10_000), true, true), Next::End);
    }
}
