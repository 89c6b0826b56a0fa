//! Reads what people write to drive trains, and tells them what would be right where it is not.

use std::collections::BTreeMap;

use footplate_core::control::{Aim, Order, StopOrder};
use footplate_core::track::{Landmark, Layout, TurnoutStates, WayError};
use footplate_core::{Length, Ratio, SensorId, SpeedStep, TimeSpan, TrainId, TurnoutId};

use super::instruction::{Instruction, Until};
use super::words::{Mistake, Word, meant, words};

const VERBS: [&str; 8] = ["speed", "reverse", "turnout", "stop", "move", "where", "wait", "help"];

/// What a line may name: the places of a layout, and trains with their highest steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'k> {
    pub(super) layout: &'k Layout,
    pub(super) trains: &'k BTreeMap<TrainId, SpeedStep>,
}

/// Reads one line; `None` where it says nothing.
///
/// # Errors
/// What is wrong with it.
pub(super) fn parse(line: &str, known: Known<'_>) -> Result<Option<Instruction>, Mistake> {
    let words = words(line);
    let Some((verb, rest)) = words.split_first() else { return Ok(None) };
    let end = line.split('#').next().unwrap_or_default().trim_end().chars().count() + 2;
    let mut words = Words { rest, known, end, after: *verb };
    let instruction = match verb.text {
        "speed" => {
            let train = words.train()?;
            Instruction::Order(Order::Speed { train, step: words.step(train)? })
        }
        "reverse" => {
            let train = words.train()?;
            let then = if words.take("at") {
                words.expect("step")?;
                words.step(train)?
            } else {
                SpeedStep::STAND
            };
            Instruction::Order(Order::Reverse { train, then })
        }
        "turnout" if words.take("all") => {
            words.expect("straight")?;
            Instruction::Straighten
        }
        "turnout" => {
            let turnout = words.turnout()?;
            Instruction::Order(Order::Turnout { turnout, curved: words.leg()? })
        }
        "stop" => words.stop()?,
        "move" => {
            let train = words.train()?;
            Instruction::Order(Order::Move { train, distance: words.distance()? })
        }
        "where" if words.rest.is_empty() => Instruction::Where(None),
        "where" => Instruction::Where(Some(words.train()?)),
        "wait" => Instruction::Wait(words.until()?),
        "help" => Instruction::Help,
        "quit" | "exit" => Instruction::Quit,
        other => {
            let all = format!(": write one of {}, quit", VERBS.join(", "));
            let verbs = VERBS.into_iter().chain(["quit"]);
            return Err(verb.mistake(format!("is nothing to do{}", meant(other, verbs, &all))));
        }
    };
    match words.rest.first() {
        None => Ok(Some(instruction)),
        Some(word) => Err(word.mistake("is one word too many")),
    }
}

/// The words that have not been read yet.
struct Words<'w, 't, 'k> {
    rest: &'w [Word<'t>],
    known: Known<'k>,
    /// Where a word would stand that is missing at the end.
    end: usize,
    after: Word<'t>,
}

