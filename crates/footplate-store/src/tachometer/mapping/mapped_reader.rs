//! A CSV file of any columns, read into the blocks that recordings of ours are read into.

use std::io::Read;

use footplate_core::Timestamp;
use footplate_core::odometry::wheels::Vehicle;

use super::clock::Clock;
use super::column_mapping::ColumnMapping;
use super::mapped_columns::MappedColumns;
use super::number_style::NumberStyle;
use super::target::{Target, TurningUnit};
use super::unit_watch::UnitWatch;
use super::wheel_path::WheelPath;
use crate::table::{TableError, shown};
use crate::tachometer::block::{BLOCK_ROWS, TachometerBlock};
use crate::tachometer::columns::{Quantity, Slot, TachometerColumns};
use crate::tachometer::csv_line::{Line, LineReader, is_missing, read_field};
use crate::tachometer::csv_lines::Lines;
use crate::tachometer::error::TachometerError;
use crate::tachometer::note::{RowPlace, TachometerNote, TachometerOddity};
use crate::tachometer::row_watch::RowWatch;
use crate::tachometer::run_names::RunNames;

/// Seconds in the minute of revolutions a minute.
const MINUTE_S: f64 = 60.0;

/// A foreign CSV file that is being read.
pub(in crate::tachometer) struct MappedReader {
    lines: Lines<Box<dyn Read + Send>>,
    line_reader: LineReader,
    columns: TachometerColumns,
    rows: RowReader,
    watch: RowWatch,
    notes: Vec<TachometerNote>,
    has_rows: bool,
}

/// What rows are read with.
struct RowReader {
    mapped: MappedColumns,
    style: NumberStyle,
    vehicle: Vehicle,
    clock: Clock,
    units: UnitWatch,
    runs: RunNames,
    paths: Vec<[WheelPath; 2]>,
}

/// Why a row is not taken in.
enum RowFault {
    /// A field is not what it should be.
    Field { at: usize, expected: String },
    /// The unit of a column cannot be what the mapping says.
    Unit(String),
}

impl MappedReader {
    /// Reads the header. `file` is what messages call the file.
    pub(in crate::tachometer) fn open(
        file: &str,
        input: Box<dyn Read + Send>,
        mapping: &ColumnMapping,
        vehicle: &Vehicle,
    ) -> Result<Self, TachometerError> {
        let mut lines = Lines::new(file, input);
        let (names, style, line_reader) = loop {
            let Some(line) = lines.next_line()? else {
                return Err(TableError::Empty(file.to_owned()).into());
            };
            let separator = mapping.separator.unwrap_or_else(|| NumberStyle::separator_of(line.bytes));
            let mut line_reader = LineReader::separated_by(separator);
            let names = line_reader.header(line)?;
            if !names.is_empty() {
                // With commas between fields a comma is no decimal mark, unless it is said and the field is quoted.
                let by_commas = (separator == b',').then_some('.');
                break (
                    names,
                    NumberStyle { separator, decimal: mapping.decimal.or(by_commas) },
                    line_reader,
                );
            }
        };
        let mapped = MappedColumns::of_header(file, &names, mapping)?;
        let (columns, oddities) = mapped.ours(names);
        let place = Some(RowPlace::Line(lines.line));
        let period_s = mapping.period_s.unwrap_or_else(|| vehicle.period.as_s());
        let rows = RowReader {
            clock: Clock::new(mapped.form, mapped.date.is_some(), period_s),
            units: UnitWatch::new(vehicle.max_speed.as_m_per_s()),
            vehicle: *vehicle,
            mapped,
            style,
            runs: RunNames::default(),
            paths: Vec::new(),
        };
        let notes = oddities.into_iter().map(|oddity| TachometerNote { place, oddity }).collect();
        let watch = RowWatch::default();
        Ok(Self { lines, line_reader, columns, rows, watch, notes, has_rows: false })
    }

    pub(in crate::tachometer) fn columns(&self) -> &TachometerColumns {
        &self.columns
    }

