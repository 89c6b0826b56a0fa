//! A motion from one speed to another over a distance in a time, with lower limits on parts of it.
//!
//! Letters: `V` the speed kept where there is no limit, `c` the limit of a part. The speed is `min(V, c)`. A change
//! to a lower speed ends where the limited part starts; a change to a higher speed starts where it ends. The duration
//! falls as `V` grows, so that bisection finds the `V` for a given time.

use crate::kinematics::{Motion, MotionState, SpeedChange, SpeedLaw};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// Duration of a change of speed (s): as long as a change by several steps.
const CHANGE: f64 = 2.0;
/// Parts distinguished, with changes between them and at both ends: two zones, and the parts before, between and
/// behind them. A path with more parts runs at its lowest limit throughout.
const MAX_PARTS: usize = 5;
const MAX_PIECES: usize = 2 * MAX_PARTS + 1;
/// Points at which a motion is checked: every quarter of a second of a minute.
const SAMPLES: u16 = 240;
/// Enough bisections for a thousandth of a mm/s.
const HALVINGS: usize = 20;

/// A part of the path (m from its start) with its speed limit (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlowPart {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) speed: f64,
}

impl SlowPart {
    /// The same part measured from the train, for one measured back from a target that is `left` ahead.
    pub(super) fn before(self, left: f64) -> Self {
        Self { from: left - self.from, to: left - self.to, ..self }
    }

    /// Whether a motion keeps the limit.
    pub(super) fn allows(&self, motion: &dyn Motion) -> bool {
        let seconds = motion.duration().as_s();
        (0..=SAMPLES).all(|nth| {
            let state = motion.state_at(TimeSpan::from_s(seconds * f64::from(nth) / f64::from(SAMPLES)));
            let place = state.distance.as_m();
            place < self.from || place > self.to || state.speed.as_m_per_s() <= self.speed
        })
    }
}

/// A change of speed, or none, from a time (s) and a place (m) on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Piece {
    time: f64,
    place: f64,
    lasts: f64,
    speeds: [f64; 2],
}

/// A sequence of constant speeds and the changes between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ZonedTransit {
    /// Initial speed (m/s).
    from: f64,
    /// The duration of each piece (s) and its final speed (m/s), in seven digits, micrometres of path, to keep the
    /// plan small.
    pieces: [[f32; 2]; MAX_PIECES],
    count: usize,
}

/// A length with the speed kept on it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Level {
    length: f64,
    speed: f64,
}

impl ZonedTransit {
    /// A motion over a distance (m) between two speeds (m/s) in a time (s), with speeds between two bounds where
    /// parts allow it. `None` if no speed takes the time, or with too many pieces.
    pub(super) fn new(
        distance: f64,
        ends: [f64; 2],
        time: f64,
        [slowest, fastest]: [f64; 2],
        parts: &[SlowPart],
    ) -> Option<Self> {
        let at = |speed: f64| Self::at_speed(distance, ends, speed, parts);
        let takes = |transit: &Self| transit.duration().as_s();
        let (mut low, mut high) = (slowest, fastest);
        if takes(&at(high)?) > time || takes(&at(low)?) < time {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if takes(&at(middle)?) > time { low = middle } else { high = middle }
        }
        at(high)
    }

    /// The motion with one speed outside the limited parts.
    fn at_speed(distance: f64, ends: [f64; 2], speed: f64, parts: &[SlowPart]) -> Option<Self> {
        let mut levels = [Level::default(); MAX_PARTS];
        let count = levels_of(distance, speed, parts, &mut levels).unwrap_or_else(|| {
            let slowest = parts.iter().map(|part| part.speed).fold(speed, f64::min);
            levels = [Level { length: distance, speed: slowest }; MAX_PARTS];
            1
        });
        let levels = levels.get_mut(..count)?;
        while let Some((nth, lower)) = too_short(levels, ends) {
            levels.get_mut(nth)?.speed = lower;
        }
        let mut transit = Self { from: ends[0], pieces: [[0.0; 2]; MAX_PIECES], count: 0 };
        let mut speed = ends[0];
        for (nth, level) in levels.iter().enumerate() {
            let next = levels.get(nth + 1).map_or(ends[1], |next| next.speed);
            let is_last = nth + 1 == levels.len();
            let rises = change_distance(speed, level.speed);
            let falls = if is_last || next < level.speed { change_distance(level.speed, next) } else { 0.0 };
            // A part too short for its changes runs through them in proportion.
            let scale = (level.length / (rises + falls).max(f64::MIN_POSITIVE)).min(1.0);
            transit.push(speed, level.speed, rises * scale)?;
            transit.push(level.speed, level.speed, level.length - (rises + falls) * scale)?;
            speed = level.speed;
            if falls > 0.0 {
                transit.push(level.speed, next, falls * scale)?;
                speed = next;
            }
        }
        Some(transit)
    }

