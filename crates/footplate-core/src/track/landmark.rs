//! Landmarks: places by name, such as `C13+120mm`.

use alloc::borrow::ToOwned;
use alloc::string::String;
use core::fmt;

use crate::ids::NodeId;
use crate::track::{Layout, PathError, Position, TurnoutStates};
use crate::units::Length;

/// A place given by a node and the distance beyond it, in the direction of travel of the node.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Landmark {
    /// The node: usually a sensor, but turnouts and track ends have names, too.
    pub node: NodeId,
    /// The distance beyond it; negative before it.
    pub offset: Length,
}

/// Why a text is not a landmark.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum LandmarkError {
    /// No node has that name.
    UnknownNode {
        /// The name.
        name: String,
        /// A name of this layout, as an example.
        example: Option<String>,
        /// The layout.
        layout: String,
    },
    /// The text after the name is not an offset.
    IllegalOffset {
        /// The text, from the sign on.
        found: String,
        /// The name before it.
        name: String,
    },
}

impl fmt::Display for LandmarkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownNode { name, example, layout } => {
                write!(f, "{layout} has no place `{}`", name.escape_debug())?;
                example.as_ref().map_or(Ok(()), |example| {
                    write!(f, ": write a name like `{example}` or `{example}+120mm`")
                })
            }
            Self::IllegalOffset { found, name } => write!(
                f,
                "`{}` is not an offset: write millimetres, for example `{name}+120mm` or \
                 `{name}-30.5mm`",
                found.escape_debug()
            ),
        }
    }
}

impl core::error::Error for LandmarkError {}

impl Layout {
    /// Reads a landmark: a name, or a name and an offset in millimetres as in `C13+120mm` or `C13 - 30.5 mm`.
    ///
    /// # Errors
    /// [`LandmarkError`] with the part of the text at fault.
    pub fn landmark(&self, text: &str) -> Result<Landmark, LandmarkError> {
        // Names contain no signs.
        let sign = text.find(['+', '-']).unwrap_or(text.len());
        let (name, offset) = text.split_at(sign);
        let name = name.trim();
        let node = self.node_named(name).ok_or_else(|| LandmarkError::UnknownNode {
            name: name.to_owned(),
            example: self.sensors().next().map(|(sensor, _)| self.sensor_name(sensor).to_owned()),
            layout: self.name().to_owned(),
        })?;
        let illegal = || LandmarkError::IllegalOffset { found: offset.to_owned(), name: name.to_owned() };
        let offset =
            if offset.is_empty() { Length::ZERO } else { read_offset(offset).ok_or_else(illegal)? };
        Ok(Landmark { node, offset })
    }

    /// Formats a landmark so that [`landmark`](Self::landmark) reads it back, to the nanometre.
    pub fn display(&self, landmark: Landmark) -> impl fmt::Display + '_ {
        Shown { layout: self, landmark }
    }

    /// The position of a landmark with the turnouts in these positions.
    ///
    /// # Errors
    /// [`PathError`] if the path from the node cannot be followed that far.
    pub fn locate(&self, landmark: Landmark, turnouts: &TurnoutStates) -> Result<Position, PathError> {
        let Landmark { node, offset } = landmark;
        let ahead = self.edge_ahead(node, turnouts);
        match ahead.map(|edge| Position { edge, offset: Length::ZERO }) {
            Ok(position) if offset >= Length::ZERO => self.advance(position, offset, turnouts),
            Err(stop) if offset > Length::ZERO => Err(stop.after(offset)),
            _ => {
                // Back from the node: ahead from its reverse, in the other direction of travel.
                let edge = self.edge_ahead(node.reverse(), turnouts);
                let edge = edge.map_err(|stop| stop.after(-offset))?;
                let behind = self.advance(Position { edge, offset: Length::ZERO }, -offset, turnouts)?;
                let position = self.reversed(behind).ok_or(PathError::NotOnLayout)?;
                self.advance(position, Length::ZERO, turnouts)
            }
        }
    }
}

/// A sign, digits and `mm`, with optional spaces.
fn read_offset(text: &str) -> Option<Length> {
    let number = text.trim_end().strip_suffix("mm")?.trim_end();
    let digits = number.strip_prefix(['+', '-'])?.trim_start();
    // No second sign, and neither `inf` nor `nan`.
    let is_number = digits.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let mm = digits.parse::<f64>().ok().filter(|mm| is_number && mm.is_finite())?;
    Some(Length::from_mm(if number.starts_with('-') { -mm } else { mm }))
}

