//! Reads the `speedprofile` of a JMRI roster entry.
//!
//! ```text
//! locomotive-config / locomotive
//!     locoaddress / dcclocoaddress number="5253"        older files: attribute dccAddress of locomotive
//!     attributepairs / keyvaluepair / key, value        free; ours begin with `Footplate.`
//!     speedprofile
//!         overRunTimeForward, overRunTimeReverse        ms or s, by version: not used
//!         speeds / speed / step, forward, reverse       throttle × 1000; mm/s of the model, 0 is not measured
//!     values / CVvalue name="3" value="10"              as last read or typed; 0 often means never read
//! ```
//!
//! Steps follow no grid: automatic learning adds what the throttle happened to be. DTDs are refused, so that no entity can
//! grow, and the number of nodes is limited.

use footplate_core::TrainId;
use roxmltree::{Document, Node, ParsingOptions};

use super::error::{ProfileError, ProfileProblem};
use super::profile::{ProfileNote, ProfileSpeed, SpeedProfile};
use crate::table::shown;
use crate::text_file::TextPlace;

/// More nodes than any roster entry has: each CV is one, and decoders have at most a few thousand.
const MOST_NODES: u32 = 200_000;
/// More speeds than JMRI has settings.
const MOST_SPEEDS: usize = 1_001;
/// The throttle setting of full speed.
pub(super) const FULL: f64 = 1_000.0;
/// Keys of our attributes begin like this.
pub(super) const OURS: &str = "Footplate.";
/// The key of a step's numbers, before the setting.
pub(super) const OUR_STEP: &str = "Footplate.step.";
/// Seconds from rest to full speed for each unit of CV 3 or 4 by the standard (NMRA S-9.2.2); decoders count from 0.25 s.
const SECONDS_PER_MOMENTUM: f64 = 0.5;
/// The bit of CV 23 and 24 that makes them negative (NMRA S-9.2.2).
const NEGATIVE: u16 = 128;
/// A written speed that differs from ours by more was changed since (mm/s): we write two decimals.
const AS_WRITTEN_MM_S: f64 = 0.006;

/// A parsed roster entry.
pub(super) struct RosterEntry<'i> {
    file: &'i str,
    text: &'i str,
    pub(super) document: Document<'i>,
}

impl<'i> RosterEntry<'i> {
    pub(super) fn parse(file: &'i str, text: &'i str) -> Result<Self, ProfileError> {
        let options =
            ParsingOptions { allow_dtd: false, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).map_err(|error| {
            let place = TextPlace::of_xml(file, text, &error);
            // Messages repeat what is in the file, which may be long.
            let problem: String = error.to_string().chars().take(200).collect();
            ProfileError::Wrong { place, problem: ProfileProblem::Xml(problem) }
        })?;
        Ok(Self { file, text, document })
    }

    pub(super) fn wrong(&self, byte: usize, problem: ProfileProblem) -> ProfileError {
        ProfileError::Wrong { place: TextPlace::of_byte(self.file, self.text, byte), problem }
    }

    /// The element of the locomotive.
    pub(super) fn locomotive(&self) -> Result<Node<'_, 'i>, ProfileError> {
        let root = self.document.root_element();
        let begin = root.range().start;
        if root.tag_name().name() != "locomotive-config" {
            let found = shown(root.tag_name().name());
            return Err(self.wrong(begin, ProfileProblem::Root(found)));
        }
        let missing = ProfileProblem::Missing { of: "locomotive-config", element: "locomotive" };
        child(root, "locomotive").ok_or_else(|| self.wrong(begin, missing))
    }

    fn number(
        &self,
        node: Node<'_, 'i>,
        element: &'static str,
        expected: &'static str,
        most: f64,
    ) -> Result<f64, ProfileError> {
        let text = node.text().unwrap_or_default().trim();
        let number = text.parse::<f64>().ok().filter(|number| (0.0..=most).contains(number));
        number.ok_or_else(|| {
            // The text, or the element if there is none.
            let range = node.first_child().map_or_else(|| node.range(), |text| text.range());
            self.wrong(range.start, ProfileProblem::Value { element, value: shown(text), expected })
        })
    }

    pub(super) fn line(&self, node: Node<'_, 'i>) -> u64 {
        u64::from(self.document.text_pos_at(node.range().start).row)
    }
}

/// The first child element of a name.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// All child elements of a name.
pub(super) fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.is_element() && child.tag_name().name() == name)
}

