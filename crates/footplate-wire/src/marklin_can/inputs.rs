//! Sensor states from reports that the network may lose, double or reorder.

use alloc::vec::Vec;

use footplate_core::{TimeSpan, Timestamp};

use super::message::InputChange;
use super::time_model::{NETWORK_LONGEST, Span};

/// Reports that overtake each other on a network do so within this time.
const REORDERED_WITHIN: TimeSpan = TimeSpan::from_ms(100);

/// An input that the station has reported.
#[derive(Debug, Clone, Copy)]
struct Input {
    number: u16,
    is_occupied: bool,
    /// When its state was last received.
    known: Timestamp,
    /// When the station saw the last change, if it reported it.
    seen: Option<Span>,
    /// The last report and its arrival.
    report: Option<(InputChange, Timestamp)>,
    /// It became free, and the report that it became occupied was lost.
    is_inferred: bool,
}

/// All of them, in the order of their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Inputs(Vec<Input>);

/// What a report means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum News {
    /// It has become occupied, and when the station saw it.
    Occupied(Span),
    /// It has become free, and when the station saw it.
    Freed(Span),
    /// It was occupied before it was first read.
    HeldFromStart,
    /// No change.
    None,
}

impl Inputs {
    /// The station reports a change.
    pub(super) fn changed(&mut self, now: Timestamp, number: u16, change: InputChange) -> News {
        let place = self.input(now, number, change.was_occupied);
        let Some(input) = self.0.get_mut(place) else { return News::None };
        let is_repeated = input.report.is_some_and(|(last, at)| {
            let is_same = last == change || last == InputChange { lasted: None, ..change };
            is_same && now - at <= REORDERED_WITHIN
        });
        let is_late = change.is_occupied && input.is_inferred && now - input.known <= REORDERED_WITHIN;
        if is_repeated || is_late || change.was_occupied == change.is_occupied {
            input.is_inferred = false;
            return News::None;
        }
        let window = Span::of_report(now);
        // Stations that do not measure the time report 0, too.
        let lasted = change.lasted.filter(|ticks| *ticks > 0);
        let before = input.seen.filter(|_| input.is_occupied == change.was_occupied);
        let expected = before.zip(lasted).and_then(|(before, ticks)| before.later_by(ticks));
        let seen = expected.and_then(|expected| expected.and(window)).unwrap_or(window);
        // It became free and had not been heard to be occupied: that report was lost.
        let is_inferred = !change.is_occupied && !input.is_occupied && change.was_occupied;
        let known = input.known;
        (input.is_occupied, input.known, input.seen) = (change.is_occupied, now, Some(seen));
        (input.report, input.is_inferred) = (Some((change, now)), is_inferred);
        if change.is_occupied {
            return News::Occupied(seen);
        }
        if !is_inferred {
            return News::Freed(seen);
        }
        let since = Span { earliest: known - NETWORK_LONGEST, latest: window.latest };
        News::Occupied(lasted.and_then(|ticks| window.earlier_by(ticks)?.and(since)).unwrap_or(since))
    }

    /// The station was asked for the state of an input. `listing`: for the first time.
    pub(super) fn asked(&mut self, now: Timestamp, number: u16, is_occupied: bool, listing: bool) -> News {
        let is_new = self.place(number).is_err();
        let place = self.input(now, number, is_occupied);
        let Some(input) = self.0.get_mut(place) else { return News::None };
        if is_new {
            return if is_occupied && listing { News::HeldFromStart } else { News::None };
        }
        // An answer may have been overtaken by a report.
        let is_overtaken = input.report.is_some_and(|(_, at)| now - at <= REORDERED_WITHIN);
        if is_overtaken {
            return News::None;
        }
        let (was_occupied, known) = (input.is_occupied, input.known);
        (input.is_occupied, input.known) = (is_occupied, now);
        if was_occupied == is_occupied {
            return News::None;
        }
        input.seen = None;
        if !is_occupied {
            return News::Freed(Span { earliest: known - NETWORK_LONGEST, latest: now });
        }
        // What follows as a report of this change is that change.
        let change = InputChange { was_occupied: false, is_occupied: true, lasted: None };
        input.report = Some((change, now));
        News::Occupied(Span { earliest: known - NETWORK_LONGEST, latest: now })
    }