    /// The next rows or notes, as many as are at hand; `false` at the end.
    pub(in crate::tachometer) fn read_block(
        &mut self,
        block: &mut TachometerBlock,
    ) -> Result<bool, TachometerError> {
        block.begin(&self.columns);
        block.notes.append(&mut self.notes);
        loop {
            while block.len() < BLOCK_ROWS && self.lines.has_line() {
                self.read_row(block)?;
            }
            block.time_faults = self.watch.faults();
            block.read_up_to = self.lines.taken;
            self.has_rows |= !block.is_empty();
            if !block.is_empty() || !block.notes.is_empty() {
                return Ok(true);
            }
            if !self.lines.fill()? {
                let file = self.lines.file.clone();
                return if self.has_rows { Ok(false) } else { Err(TachometerError::NoRows(file)) };
            }
        }
    }

    fn read_row(&mut self, block: &mut TachometerBlock) -> Result<(), TachometerError> {
        let rows = block.len();
        let is_last = self.lines.is_last_without_end();
        let Some(line) = self.lines.next_line()? else { return Ok(()) };
        let place = RowPlace::Line(line.number);
        match self.rows.read(line, &mut self.line_reader, block) {
            Ok(true) => {}
            Ok(false) => return Ok(()),
            Err(TachometerError::Table(_)) if is_last => {
                block.truncate(rows);
                let oddity = TachometerOddity::LineCutOff;
                block.notes.push(TachometerNote { place: Some(place), oddity });
                return Ok(());
            }
            Err(error) => {
                block.truncate(rows);
                return Err(error);
            }
        }
        let file = self.lines.file.clone();
        self.watch.see(&file, &self.columns, block, rows, place)?;
        if is_last {
            let oddity = TachometerOddity::LineNotEnded;
            block.notes.push(TachometerNote { place: Some(place), oddity });
        }
        Ok(())
    }
}

impl RowReader {
    /// Adds a row to the block; `false` if the line is empty.
    fn read(
        &mut self,
        line: Line<'_>,
        reader: &mut LineReader,
        block: &mut TachometerBlock,
    ) -> Result<bool, TachometerError> {
        reader.split(line)?;
        let (found, expected) = (reader.fields.len(), self.mapped.targets.len());
        let (file, number) = (line.file.to_owned(), line.number);
        if found == 0 {
            return Ok(false);
        }
        if found != expected {
            return Err(TableError::FieldCount { file, line: number, found, expected }.into());
        }
        let fields: Vec<&str> = (0..found).map(|at| reader.fields.get(at)).collect();
        self.read_fields(&fields, block).map(|()| true).map_err(|fault| match fault {
            RowFault::Field { at, expected } => TableError::Field {
                file,
                line: number,
                number: at + 1,
                column: self
                    .mapped
                    .targets
                    .get(at)
                    .copied()
                    .flatten()
                    .map_or("", |(name, _)| name)
                    .to_owned(),
                value: fields.get(at).map_or_else(String::new, |text| shown(text)),
                expected,
            }
            .into(),
            RowFault::Unit(problem) => {
                TachometerError::Mapping { file: format!("{file}, line {number}"), problem }
            }
        })
    }