impl<'t> Words<'_, 't, '_> {
    fn next(&mut self, wanted: &str) -> Result<Word<'t>, Mistake> {
        let Some((word, rest)) = self.rest.split_first() else {
            let what = format!("{wanted} is missing after `{}`", self.after.text.escape_debug());
            return Err(Mistake { column: self.end, what });
        };
        (self.rest, self.after) = (rest, *word);
        Ok(*word)
    }

    /// Takes this word if it is next.
    fn take(&mut self, word: &str) -> bool {
        match self.rest.split_first() {
            Some((first, rest)) if first.text == word => {
                (self.rest, self.after) = (rest, *first);
                true
            }
            _ => false,
        }
    }

    fn expect(&mut self, wanted: &str) -> Result<(), Mistake> {
        let word = self.next(&format!("`{wanted}`"))?;
        if word.text == wanted { Ok(()) } else { Err(word.mistake(format!("should be `{wanted}`"))) }
    }

    fn number<T: std::str::FromStr>(&mut self, wanted: &str) -> Result<(Word<'t>, T), Mistake> {
        let word = self.next(wanted)?;
        let number = word.text.parse().map_err(|_| word.mistake(format!("should be {wanted}")))?;
        Ok((word, number))
    }

    fn train(&mut self) -> Result<TrainId, Mistake> {
        let (word, number) = self.number("the number of a train, such as 24")?;
        let train = TrainId(number);
        if self.known.trains.contains_key(&train) {
            return Ok(train);
        }
        let trains: Vec<String> = self.known.trains.keys().map(ToString::to_string).collect();
        let known = if trains.is_empty() { "none is".to_owned() } else { trains.join(", ") };
        Err(word.mistake(format!("is no train that is driven here: {known}")))
    }

    fn step(&mut self, train: TrainId) -> Result<SpeedStep, Mistake> {
        let highest = self.known.trains.get(&train).copied().unwrap_or_default();
        let wanted = format!("a step from 0 to {highest}");
        let (word, number) = self.number(&wanted)?;
        let step = SpeedStep::new(number).filter(|step| *step <= highest);
        step.ok_or_else(|| word.mistake(format!("should be {wanted}")))
    }

    fn turnout(&mut self) -> Result<TurnoutId, Mistake> {
        let (word, number) = self.number("`all` or the number of a turnout, such as 11")?;
        let turnout = TurnoutId(number);
        if self.known.layout.branch(turnout).is_some() {
            return Ok(turnout);
        }
        let all: Vec<String> = self.known.layout.turnouts().map(|(turnout, _)| turnout.to_string()).collect();
        Err(word.mistake(format!("is no turnout of {}: it has {}", self.known.layout.name(), all.join(", "))))
    }

    fn leg(&mut self) -> Result<bool, Mistake> {
        let word = self.next("`straight` or `curved`")?;
        match word.text {
            "straight" => Ok(false),
            "curved" => Ok(true),
            other => {
                let near = meant(other, ["straight", "curved"].into_iter(), "");
                Err(word.mistake(format!("should be `straight` or `curved`{near}")))
            }
        }
    }

    fn stop(&mut self) -> Result<Instruction, Mistake> {
        let train = self.train()?;
        if self.rest.is_empty() {
            return Ok(Instruction::Order(Order::Speed { train, step: SpeedStep::STAND }));
        }
        self.expect("at")?;
        let mut stop = StopOrder::at(train, self.landmark()?);
        while let Some(word) = self.rest.first().copied() {
            self.next("")?;
            match word.text {
                "at" => {
                    self.expect("step")?;
                    stop.step = Some(self.step(train)?);
                }
                "not-beyond" => stop.aim = Aim::NotBeyond(self.share()?),
                "next" => {
                    self.expect("round")?;
                    stop.next_round = true;
                }
                other => {
                    let known = ["at", "not-beyond", "next"].into_iter();
                    let otherwise = ": write `at step 8`, `not-beyond 0.1%` or `next round`";
                    return Err(word.mistake(format!("says nothing here{}", meant(other, known, otherwise))));
                }
            }
        }
        Ok(Instruction::Order(Order::Stop(stop)))
    }

    /// A place, with its offset in one word or several.
    fn landmark(&mut self) -> Result<Landmark, Mistake> {
        let first = self.next("a place, such as `C13` or `C13+120mm`")?;
        let mut text = first.text.to_owned();
        while let Some(word) = self.rest.first() {
            let goes_on = word.text.starts_with(['+', '-'])
                || text.ends_with(['+', '-'])
                || (word.text == "mm" && text.ends_with(|c: char| c.is_ascii_digit()));
            if !goes_on {
                break;
            }
            text.push_str(word.text);
            self.next("")?;
        }
        let layout = self.known.layout;
        let whole = Word { text: &text, column: first.column };
        let landmark = layout.landmark(&text).map_err(|error| {
            let name = text.split(['+', '-']).next().unwrap_or_default();
            let nodes = layout.nodes().map(|(_, node)| node.name.as_str());
            let near = meant(name, nodes, "");
            Mistake { column: whole.column, what: format!("{error}{near}") }
        })?;
        match layout.locate(landmark, &TurnoutStates::unknown()) {
            Err(error @ WayError::TrackEnds { .. }) => {
                Err(whole.mistake(format!("is off the track: {error}")))
            }
            _ => Ok(landmark),
        }
    }

    fn sensor(&mut self) -> Result<SensorId, Mistake> {
        let word = self.next("a contact, such as `C13`")?;
        let layout = self.known.layout;
        layout.sensor_named(word.text).ok_or_else(|| {
            let all = layout.sensors().map(|(sensor, _)| layout.sensor_name(sensor));
            let near = meant(word.text, all, ": write a name such as `C13`");
            word.mistake(format!("is no contact of {}{near}", layout.name()))
        })
    }

    fn share(&mut self) -> Result<Ratio, Mistake> {
        let wanted = "a share of stops from 0.0001% to 50%";
        let word = self.next(wanted)?;
        let percent = word.text.strip_suffix('%').and_then(|number| number.parse::<f64>().ok());
        let share = percent.filter(|percent| (1e-4..=50.0).contains(percent)).map(Ratio::from_percent);
        share.ok_or_else(|| word.mistake(format!("should be {wanted}")))
    }

    fn distance(&mut self) -> Result<Length, Mistake> {
        let wanted = "a distance ahead, such as 37mm or 1.2m";
        let (word, number, unit) = self.with_unit(wanted, &["mm", "cm", "m"])?;
        let mm = number
            * match unit {
                "mm" => 1.0,
                "cm" => 10.0,
                _ => 1e3,
            };
        if (1.0..=1e5).contains(&mm) {
            Ok(Length::from_mm(mm))
        } else {
            Err(word.mistake("should be 1mm to 100m"))
        }
    }

    fn until(&mut self) -> Result<Until, Mistake> {
        let span = self.rest.first().is_some_and(|word| word.text.ends_with('s'))
            || self.rest.get(1).is_some_and(|word| ["s", "ms"].contains(&word.text));
        if span {
            let (word, number, unit) = self.with_unit("a time, such as 2s or 500ms", &["ms", "s"])?;
            let seconds = if unit == "ms" { 1e-3 * number } else { number };
            return if (0.0..=86_400.0).contains(&seconds) {
                Ok(Until::Passed(TimeSpan::from_s(seconds)))
            } else {
                Err(word.mistake("should be at most a day: 86400s"))
            };
        }
        let wanted = "a time such as 2s, or a train such as 24";
        if self.rest.is_empty() {
            self.next(wanted)?;
        }
        let train = self.train()?;
        if self.take("located") {
            return Ok(Until::Located(train));
        }
        self.expect("at")?;
        if self.take("rest") { Ok(Until::AtRest(train)) } else { Ok(Until::At(train, self.sensor()?)) }
    }

    /// A number and its unit, in one word or two.
    fn with_unit(
        &mut self,
        wanted: &str,
        units: &[&'static str],
    ) -> Result<(Word<'t>, f64, &'static str), Mistake> {
        let word = self.next(wanted)?;
        let digits = word.text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let mut unit = word.text.get(digits.len()..).unwrap_or_default();
        if unit.is_empty() && self.rest.first().is_some_and(|next| units.contains(&next.text)) {
            unit = self.next("")?.text;
        }
        let unit = units.iter().find(|known| **known == unit);
        // Neither `inf` nor a sign alone: digits only.
        let number = digits.parse::<f64>().ok().filter(|number| number.is_finite());
        match (number, unit) {
            (Some(number), Some(unit)) => Ok((word, number, *unit)),
            _ => Err(word.mistake(format!("should be {wanted}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use footplate_store::layout_named;

    use super::*;

    fn read(line: &str) -> Result<Option<Instruction>, String> {
        let layout = layout_named("track-a").expect("a built-in layout").layout;
        let highest = SpeedStep::new(14).expect("a step");
        let trains = [24, 58].map(|train| (TrainId(train), highest)).into_iter().collect();
        parse(line, Known { layout: &layout, trains: &trains }).map_err(|mistake| mistake.to_string())
    }

    fn order(line: &str) -> Order {
        match read(line) {
            Ok(Some(Instruction::Order(order))) => order,
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn every_line_of_the_help_is_understood() {
        let (train, step) = (TrainId(24), |step| SpeedStep::new(step).expect("a step"));
        assert_eq!(order("speed 24 8"), Order::Speed { train, step: step(8) });
        assert_eq!(order("stop 24"), Order::Speed { train, step: step(0) });
        assert_eq!(order("reverse 24"), Order::Reverse { train, then: step(0) });
        assert_eq!(order("reverse 24 at step 8"), Order::Reverse { train, then: step(8) });
        assert_eq!(order("turnout 11 curved"), Order::Turnout { turnout: TurnoutId(11), curved: true });
        assert_eq!(order("move 24 37mm"), Order::Move { train, distance: Length::from_mm(37.0) });
        assert_eq!(order("move 24 1.2 m"), Order::Move { train, distance: Length::from_mm(1200.0) });
        let Order::Stop(stop) = order("stop 24 at C13 + 120 mm not-beyond 0.1% at step 8 next round") else {
            panic!("a stop");
        };
        assert!((stop.target.offset.as_mm() - 120.0).abs() < 1e-9);
        assert_eq!((stop.step, stop.next_round), (Some(step(8)), true));
        assert_eq!(stop.aim, Aim::NotBeyond(Ratio::from_percent(0.1)));
        let wait = |line: &str| match read(line) {
            Ok(Some(Instruction::Wait(until))) => until,
            other => panic!("{line}: {other:?}"),
        };
        assert_eq!(wait("wait 500ms # a moment"), Until::Passed(TimeSpan::from_ms(500)));
        assert_eq!(wait("wait 24 at rest"), Until::AtRest(train));
        assert_eq!(wait("wait 24 located"), Until::Located(train));
        assert!(matches!(wait("wait 24 at C13"), Until::At(TrainId(24), _)));
        assert_eq!(read("turnout all straight"), Ok(Some(Instruction::Straighten)));
        assert_eq!(read("where"), Ok(Some(Instruction::Where(None))));
        assert_eq!(read("  # nothing but a remark"), Ok(None));
    }

    #[test]
    fn a_mistake_is_named_with_its_column_and_what_would_be_right() {
        for (line, says) in [
            ("stopp 24 at C13", "column 1: `stopp` is nothing to do: did you mean `stop`?"),
            ("stop 25 at C13", "column 6: `25` is no train that is driven here: 24, 58"),
            ("stop 24 at C1 3", "column 15: `3` says nothing here"),
            ("stop 24 at C133", "column 12: no place of track-a is called `C133`"),
            ("stop 24 at C133", "did you mean `C13`?"),
            ("stop 24 at C13+120", "column 12: `+120` is no offset: write millimetres"),
            (
                "stop 24 at C13 not-beyond 60%",
                "column 27: `60%` should be a share of stops from 0.0001% to 50%",
            ),
            ("stop 24 at C13 at step 15", "column 24: `15` should be a step from 0 to 14"),
            ("stop 24 C13", "column 9: `C13` should be `at`"),
            ("stop 24 at", "column 12: a place, such as `C13` or `C13+120mm` is missing after `at`"),
            ("speed 24", "column 10: a step from 0 to 14 is missing after `24`"),
            ("speed 24 8 9", "column 12: `9` is one word too many"),
            ("turnout 99 curved", "column 9: `99` is no turnout of track-a: it has 1, 2"),
            (
                "turnout 11 curve",
                "column 12: `curve` should be `straight` or `curved`: did you mean `curved`?",
            ),
            ("move 24 37", "column 9: `37` should be a distance ahead, such as 37mm or 1.2m"),
            ("move 24 -5mm", "column 9: `-5mm` should be 1mm to 100m"),
            ("wait", "a time such as 2s, or a train such as 24 is missing after `wait`"),
            ("wait 24 at C99", "column 12: `C99` is no contact of track-a"),
        ] {
            let mistake = read(line).expect_err(line);
            assert!(mistake.contains(says), "{line}: {mistake}");
        }
    }

    #[test]
    fn a_target_beyond_the_end_of_the_track_is_refused_before_anything_moves() {
        let layout = layout_named("track-a").expect("a built-in layout").layout;
        let end = layout.nodes().find(|(_, node)| node.name.starts_with("EX")).expect("a track end");
        let mistake = read(&format!("stop 24 at {}+10mm", end.1.name)).expect_err("off the track");
        assert!(mistake.contains("is off the track"), "{mistake}");
    }

    #[test]
    fn no_line_whatever_makes_it_panic() {
        for line in [
            "\u{0}",
            "speed 99999999999 1",
            "wait -1s",
            "wait 1e999s",
            "move 24 nanmm",
            "stop 24 at +",
            "wait ms",
        ] {
            assert!(read(line).is_err(), "{line:?}");
        }
    }
}