    fn place(&self, number: u16) -> Result<usize, usize> {
        self.0.binary_search_by_key(&number, |input| input.number)
    }

    /// The place of an input; one that is new is in a state.
    fn input(&mut self, now: Timestamp, number: u16, is_occupied: bool) -> usize {
        self.place(number).unwrap_or_else(|place| {
            let (seen, report, is_inferred) = (None, None, false);
            self.0.insert(place, Input { number, is_occupied, known: now, seen, report, is_inferred });
            place
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(was_occupied: bool, is_occupied: bool, lasted: u16) -> InputChange {
        InputChange { was_occupied, is_occupied, lasted: Some(lasted) }
    }

    fn ms(ms: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(ms)
    }

    fn is_occupied(news: News) -> bool {
        matches!(news, News::Occupied(_))
    }

    fn is_freed(news: News) -> bool {
        matches!(news, News::Freed(_))
    }

    #[test]
    fn an_input_is_reported_once_each_time_it_becomes_occupied() {
        let mut inputs = Inputs::default();
        assert_eq!(inputs.asked(ms(0), 3, true, true), News::HeldFromStart);
        assert_eq!(inputs.asked(ms(0), 5, false, true), News::None);
        assert!(is_occupied(inputs.changed(ms(2_000), 5, change(false, true, 200))));
        // The same datagram again, and an answer that was made before.
        assert_eq!(inputs.changed(ms(2_030), 5, change(false, true, 200)), News::None);
        assert_eq!(inputs.asked(ms(2_040), 5, false, false), News::None);
        assert!(is_freed(inputs.changed(ms(2_300), 5, change(true, false, 30))));
        // A second occupation after exactly as long is another one.
        assert!(is_occupied(inputs.changed(ms(4_300), 5, change(false, true, 200))));
        assert!(is_freed(inputs.changed(ms(9_000), 3, change(true, false, 900))));
    }

    #[test]
    fn a_report_that_was_lost_is_made_up_for_by_the_next_one_or_by_asking() {
        let mut inputs = Inputs::default();
        inputs.asked(ms(0), 5, false, true);
        // It became free after 300 ms: it became occupied 300 ms before that.
        let News::Occupied(span) = inputs.changed(ms(2_300), 5, change(true, false, 30)) else { panic!() };
        assert!(span.earliest <= ms(2_000) && ms(2_000) <= span.latest, "{span:?}");
        assert!(span.latest - span.earliest <= TimeSpan::from_ms(41), "{span:?}");
        // Its report was only late.
        assert_eq!(inputs.changed(ms(2_320), 5, change(false, true, 200)), News::None);
        assert_eq!(inputs.asked(ms(3_000), 5, false, false), News::None);
        let News::Occupied(span) = inputs.asked(ms(4_000), 5, true, false) else { panic!() };
        assert_eq!((span.earliest, span.latest), (ms(3_000) - NETWORK_LONGEST, ms(4_000)));
        // The report that was overtaken by the answer is no second one.
        assert_eq!(inputs.changed(ms(4_010), 5, change(false, true, 170)), News::None);
        assert!(is_freed(inputs.changed(ms(4_500), 5, change(true, false, 50))));
    }

    #[test]
    fn the_time_that_a_report_carries_narrows_what_the_network_left_open() {
        let mut inputs = Inputs::default();
        inputs.asked(ms(0), 5, false, true);
        inputs.changed(ms(1_000), 5, change(false, true, 100));
        inputs.changed(ms(1_200), 5, change(true, false, 20));
        // Held up by 18 ms on the network: the station saw it near 3200.
        let News::Occupied(span) = inputs.changed(ms(3_218), 5, change(false, true, 200)) else { panic!() };
        assert!(span.latest <= ms(3_210) && ms(3_200) <= span.latest, "{span:?}");
        // Without that time the span is as wide as the network makes it.
        let news = inputs.changed(ms(3_400), 5, InputChange { lasted: None, ..change(true, false, 0) });
        assert!(is_freed(news));
        let unknown = InputChange { lasted: Some(0), ..change(false, true, 0) };
        let News::Occupied(span) = inputs.changed(ms(5_000), 5, unknown) else { panic!() };
        assert_eq!(span, Span::of_report(ms(5_000)));
    }
}
