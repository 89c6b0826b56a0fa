//! Rows of any number as few enough points for a chart, without losing what stands out.
//!
//! Rows are gathered in buckets of equally many; whenever there are too many points, two buckets become one. A bucket keeps the
//! least and the greatest value of every column and the largest of every mark. So a peak of one row is still there, and a
//! bound is never drawn narrower than it was in any row.

/// How a column is drawn where several rows are one bucket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// From one extreme to the other, in the order in which they came.
    Line,
    /// At the least value.
    Low,
    /// At the greatest value.
    High,
}

/// What a bucket keeps of a column.
#[derive(Debug, Clone, Copy)]
struct Extremes {
    /// Infinite, as is `greatest`, where no row has a value.
    least: f64,
    greatest: f64,
    least_first: bool,
}

impl Extremes {
    const NONE: Self = Self { least: f64::INFINITY, greatest: f64::NEG_INFINITY, least_first: true };

    /// A value that is not finite is none.
    fn of(value: f64) -> Self {
        if value.is_finite() { Self { least: value, greatest: value, least_first: true } } else { Self::NONE }
    }

    /// Of these rows and of `later` ones.
    fn followed_by(self, later: Self) -> Self {
        let [new_least, new_greatest] = [later.least < self.least, later.greatest > self.greatest];
        Self {
            least: self.least.min(later.least),
            greatest: self.greatest.max(later.greatest),
            least_first: match (new_least, new_greatest) {
                (true, true) => later.least_first,
                (true, false) => false,
                (false, true) => true,
                (false, false) => self.least_first,
            },
        }
    }

    /// What is drawn at the bucket's beginning and end.
    fn drawn(self, shape: Shape) -> [Option<f64>; 2] {
        let Self { least, greatest, least_first } = self;
        if least > greatest {
            return [None; 2];
        }
        match shape {
            Shape::Line if least_first => [Some(least), Some(greatest)],
            Shape::Line => [Some(greatest), Some(least)],
            Shape::Low => [Some(least); 2],
            Shape::High => [Some(greatest); 2],
        }
    }
}

/// Rows in a row.
#[derive(Debug, Clone)]
struct Bucket<const COLUMNS: usize, const MARKS: usize> {
    rows: usize,
    begin: f64,
    end: f64,
    columns: [Extremes; COLUMNS],
    marks: [u8; MARKS],
}

impl<const COLUMNS: usize, const MARKS: usize> Bucket<COLUMNS, MARKS> {
    fn followed_by(&self, later: &Self) -> Self {
        let mut columns = self.columns;
        for (own, later) in columns.iter_mut().zip(later.columns) {
            *own = own.followed_by(later);
        }
        let mut marks = self.marks;
        for (own, later) in marks.iter_mut().zip(later.marks) {
            *own = (*own).max(later);
        }
        Self { rows: self.rows + later.rows, begin: self.begin, end: later.end, columns, marks }
    }
}

/// A stretch of time over which a mark stays the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) mark: u8,
}

/// Rows of any number, as at most so many points.
#[derive(Debug, Clone)]
pub(super) struct Decimated<const COLUMNS: usize, const MARKS: usize> {
    most_points: usize,
    rows_a_bucket: usize,
    buckets: Vec<Bucket<COLUMNS, MARKS>>,
}

impl<const COLUMNS: usize, const MARKS: usize> Decimated<COLUMNS, MARKS> {
    pub(super) const fn new(most_points: usize) -> Self {
        Self { most_points, rows_a_bucket: 1, buckets: Vec::new() }
    }

    /// Takes in a row. Times never decrease; the larger a mark is, the more it matters.
    pub(super) fn push(&mut self, time: f64, columns: [f64; COLUMNS], marks: [u8; MARKS]) {
        let row = Bucket { rows: 1, begin: time, end: time, columns: columns.map(Extremes::of), marks };
        match self.buckets.last_mut() {
            Some(last) if last.rows < self.rows_a_bucket => *last = last.followed_by(&row),
            _ => self.buckets.push(row),
        }
        self.thin();
    }