struct Shown<'l> {
    layout: &'l Layout,
    landmark: Landmark,
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Landmark { node, offset } = self.landmark;
        f.write_str(self.layout.node_name(node))?;
        // Hides the rounding of metres to millimetres.
        let mm = libm::round(offset.as_mm() * 1e6) / 1e6;
        if mm == 0.0 { Ok(()) } else { write!(f, "{mm:+}mm") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::Leg;
    use crate::track::example::oval;
    use std::string::ToString;

    #[test]
    fn a_landmark_reads_back_as_it_is_shown() {
        let layout = oval();
        for (text, shown, mm) in [
            ("A1", "A1", 0.0),
            ("A1+120mm", "A1+120mm", 120.0),
            (" A1 + 120 mm ", "A1+120mm", 120.0),
            ("D2-30.5mm", "D2-30.5mm", -30.5),
            ("EX1-.25mm", "EX1-0.25mm", -0.25),
            ("BR1+1e2mm", "BR1+100mm", 100.0),
            ("A1-0mm", "A1", 0.0),
        ] {
            let landmark = layout.landmark(text).unwrap();
            assert!((landmark.offset.as_mm() - mm).abs() < 1e-9, "{text}");
            assert_eq!(layout.display(landmark).to_string(), shown);
            assert_eq!(layout.landmark(shown).unwrap(), landmark);
        }
    }

    #[test]
    fn the_error_for_a_text_that_names_no_place_shows_a_valid_one() {
        let layout = oval();
        for (text, message) in [
            ("Z9", "oval has no place `Z9`: write a name like `A1` or `A1+120mm`"),
            ("", "oval has no place ``: write a name like `A1` or `A1+120mm`"),
            ("A1+120", "`+120` is not an offset: write millimetres, for example `A1+120mm` or `A1-30.5mm`"),
            ("A1+-5mm", "`+-5mm` is not an offset: write millimetres, for example `A1+120mm` or `A1-30.5mm`"),
            (
                "A1+infmm",
                "`+infmm` is not an offset: write millimetres, for example `A1+120mm` or `A1-30.5mm`",
            ),
            (
                "A1-1e999mm",
                "`-1e999mm` is not an offset: write millimetres, for example `A1+120mm` or `A1-30.5mm`",
            ),
            ("A1+mm", "`+mm` is not an offset: write millimetres, for example `A1+120mm` or `A1-30.5mm`"),
        ] {
            assert_eq!(layout.landmark(text).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn a_landmark_is_located_ahead_of_its_node_and_behind_it() {
        let layout = oval();
        let turnouts = [(TurnoutId(1), Leg::Curved), (TurnoutId(2), Leg::Curved)].into_iter().collect();
        let located = |text| {
            let position = layout.locate(layout.landmark(text).unwrap(), &turnouts).unwrap();
            let edge = layout.edge(position.edge).unwrap();
            let mm = (position.offset.as_mm() * 1e6).round() / 1e6;
            (layout.node_name(edge.from), layout.node_name(edge.to), mm)
        };
        assert_eq!(located("A1+120mm"), ("BR1", "C1", 20.0));
        assert_eq!(located("D1-120mm"), ("C1", "MR2", 130.0));
        assert_eq!(located("D1"), ("D1", "A1", 0.0));
        assert_eq!(located("EX2"), ("E1", "EX2", 40.0));
        assert_eq!(located("EX2-40mm"), ("E1", "EX2", 0.0));
        assert_eq!(located("EN1"), ("EN1", "E1", 0.0));
    }

    #[test]
    fn a_landmark_beyond_known_track_has_no_position() {
        let layout = oval();
        let unknown = TurnoutStates::unknown();
        let refused = |text| layout.locate(layout.landmark(text).unwrap(), &unknown).unwrap_err().to_string();
        assert_eq!(refused("EX2+1mm"), "the track ends at `EX2`, 1 mm before the end of the path");
        assert_eq!(refused("EN1-7mm"), "the track ends at `EX1`, 7 mm before the end of the path");
        assert_eq!(
            refused("BR1+5mm"),
            "the position of turnout 1, 5 mm before the end of the path, is unknown: throw it first"
        );
        let toe = layout.locate(layout.landmark("BR1").unwrap(), &unknown).unwrap();
        assert_eq!(
            layout.edge(toe.edge).map(|edge| edge.to),
            layout.node_named("BR1"),
            "the toe itself is known"
        );
    }
}
