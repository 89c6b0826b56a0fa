//! How well standing and running were distinguished, by marked stops.

use footplate_core::Timestamp;

use super::ride::AccelerometerRide;
use super::stop_marks::StopMarks;

/// A stop or a departure within this time of a mark is the marked one (s).
const MEANT_WITHIN_S: f64 = 3.0;

/// How well standing and running were distinguished between the first marked stop and the last.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StandingScore {
    /// How long is marked (s).
    pub marked_s: f64,
    /// For how long it was wrong, as it is known afterwards (s).
    pub wrong_s: f64,
    /// For how long it was wrong as it happened, the time of watching included (s).
    pub wrong_live_s: f64,
    /// Marks, stops and departures.
    pub marks: usize,
    /// How far the marks that were found are off (s), in order of size.
    pub off_s: Vec<f64>,
    /// Hops between marked stops, those that were found, and those found that are none.
    pub hops: [usize; 3],
}

impl StandingScore {
    /// Compares a ride with marks.
    pub fn of(ride: &AccelerometerRide, marks: &StopMarks) -> Self {
        let Some([begin, end]) = marks.marked() else { return Self::default() };
        let overlap = |one: [Timestamp; 2], other: [Timestamp; 2]| {
            let [from, to] = [one[0].max(other[0]), one[1].min(other[1])];
            if from < to { (to - from).as_s() } else { 0.0 }
        };
        let whole = [begin, end];
        let said: Vec<[Timestamp; 2]> =
            ride.standing.iter().map(|stretch| [stretch.from, stretch.to]).collect();
        let both: f64 =
            said.iter().flat_map(|said| marks.stops.iter().map(|stop| overlap(*said, *stop))).sum();
        let stood: f64 = marks.stops.iter().map(|stop| overlap(*stop, whole)).sum();
        let said_to_stand: f64 = said.iter().map(|said| overlap(*said, whole)).sum();
        let stands = |time| marks.stops.iter().any(|[from, to]| (*from..*to).contains(&time));
        let live = ride.live.windows(2).map(|pair| match pair {
            [(before, _), (time, said)] if (begin..end).contains(time) && *said != stands(*time) => {
                (*time - *before).as_s()
            }
            _ => 0.0,
        });
        let near = |mark: Timestamp, time: Timestamp| (time - mark).as_s();
        let mut off_s: Vec<f64> = Vec::new();
        for [stop, start] in &marks.stops {
            let stops = said.iter().map(|[from, _]| near(*stop, *from));
            let starts = said.iter().map(|[_, to]| near(*start, *to));
            for nearest in [smallest(stops), smallest(starts)].into_iter().flatten() {
                off_s.extend((nearest <= MEANT_WITHIN_S).then_some(nearest));
            }
        }
        off_s.sort_by(f64::total_cmp);
        let is = |hop: &[[Timestamp; 2]], departure: Timestamp, arrival: Timestamp| match hop {
            [[_, left], [arrived, _]] => {
                near(*left, departure).abs() <= MEANT_WITHIN_S
                    && near(*arrived, arrival).abs() <= MEANT_WITHIN_S
            }
            _ => false,
        };
        let found = marks
            .stops
            .windows(2)
            .filter(|hop| ride.hops.iter().any(|trip| is(hop, trip.departure, trip.arrival)));
        let found = found.count();
        let within = ride.hops.iter().filter(|trip| trip.departure >= begin && trip.arrival <= end);
        let others =
            within.filter(|trip| !marks.stops.windows(2).any(|hop| is(hop, trip.departure, trip.arrival)));
        Self {
            marked_s: (end - begin).as_s(),
            wrong_s: stood + said_to_stand - 2.0 * both,
            wrong_live_s: live.sum(),
            marks: 2 * marks.stops.len(),
            off_s,
            hops: [marks.stops.len().saturating_sub(1), found, others.count()],
        }
    }

    /// For which part of the time it was right, as it is known afterwards (per cent).
    pub fn right_pct(&self) -> f64 {
        100.0 * (1.0 - self.wrong_s / self.marked_s.max(f64::MIN_POSITIVE))
    }

    /// The same as it happened.
    pub fn right_live_pct(&self) -> f64 {
        100.0 * (1.0 - self.wrong_live_s / self.marked_s.max(f64::MIN_POSITIVE))
    }

    /// How far marks that were found are off: the median and the most (s); `None` if none was found.
    pub fn off_median_and_most_s(&self) -> Option<[f64; 2]> {
        Some([*self.off_s.get(self.off_s.len() / 2)?, *self.off_s.last()?])
    }

    /// Adds that of another recording.
    pub fn merge(&mut self, other: &Self) {
        self.marked_s += other.marked_s;
        self.wrong_s += other.wrong_s;
        self.wrong_live_s += other.wrong_live_s;
        self.marks += other.marks;
        self.off_s.extend(&other.off_s);
        self.off_s.sort_by(f64::total_cmp);
        for (ours, other) in self.hops.iter_mut().zip(other.hops) {
            *ours += other;
        }
    }
}

fn smallest(times: impl Iterator<Item = f64>) -> Option<f64> {
    times.map(f64::abs).min_by(f64::total_cmp)
}
