//! Parses the words of a line one by one: trains, steps, places, lengths, times.

use std::collections::BTreeMap;

use footplate_core::track::{Landmark, Layout, PathError, TurnoutStates};
use footplate_core::{
    FunctionNumber, Length, Ratio, SensorId, Speed, SpeedStep, TimeSpan, TrainId, TurnoutId,
};
use footplate_store::Schedule;

use super::words::{Mistake, Word, meant};

/// What a line may refer to: a layout, trains with their highest steps, and saved schedules.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'k> {
    pub(super) layout: &'k Layout,
    pub(super) trains: &'k BTreeMap<TrainId, SpeedStep>,
    pub(super) schedules: &'k [Schedule],
}

/// The words that are not parsed yet.
pub(super) struct Words<'w, 't, 'k> {
    pub(super) rest: &'w [Word<'t>],
    pub(super) known: Known<'k>,
    /// The column after the last word, for the error that one is missing.
    pub(super) end: usize,
    pub(super) after: Word<'t>,
}

impl<'t> Words<'_, 't, '_> {
    pub(super) fn next(&mut self, wanted: &str) -> Result<Word<'t>, Mistake> {
        let Some((word, rest)) = self.rest.split_first() else {
            let what = format!("{wanted} is missing after `{}`", self.after.text.escape_debug());
            return Err(Mistake { column: self.end, what });
        };
        (self.rest, self.after) = (rest, *word);
        Ok(*word)
    }

    /// Consumes the next word if it is this one.
    pub(super) fn take(&mut self, word: &str) -> bool {
        match self.rest.split_first() {
            Some((first, rest)) if first.text == word => {
                (self.rest, self.after) = (rest, *first);
                true
            }
            _ => false,
        }
    }

    pub(super) fn expect(&mut self, wanted: &str) -> Result<(), Mistake> {
        let word = self.next(&format!("`{wanted}`"))?;
        if word.text == wanted { Ok(()) } else { Err(word.mistake(format!("should be `{wanted}`"))) }
    }

    pub(super) fn number<T: std::str::FromStr>(&mut self, wanted: &str) -> Result<(Word<'t>, T), Mistake> {
        let word = self.next(wanted)?;
        let number = word.text.parse().map_err(|_| word.mistake(format!("should be {wanted}")))?;
        Ok((word, number))
    }

    pub(super) fn train(&mut self) -> Result<TrainId, Mistake> {
        let (word, number) = self.number("the number of a train, such as 24")?;
        let train = TrainId(number);
        if self.known.trains.contains_key(&train) {
            return Ok(train);
        }
        let trains: Vec<String> = self.known.trains.keys().map(ToString::to_string).collect();
        let known = if trains.is_empty() { "none is".to_owned() } else { trains.join(", ") };
        Err(word.mistake(format!("is not a train of this session: {known}")))
    }

    pub(super) fn step(&mut self, train: TrainId) -> Result<SpeedStep, Mistake> {
        let highest = self.known.trains.get(&train).copied().unwrap_or_default();
        let wanted = format!("a step from 0 to {highest}");
        let (word, number) = self.number(&wanted)?;
        let step = SpeedStep::new(number).filter(|step| *step <= highest);
        step.ok_or_else(|| word.mistake(format!("should be {wanted}")))
    }

    pub(super) fn turnout(&mut self) -> Result<TurnoutId, Mistake> {
        let (word, number) = self.number("`all` or the number of a turnout, such as 11")?;
        let turnout = TurnoutId(number);
        if self.known.layout.branch(turnout).is_some() {
            return Ok(turnout);
        }
        let all: Vec<String> = self.known.layout.turnouts().map(|(turnout, _)| turnout.to_string()).collect();
        Err(word.mistake(format!(
            "is not a turnout of {}: it has {}",
            self.known.layout.name(),
            all.join(", ")
        )))
    }

    pub(super) fn function(&mut self) -> Result<FunctionNumber, Mistake> {
        let wanted = format!("a function from 0 (the light) to {}", FunctionNumber::HIGHEST);
        let (word, number) = self.number(&wanted)?;
        FunctionNumber::new(number).ok_or_else(|| word.mistake(format!("should be {wanted}")))
    }

    pub(super) fn on_or_off(&mut self) -> Result<bool, Mistake> {
        let word = self.next("`on` or `off`")?;
        match word.text {
            "on" => Ok(true),
            "off" => Ok(false),
            other => {
                let near = meant(other, ["on", "off"].into_iter(), "");
                Err(word.mistake(format!("should be `on` or `off`{near}")))
            }
        }
    }

    pub(super) fn leg(&mut self) -> Result<bool, Mistake> {
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

    /// A place; its offset may be a word of its own.
    pub(super) fn landmark(&mut self) -> Result<Landmark, Mistake> {
        let first = self.next("a place, such as `C13` or `C13+120mm`")?;
        let mut text = first.text.to_owned();
        while let Some(word) = self.rest.first() {
            let continues = word.text.starts_with(['+', '-'])
                || text.ends_with(['+', '-'])
                || (word.text == "mm" && text.ends_with(|c: char| c.is_ascii_digit()));
            if !continues {
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
            Err(error @ PathError::TrackEnds { .. }) => {
                Err(whole.mistake(format!("is off the track: {error}")))
            }
            _ => Ok(landmark),
        }
    }

    pub(super) fn sensor(&mut self) -> Result<SensorId, Mistake> {
        let word = self.next("a sensor, such as `C13`")?;
        let layout = self.known.layout;
        layout.sensor_named(word.text).ok_or_else(|| {
            let all = layout.sensors().map(|(sensor, _)| layout.sensor_name(sensor));
            let near = meant(word.text, all, ": write a name such as `C13`");
            word.mistake(format!("is not a sensor of {}{near}", layout.name()))
        })
    }

    /// The name of a schedule, of all words that are left, in quotation marks or not; and its column.
    pub(super) fn schedule_name(&mut self) -> Result<(usize, String), Mistake> {
        let first = self.next("the name of a schedule")?;
        let words = std::iter::once(first).chain(self.rest.iter().copied());
        let name = words.map(|word| word.text).collect::<Vec<_>>().join(" ");
        self.rest = &[];
        Ok((first.column, name.trim_matches('"').to_owned()))
    }

    /// A saved schedule by its name.
    pub(super) fn schedule(&mut self) -> Result<Schedule, Mistake> {
        let (column, name) = self.schedule_name()?;
        let saved = self.known.schedules;
        saved.iter().find(|schedule| schedule.name == name).cloned().ok_or_else(|| {
            let names = || saved.iter().map(|schedule| schedule.name.as_str());
            let all = match saved.len() {
                0 => ": none is saved; the page `Schedules` of the dashboard writes them".to_owned(),
                _ => format!(": write one of {}", names().collect::<Vec<_>>().join(", ")),
            };
            let what =
                format!("`{}` is not a saved schedule{}", name.escape_debug(), meant(&name, names(), &all));
            Mistake { column, what }
        })
    }

    pub(super) fn share(&mut self) -> Result<Ratio, Mistake> {
        let wanted = "a share of stops from 0.0001% to 50%";
        let word = self.next(wanted)?;
        let percent = word.text.strip_suffix('%').and_then(|number| number.parse::<f64>().ok());
        let share = percent.filter(|percent| (1e-4..=50.0).contains(percent)).map(Ratio::from_percent);
        share.ok_or_else(|| word.mistake(format!("should be {wanted}")))
    }

    pub(super) fn distance(&mut self) -> Result<Length, Mistake> {
        let wanted = "a distance ahead, such as 37mm or 1.2m";
        let (word, number, unit) = self.with_unit(wanted, &["mm", "cm", "m"])?;
        let mm = number * mm_per(unit);
        if (1.0..=1e5).contains(&mm) {
            Ok(Length::from_mm(mm))
        } else {
            Err(word.mistake("should be 1mm to 100m"))
        }
    }

    pub(super) fn speed(&mut self) -> Result<Speed, Mistake> {
        let wanted = "a speed, such as 250mm/s";
        let (word, number, unit) = self.with_unit(wanted, &["mm/s", "cm/s", "m/s"])?;
        let mm_per_s = number * mm_per(unit.trim_end_matches("/s"));
        if (1.0..=5e3).contains(&mm_per_s) {
            Ok(Speed::from_mm_per_s(mm_per_s))
        } else {
            Err(word.mistake("should be 1mm/s to 5m/s"))
        }
    }

    /// A time of at most one day.
    pub(super) fn span(&mut self) -> Result<TimeSpan, Mistake> {
        let (word, number, unit) = self.with_unit("a time, such as 2s or 500ms", &["ms", "s"])?;
        let seconds = if unit == "ms" { 1e-3 * number } else { number };
        if (0.0..=86_400.0).contains(&seconds) {
            Ok(TimeSpan::from_s(seconds))
        } else {
            Err(word.mistake("should be at most a day: 86400s"))
        }
    }

    /// Whether the next word, or the next two, are a time.
    pub(super) fn is_at_span(&self) -> bool {
        self.rest.first().is_some_and(|word| word.text.ends_with('s'))
            || self.rest.get(1).is_some_and(|word| ["s", "ms"].contains(&word.text))
    }

    /// A number with its unit, in one word or two.
    pub(super) fn with_unit(
        &mut self,
        wanted: &str,
        units: &[&'static str],
    ) -> Result<(Word<'t>, f64, &'static str), Mistake> {
        let word = self.next(wanted)?;
        let digits = word.text.trim_end_matches(|c: char| c.is_ascii_alphabetic() || c == '/');
        let mut unit = word.text.get(digits.len()..).unwrap_or_default();
        if unit.is_empty() && self.rest.first().is_some_and(|next| units.contains(&next.text)) {
            unit = self.next("")?.text;
        }
        let unit = units.iter().find(|known| **known == unit);
        // `inf` and `nan` parse as numbers: reject them.
        let number = digits.parse::<f64>().ok().filter(|number| number.is_finite());
        match (number, unit) {
            (Some(number), Some(unit)) => Ok((word, number, *unit)),
            _ => Err(word.mistake(format!("should be {wanted}"))),
        }
    }
}

/// Millimetres per unit of length.
fn mm_per(unit: &str) -> f64 {
    match unit {
        "mm" => 1.0,
        "cm" => 10.0,
        _ => 1e3,
    }
}