/// Reads the profile of a roster entry.
pub(super) fn read(file: &str, text: &str) -> Result<SpeedProfile, ProfileError> {
    let entry = RosterEntry::parse(file, text)?;
    let locomotive = entry.locomotive()?;
    let mut profile =
        SpeedProfile { source: file.to_owned(), train: address(locomotive), ..SpeedProfile::default() };
    let Some(written) = child(locomotive, "speedprofile") else {
        return Err(ProfileError::NoSpeeds(file.to_owned()));
    };
    for name in ["overRunTimeForward", "overRunTimeReverse"] {
        let Some(overrun) = child(written, name) else { continue };
        let value = overrun.text().unwrap_or_default().trim();
        if value.parse::<f64>().ok() != Some(0.0) && !value.is_empty() {
            profile.notes.push(ProfileNote::Overrun { line: entry.line(overrun), value: shown(value) });
        }
    }
    let ours = our_steps(locomotive);
    let speeds = child(written, "speeds").into_iter().flat_map(|speeds| children(speeds, "speed"));
    for (nth, speed) in speeds.enumerate() {
        if nth >= MOST_SPEEDS {
            return Err(entry.wrong(speed.range().start, ProfileProblem::TooMany(MOST_SPEEDS)));
        }
        let step = child(speed, "step").ok_or_else(|| {
            entry.wrong(speed.range().start, ProfileProblem::Missing { of: "speed", element: "step" })
        })?;
        let step = entry.number(step, "step", "a throttle setting from 0 to 1000", FULL)?;
        let read = |name: &'static str| {
            let found = child(speed, name);
            found.map(|node| entry.number(node, name, "a speed in mm/s, 0 or more", f64::MAX)).transpose()
        };
        let (forward_mm_s, reverse_mm_s) = (read("forward")?, read("reverse")?);
        let as_written = |ours: &&OurStep| {
            ours.step == step
                && forward_mm_s.is_some_and(|speed| (speed - ours.speed_mm_s).abs() < AS_WRITTEN_MM_S)
        };
        let uncertainty_mm_s = ours.iter().find(as_written).map(|ours| ours.uncertainty_mm_s);
        let line = entry.line(speed);
        profile.push(ProfileSpeed {
            line,
            throttle: step / FULL,
            forward_mm_s,
            reverse_mm_s,
            uncertainty_mm_s,
        });
    }
    momentum(locomotive, &mut profile);
    Ok(profile)
}

/// The decoder's address.
fn address(locomotive: Node<'_, '_>) -> Option<TrainId> {
    let of_element = || child(child(locomotive, "locoaddress")?, "dcclocoaddress")?.attribute("number");
    of_element().or_else(|| locomotive.attribute("dccAddress"))?.trim().parse().ok().map(TrainId)
}

/// What we wrote for a step.
struct OurStep {
    step: f64,
    speed_mm_s: f64,
    uncertainty_mm_s: f64,
}

/// The numbers that we wrote as attributes.
fn our_steps(locomotive: Node<'_, '_>) -> Vec<OurStep> {
    let pairs =
        child(locomotive, "attributepairs").into_iter().flat_map(|pairs| children(pairs, "keyvaluepair"));
    let ours = pairs.filter_map(|pair| {
        let step = child(pair, "key")?.text()?.strip_prefix(OUR_STEP)?.parse().ok()?;
        let value = child(pair, "value")?.text()?;
        let named = |name: &str| -> Option<f64> {
            let number =
                value.split_whitespace().find_map(|part| part.strip_prefix(name)?.strip_prefix('='))?;
            number.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0)
        };
        Some(OurStep { step, speed_mm_s: named("speed_mm_s")?, uncertainty_mm_s: named("uncertainty_mm_s")? })
    });
    ours.take(MOST_SPEEDS).collect()
}

/// The ramps of the decoder by its CVs, where they are not zero.
fn momentum(locomotive: Node<'_, '_>, profile: &mut SpeedProfile) {
    let cv = |number: &str| -> u16 {
        let values = child(locomotive, "values").into_iter().flat_map(|values| children(values, "CVvalue"));
        let found = values.into_iter().find(|value| value.attribute("name") == Some(number));
        let value = found.and_then(|value| value.attribute("value")?.trim().parse::<u8>().ok());
        u16::from(value.unwrap_or(0))
    };
    let signed = |value: u16| {
        let size = f64::from(value & (NEGATIVE - 1));
        if value & NEGATIVE == 0 { size } else { -size }
    };
    let ramp = |base: &str, adjusted: &str| {
        let base = cv(base);
        // Without a base the adjustment was not read either, or is for a consist.
        let units = if base == 0 { 0.0 } else { (f64::from(base) + signed(cv(adjusted))).max(0.0) };
        SECONDS_PER_MOMENTUM * units
    };
    let (speeding_up_s, slowing_down_s) = (ramp("3", "23"), ramp("4", "24"));
    let known = |seconds: f64| (seconds > 0.0).then_some(seconds);
    (profile.speeding_up_s, profile.slowing_down_s) = (known(speeding_up_s), known(slowing_down_s));
    if speeding_up_s + slowing_down_s > 0.0 {
        profile.notes.push(ProfileNote::Momentum { speeding_up_s, slowing_down_s });
    }
}
