//! Estimates as CSV, row by row.

use std::io::{self, Write};

use footplate_core::estimation::odometry::{Mode, MotionEstimate, WheelState};

use crate::decimal::push_unscaled;

/// The columns of a result, in order; `run_id` follows where there are many runs.
pub const RESULT_COLUMNS: [&str; 16] = [
    "t_s",
    "speed_m_s",
    "speed_low_m_s",
    "speed_high_m_s",
    "accel_m_s2",
    "distance_m",
    "distance_low_m",
    "distance_high_m",
    "over_m",
    "under_m",
    "wheel_1",
    "wheel_2",
    "mode",
    "share_1",
    "share_2",
    "share_3",
];

/// How much is gathered before it is written (bytes).
const GATHERED: usize = 64 * 1024;

/// Writes estimates as CSV. Numbers have the fewest digits that read back as the same number, times all that they
/// have to the nanosecond.
#[derive(Debug)]
pub struct ResultCsv<W> {
    output: W,
    text: Vec<u8>,
    with_runs: bool,
}

impl<W: Write> ResultCsv<W> {
    /// Begins with the header.
    pub fn new(output: W, with_runs: bool) -> Self {
        let mut text = RESULT_COLUMNS.join(",").into_bytes();
        if with_runs {
            text.extend(b",run_id");
        }
        text.push(b'\n');
        Self { output, text, with_runs }
    }

    /// Adds an estimate of a run.
    ///
    /// # Errors
    /// What the system said.
    pub fn push(&mut self, run: &str, estimate: &MotionEstimate) -> io::Result<()> {
        let text = &mut self.text;
        push_unscaled(text, estimate.time.as_ns(), 9);
        for number in numbers(estimate) {
            push_number(text, number);
        }
        for wheel in estimate.wheels {
            push_word(text, wheel_word(wheel));
        }
        push_word(text, mode_word(estimate.mode));
        for share in estimate.shares {
            push_number(text, share);
        }
        if self.with_runs {
            push_word(text, &quoted(run));
        }
        text.push(b'\n');
        if text.len() >= GATHERED { self.write() } else { Ok(()) }
    }

    /// Hands on everything up to the last estimate.
    ///
    /// # Errors
    /// What the system said.
    pub fn flush(&mut self) -> io::Result<()> {
        self.write()?;
        self.output.flush()
    }

    /// Ends the file and gives it back.
    ///
    /// # Errors
    /// What the system said.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        Ok(self.output)
    }

    fn write(&mut self) -> io::Result<()> {
        self.output.write_all(&self.text)?;
        self.text.clear();
        Ok(())
    }
}

/// The numbers between the time and the wheelsets, in the order of [`RESULT_COLUMNS`].
pub(super) fn numbers(estimate: &MotionEstimate) -> [f64; 9] {
    [
        estimate.speed.as_m_per_s(),
        estimate.speed_low.as_m_per_s(),
        estimate.speed_high.as_m_per_s(),
        estimate.acceleration.as_m_per_s2(),
        estimate.distance.as_m(),
        estimate.distance_low.as_m(),
        estimate.distance_high.as_m(),
        estimate.over.as_m(),
        estimate.under.as_m(),
    ]
}

pub(super) const fn wheel_word(state: WheelState) -> &'static str {
    match state {
        WheelState::Rolling => "rolling",
        WheelState::Spin => "spin",
        WheelState::Slide => "slide",
        WheelState::Excluded => "excluded",
    }
}

pub(super) const fn mode_word(mode: Mode) -> &'static str {
    match mode {
        Mode::Normal => "normal",
        Mode::OneSlip => "one_slip",
        Mode::Correction => "correction",
        Mode::Ambiguous => "ambiguous",
        Mode::Degraded => "degraded",
    }
}

fn push_number(text: &mut Vec<u8>, number: f64) {
    push_word(text, zmij::Buffer::new().format(number));
}

fn push_word(text: &mut Vec<u8>, word: &str) {
    text.push(b',');
    text.extend(word.as_bytes());
}

/// A name as a CSV field.
fn quoted(name: &str) -> std::borrow::Cow<'_, str> {
    if name.contains([',', '"', '\n', '\r']) || name.trim() != name {
        format!("\"{}\"", name.replace('"', "\"\"")).into()
    } else {
        name.into()
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::{Acceleration, Length, Speed, Timestamp};

    use super::*;

    #[test]
    fn a_row_says_everything_in_the_order_of_the_header() {
        let estimate = MotionEstimate {
            time: Timestamp::from_ns(1_250_000_000),
            speed: Speed::from_m_per_s(10.0),
            speed_deviation: Speed::ZERO,
            speed_low: Speed::from_m_per_s(9.75),
            speed_high: Speed::from_m_per_s(10.25),
            acceleration: Acceleration::from_m_per_s2(-0.1),
            distance: Length::from_m(100.0 / 3.0),
            distance_low: Length::from_m(33.0),
            distance_high: Length::from_m(34.0),
            over: Length::from_m(0.5),
            under: Length::from_m(1e-9),
            wheels: [WheelState::Rolling, WheelState::Slide],
            mode: Mode::OneSlip,
            shares: [1.0, 0.0, 0.0],
        };
        let mut result = ResultCsv::new(Vec::new(), true);
        result.push("a, b", &estimate).unwrap();
        let text = String::from_utf8(result.finish().unwrap()).unwrap();
        let (header, row) = text.split_once('\n').unwrap();
        assert_eq!(header, format!("{},run_id", RESULT_COLUMNS.join(",")));
        assert_eq!(
            row,
            "1.25,10.0,9.75,10.25,-0.1,33.333333333333336,33.0,34.0,0.5,1e-9,rolling,slide,one_slip,1.0,0.0,0.0,\
             \"a, b\"\n"
        );
    }
}