    /// Adds a piece over a distance (m), from the speed reached before.
    fn push(&mut self, from: f64, to: f64, distance: f64) -> Option<()> {
        if distance <= 0.0 {
            return Some(());
        }
        *self.pieces.get_mut(self.count)? = [2.0 * distance / (from + to), to].map(|number| number as f32);
        self.count += 1;
        Some(())
    }

    fn pieces(&self) -> impl Iterator<Item = Piece> {
        let begin = Piece { speeds: [self.from; 2], ..Piece::default() };
        self.pieces.iter().take(self.count).scan(begin, |before, piece| {
            let [lasts, to] = piece.map(f64::from);
            let (time, place) = before.end();
            let [_, from] = before.speeds;
            *before = Piece { time, place, lasts, speeds: [from, to] };
            Some(*before)
        })
    }

    /// The last piece that satisfies a condition, or the first of all.
    fn piece(&self, begins_by: impl Fn(&Piece) -> bool) -> Option<Piece> {
        self.pieces().filter(begins_by).last().or(self.pieces().next())
    }

    /// When and where it ends.
    fn end(&self) -> (f64, f64) {
        self.pieces().last().map_or((0.0, 0.0), |last| last.end())
    }
}

impl Piece {
    /// When and where it ends.
    fn end(&self) -> (f64, f64) {
        let [from, to] = self.speeds;
        (self.time + self.lasts, self.place + 0.5 * (from + to) * self.lasts)
    }

    fn change(&self) -> SpeedChange<'static> {
        let [from, to] = self.speeds.map(Speed::from_m_per_s);
        SpeedLaw::Smooth.between(from, to, TimeSpan::from_s(self.lasts))
    }
}

impl Motion for ZonedTransit {
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let seconds = time.as_s();
        let Some(piece) = self.piece(|piece| piece.time <= seconds) else { return MotionState::default() };
        let state = piece.change().state_at(time - TimeSpan::from_s(piece.time));
        MotionState { distance: state.distance + Length::from_m(piece.place), ..state }
    }

    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let place = distance.as_m();
        let piece = self.piece(|piece| piece.place <= place)?;
        let since = piece.change().time_at(distance - Length::from_m(piece.place))?;
        Some(TimeSpan::from_s(piece.time) + since)
    }

    fn duration(&self) -> TimeSpan {
        TimeSpan::from_s(self.end().0)
    }

    fn distance(&self) -> Length {
        Length::from_m(self.end().1)
    }
}

/// The distance of a change: any symmetric law covers the mean speed times its duration.
fn change_distance(from: f64, to: f64) -> f64 {
    if from == to { 0.0 } else { 0.5 * (from + to) * CHANGE }
}

/// The parts of constant speed, in order; returns how many.
fn levels_of(distance: f64, speed: f64, parts: &[SlowPart], levels: &mut [Level]) -> Option<usize> {
    let (mut at, mut count) = (0.0, 0);
    while at < distance {
        let here = parts.iter().filter(|part| part.from <= at && part.to > at);
        let level = here.map(|part| part.speed).fold(speed, f64::min);
        let bounds = parts.iter().flat_map(|part| [part.from, part.to]);
        let until = bounds.filter(|bound| *bound > at).fold(distance, f64::min);
        match levels.get_mut(..count).and_then(|known| known.last_mut()) {
            Some(last) if last.speed == level => last.length += until - at,
            _ => {
                *levels.get_mut(count)? = Level { length: until - at, speed: level };
                count += 1;
            }
        }
        at = until;
    }
    (count > 0).then_some(count)
}