    fn read_fields(&mut self, fields: &[&str], block: &mut TachometerBlock) -> Result<(), RowFault> {
        let text = |at: usize| fields.get(at).copied().unwrap_or_default();
        let MappedColumns { time: time_at, form, date, run, .. } = self.mapped;
        let ns = self.clock.read(text(time_at), date.map_or("", text), self.style);
        let ns = ns.map_err(|expected| RowFault::Field { at: time_at, expected })?;
        let time = Timestamp::from_ns(ns);
        block.times.push(time);
        if let Some(at) = run {
            let read = read_field(Slot::Run, text(at), &mut self.runs, block);
            read.map_err(|expected| RowFault::Field { at, expected })?;
        }
        let run = block.run(block.len() - 1);
        if let (0, Some((step, name))) = (run, self.units.other_unit(form, time)) {
            let mapped = self.name(time_at);
            return Err(RowFault::Unit(format!(
                "the times rise by {step} s from row to row, which cannot be an odometry period; map \
                 the column as {name} instead of {mapped}"
            )));
        }
        while self.paths.len() <= run {
            self.paths.push([WheelPath::default(); 2]);
        }
        let mut speeds = [None; 2];
        let mut fastest = None;
        for at in 0..fields.len() {
            let fault = |expected| RowFault::Field { at, expected };
            let Some((_, target)) = self.mapped.targets.get(at).copied().flatten() else { continue };
            match target {
                Target::Time(_) | Target::Own(Slot::Run) => {}
                Target::Turning { wheel, unit } => {
                    let value = self.optional(text(at), turning_unit(unit)).map_err(fault)?;
                    let speed = value.map(|value| self.speed(wheel, unit, value));
                    let rate = speed.map(|speed| speed / self.pitch(wheel));
                    let period = self.vehicle.period.as_s();
                    let path = self.paths.get_mut(run).and_then(|paths| paths.get_mut(wheel));
                    let (pulses, direction) =
                        path.map(|path| path.take(time, rate, period)).unwrap_or_default();
                    block.counts[wheel].push(pulses);
                    block.directions[wheel].push(direction);
                    speeds[wheel] = speed;
                    fastest = fastest.or(value.map(|value| (at, target, value)));
                }
                Target::TrueSpeed(m_per_s) => {
                    let value = self.optional(text(at), "a speed").map_err(fault)?;
                    block.numbers[Quantity::TrueSpeed.slot()]
                        .push(value.map_or(f64::NAN, |value| value * m_per_s));
                }
                Target::Own(Slot::Direction(wheel) | Slot::Edge(wheel)) if self.mapped.turns(wheel) => {}
                Target::Own(slot) => {
                    let plain = if matches!(slot, Slot::Unused) {
                        text(at).into()
                    } else {
                        self.style.point(text(at)).map_err(fault)?
                    };
                    read_field(slot, &plain, &mut self.runs, block).map_err(fault)?;
                }
            }
        }
        match fastest {
            Some((at, target, value)) if self.units.too_fast(time, speeds) => {
                let (cure, name) = (self.units.cure(target, value), self.name(at));
                let top = self.vehicle.max_speed.as_m_per_s();
                Err(RowFault::Unit(format!(
                    "column {} ({name}): `{}` is faster than the {top} m/s of the vehicle for longer than a second; {cure}",
                    at + 1,
                    shown(text(at)),
                )))
            }
            _ => Ok(()),
        }
    }

    fn name(&self, at: usize) -> &'static str {
        self.mapped.targets.get(at).copied().flatten().map_or("", |(name, _)| name)
    }

    fn optional(&self, text: &str, what: &str) -> Result<Option<f64>, String> {
        if is_missing(text) {
            return Ok(None);
        }
        let value = self.style.point(text)?.parse::<f64>().ok().filter(|value| value.is_finite());
        value.map(Some).ok_or_else(|| format!("{what}, or nothing where it is missing"))
    }

    fn pitch(&self, wheel: usize) -> f64 {
        let [first, second] = self.vehicle.wheelsets;
        [first, second].get(wheel).map_or(1.0, |wheelset| wheelset.pulse_pitch().as_m())
    }

    /// The speed of the circumference (m/s).
    fn speed(&self, wheel: usize, unit: TurningUnit, value: f64) -> f64 {
        match unit {
            TurningUnit::Speed(m_per_s) => value * m_per_s,
            TurningUnit::Rpm => {
                let diameter =
                    self.vehicle.wheelsets.get(wheel).map_or(0.0, |wheelset| wheelset.diameter.as_m());
                value / MINUTE_S * std::f64::consts::PI * diameter
            }
        }
    }
}

const fn turning_unit(unit: TurningUnit) -> &'static str {
    match unit {
        TurningUnit::Speed(_) => "a finite number, the speed of the wheel",
        TurningUnit::Rpm => "a finite number of revolutions a minute",
    }
}