    /// The same in at most so many points.
    pub(super) fn thinned(&self, most_points: usize) -> Self {
        let mut thinned = Self { most_points: most_points.min(self.most_points), ..self.clone() };
        thinned.thin();
        thinned
    }

    fn thin(&mut self) {
        // Two points are the fewest that two ends can have.
        while self.points() > self.most_points.max(2) {
            let pairs = self.buckets.chunks(2).filter_map(|pair| {
                let (first, rest) = pair.split_first()?;
                Some(rest.iter().fold(first.clone(), |first, later| first.followed_by(later)))
            });
            self.buckets = pairs.collect();
            self.rows_a_bucket *= 2;
        }
    }

    fn points(&self) -> usize {
        self.buckets.len() * self.points_a_bucket()
    }

    /// A bucket of one row is a point; of any more it has a beginning and an end.
    const fn points_a_bucket(&self) -> usize {
        if self.rows_a_bucket == 1 { 1 } else { 2 }
    }

    /// When the points are.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> {
        let each = self.points_a_bucket();
        self.buckets.iter().flat_map(move |bucket| [bucket.begin, bucket.end].into_iter().take(each))
    }

    /// A column at these times; nothing where it has no value.
    pub(super) fn column(&self, column: usize, shape: Shape) -> impl Iterator<Item = Option<f64>> {
        let each = self.points_a_bucket();
        let drawn = move |bucket: &Bucket<COLUMNS, MARKS>| {
            bucket.columns.get(column).map_or([None; 2], |extremes| extremes.drawn(shape))
        };
        self.buckets.iter().flat_map(move |bucket| drawn(bucket).into_iter().take(each))
    }

    /// Where a mark is not nought. A row is the end of a period, so that a stretch begins where the row before it was.
    pub(super) fn stretches(&self, mark: usize) -> Vec<Stretch> {
        let mut stretches: Vec<Stretch> = Vec::new();
        let mut from = self.buckets.first().map_or(0.0, |bucket| bucket.begin);
        for bucket in &self.buckets {
            let mark = bucket.marks.get(mark).copied().unwrap_or_default();
            match stretches.last_mut() {
                Some(last) if last.mark == mark => last.to = bucket.end,
                _ => stretches.push(Stretch { from, to: bucket.end, mark }),
            }
            from = bucket.end;
        }
        stretches.retain(|stretch| stretch.mark > 0);
        stretches
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A row: how long after the one before, a value or none, and a mark.
    fn rows() -> impl Strategy<Value = Vec<(f64, f64, u8)>> {
        let value = prop_oneof![9 => -50.0..50.0, 1 => Just(f64::NAN)];
        proptest::collection::vec((0.0..0.2, value, 0_u8..4), 0..600)
    }

    fn decimated(rows: &[(f64, f64, u8)], most: usize) -> (Vec<f64>, Decimated<1, 1>) {
        let mut decimated = Decimated::new(most);
        let mut time = 0.0;
        let mut times = Vec::new();
        for (after, value, mark) in rows {
            time += after;
            times.push(time);
            decimated.push(time, [*value], [*mark]);
        }
        (times, decimated)
    }

    /// A line between points, at a time; of points at the same time, whatever lies between them.
    fn covers(times: &[f64], lows: &[Option<f64>], highs: &[Option<f64>], time: f64, value: f64) -> bool {
        let at = |place: usize| Some((times[place], lows[place]?, highs[place]?));
        (0..times.len()).any(|place| {
            let next = (place + 1).min(times.len() - 1);
            let (Some((from, low, high)), Some((to, next_low, next_high))) = (at(place), at(next)) else {
                return at(place).is_some_and(|(at, low, high)| at == time && low <= value && value <= high);
            };
            if !(from <= time && time <= to) {
                return false;
            }
            let part = if to > from { (time - from) / (to - from) } else { 0.0 };
            low + part * (next_low - low) <= value + 1e-9 && value - 1e-9 <= high + part * (next_high - high)
        })
    }

    proptest! {
        #[test]
        fn no_bound_is_drawn_narrower_than_it_was(rows in rows(), most in 2_usize..200) {
            let (times, decimated) = decimated(&rows, most);
            let drawn: Vec<f64> = decimated.times().collect();
            let lows: Vec<_> = decimated.column(0, Shape::Low).collect();
            let highs: Vec<_> = decimated.column(0, Shape::High).collect();
            for (time, (_, value, _)) in times.iter().zip(&rows).filter(|(_, (_, value, _))| !value.is_nan()) {
                prop_assert!(covers(&drawn, &lows, &highs, *time, *value), "{value} at {time}");
            }
        }

        #[test]
        fn a_line_keeps_its_extremes_in_few_points(rows in rows(), most in 2_usize..200) {
            let (times, decimated) = decimated(&rows, most);
            let drawn: Vec<f64> = decimated.times().collect();
            prop_assert!(drawn.len() <= most, "{} points", drawn.len());
            prop_assert!(drawn.is_sorted(), "{drawn:?}");
            prop_assert_eq!(drawn.first(), times.first());
            prop_assert_eq!(drawn.last(), times.last());
            let line: Vec<_> = decimated.column(0, Shape::Line).collect();
            prop_assert_eq!(line.len(), drawn.len());
            let values = || rows.iter().map(|(_, value, _)| *value).filter(|value| !value.is_nan());
            let of_line = || line.iter().flatten().copied();
            prop_assert_eq!(of_line().fold(f64::INFINITY, f64::min), values().fold(f64::INFINITY, f64::min));
            let greatest = values().fold(f64::NEG_INFINITY, f64::max);
            prop_assert_eq!(of_line().fold(f64::NEG_INFINITY, f64::max), greatest);
            // Every value drawn is one of the rows.
            prop_assert!(of_line().all(|drawn| values().any(|value| value == drawn)));
        }

        #[test]
        fn few_rows_are_drawn_as_they_are(rows in rows()) {
            let (times, decimated) = decimated(&rows, 600);
            prop_assert_eq!(decimated.times().collect::<Vec<_>>(), times);
            for shape in [Shape::Line, Shape::Low, Shape::High] {
                let values = rows.iter().map(|(_, value, _)| Some(*value).filter(|value| !value.is_nan()));
                prop_assert_eq!(decimated.column(0, shape).collect::<Vec<_>>(), values.collect::<Vec<_>>());
            }
        }

        #[test]
        fn no_mark_is_lost_or_lessened(rows in rows(), most in 2_usize..200) {
            let (times, decimated) = decimated(&rows, most);
            let stretches = decimated.stretches(0);
            for (time, (_, _, mark)) in times.iter().zip(&rows).filter(|(_, (_, _, mark))| *mark > 0) {
                let covered =
                    stretches.iter().any(|stretch| stretch.from <= *time && *time <= stretch.to && stretch.mark >= *mark);
                prop_assert!(covered, "{mark} at {time}: {stretches:?}");
            }
            prop_assert!(stretches.windows(2).all(|pair| pair[0].to <= pair[1].from));
        }

        #[test]
        fn thinning_late_is_thinning_early(rows in rows(), most in 2_usize..100) {
            let (_, early) = decimated(&rows, most);
            let (_, late) = decimated(&rows, 600);
            let late = late.thinned(most);
            prop_assert_eq!(late.times().collect::<Vec<_>>(), early.times().collect::<Vec<_>>());
            let line = |of: &Decimated<1, 1>| of.column(0, Shape::Line).collect::<Vec<_>>();
            prop_assert_eq!(line(&late), line(&early));
        }
    }

    #[test]
    fn a_peak_of_one_row_stays_where_it_was() {
        let rows: Vec<_> =
            (0..100).map(|row| (1.0, if row == 37 { 9.0 } else { 1.0 }, u8::from(row == 37))).collect();
        let (_, decimated) = decimated(&rows, 10);
        // Buckets of 32 rows: the second holds rows 32 to 63, at 33 s to 64 s.
        assert_eq!(decimated.times().collect::<Vec<_>>(), [1.0, 32.0, 33.0, 64.0, 65.0, 96.0, 97.0, 100.0]);
        let line: Vec<_> = decimated.column(0, Shape::Line).flatten().collect();
        assert_eq!(line, [1.0, 1.0, 1.0, 9.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(decimated.stretches(0), [Stretch { from: 32.0, to: 64.0, mark: 1 }]);
    }
}