/// A part too short to reach its speed and leave it again, and the speed to run it at instead.
fn too_short(levels: &[Level], ends: [f64; 2]) -> Option<(usize, f64)> {
    levels.iter().enumerate().find_map(|(nth, level)| {
        let before =
            nth.checked_sub(1).and_then(|nth| levels.get(nth)).map_or(ends[0], |before| before.speed);
        let next = levels.get(nth + 1).map_or(ends[1], |next| next.speed);
        let beside = before.max(next);
        let falls = if next < level.speed { change_distance(level.speed, next) } else { 0.0 };
        let is_short = level.length < change_distance(before.min(level.speed), level.speed) + falls;
        (is_short && beside < level.speed).then_some((nth, beside))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALL: SlowPart = SlowPart { from: 2.0, to: 3.0, speed: 0.2 };

    fn transit(time: f64, parts: &[SlowPart]) -> Option<ZonedTransit> {
        ZonedTransit::new(6.0, [0.25, 0.15], time, [0.05, 0.5], parts)
    }

    #[test]
    fn it_covers_the_distance_in_the_time_and_keeps_the_limits() {
        for time in [22.0, 25.0, 35.0, 60.0] {
            let transit = transit(time, &[HALL]).expect("time enough");
            assert!((transit.duration().as_s() - time).abs() < 0.01, "{time}: {:?}", transit.duration());
            assert!((transit.distance().as_m() - 6.0).abs() < 1e-5);
            let end = transit.state_at(transit.duration());
            assert!((end.speed.as_m_per_s() - 0.15).abs() < 1e-6 && (end.distance.as_m() - 6.0).abs() < 1e-5);
            let mut before = MotionState::default();
            for tenth in 0..(10.0 * time) as u32 {
                let state = transit.state_at(TimeSpan::from_s(0.1 * f64::from(tenth)));
                let (place, speed) = (state.distance.as_m(), state.speed.as_m_per_s());
                assert!(
                    !(2.001..2.999).contains(&place) || speed <= 0.2 + 1e-6,
                    "{time}: {speed} at {place}"
                );
                assert!(state.distance >= before.distance, "{time}");
                let at = transit.time_at(state.distance).expect("on the distance");
                assert!((transit.state_at(at).distance - state.distance).abs() < Length::from_mm(0.01));
                before = state;
            }
        }
    }

    #[test]
    fn the_shortest_time_includes_the_slow_part() {
        // By hand at 0.5 m/s: 0.75 m in 2 s, 0.55 m at 0.5 m/s, 0.7 m in 2 s, 1 m at 0.2 m/s, 0.7 m in 2 s, 1.65 m at
        // 0.5 m/s and 0.65 m in 2 s make 17.4 s.
        assert!(transit(17.3, &[HALL]).is_none());
        assert!(transit(17.5, &[HALL]).is_some());
        // Without the limit, 4.2 s less: 0.75 and 0.65 m in 2 s each, 4.6 m at 0.5 m/s.
        assert!(transit(13.3, &[]).is_some() && transit(13.1, &[]).is_none());
    }

    #[test]
    fn a_gap_too_short_to_accelerate_in_is_run_at_the_lower_limit() {
        let next = SlowPart { from: 3.3, to: 4.0, speed: 0.15 };
        let transit = transit(24.0, &[HALL, next]).expect("time enough");
        let between = transit.time_at(Length::from_m(3.1)).expect("on the distance");
        assert!((transit.state_at(between).speed.as_m_per_s() - 0.2).abs() < 0.051);
    }

    #[test]
    fn a_limit_holds_within_its_part_and_nowhere_else() {
        // A change from 0.1 to 0.5 m/s within 4 s, 1.2 m: at 0.3 m/s after 0.4 m, at 0.4 m/s after 0.75 m.
        let motion = SpeedLaw::ConstantAcceleration.between(
            Speed::from_m_per_s(0.1),
            Speed::from_m_per_s(0.5),
            TimeSpan::from_s(4.0),
        );
        let allows = |from: f64, to: f64, speed: f64| SlowPart { from, to, speed }.allows(&motion);
        assert!(allows(0.0, 1.2, 0.501) && !allows(0.0, 1.2, 0.49));
        assert!(allows(0.0, 0.39, 0.3) && !allows(0.0, 0.42, 0.3));
        assert!(!allows(0.3, 0.42, 0.3) && allows(0.3, 0.39, 0.3));
        assert!(!allows(0.75, 1.0, 0.39) && allows(1.3, 2.0, 0.1) && allows(-1.0, -0.1, 0.0));
        let part = SlowPart { from: 2.0, to: 1.5, speed: 0.2 }.before(5.0);
        assert_eq!((part.from, part.to, part.speed), (3.0, 3.5, 0.2));
    }

    #[test]
    fn pieces_between_levels_are_worked_out_by_hand() {
        // 2 s from 0.25 to 0.4 m/s and 2 s to 0.15 m/s, 0.65 and 0.55 m; the other 4.8 m at 0.4 m/s take 12 s.
        let fast = ZonedTransit::at_speed(6.0, [0.25, 0.15], 0.4, &[]).expect("few parts");
        assert!((fast.duration().as_s() - 16.0).abs() < 1e-5, "{:?}", fast.duration());
        for (time, distance, speed) in
            [(0.0, 0.0, 0.25), (2.0, 0.65, 0.4), (8.0, 3.05, 0.4), (14.0, 5.45, 0.4), (16.0, 6.0, 0.15)]
        {
            let state = fast.state_at(TimeSpan::from_s(time));
            assert!((state.distance.as_m() - distance).abs() < 1e-5, "{time}: {state:?}");
            assert!((state.speed.as_m_per_s() - speed).abs() < 1e-5, "{time}: {state:?}");
        }
    }
}
