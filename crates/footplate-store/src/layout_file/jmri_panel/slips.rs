//! The double slips of a panel: two turnouts that are joined at their toes.
//!
//! ```text
//! A == D      the first turnout decides between A and B, the second between C and D;
//!    X        each of the four routes has a state of both
//! B == C
//! ```
//!
//! A single slip lacks the route from B to C. Its turnouts are not thrown for that route, but a layout has no word for it.

use std::collections::BTreeSet;

use footplate_core::TurnoutId;
use footplate_core::track::{Leg, Place};
use roxmltree::Node;

use super::tracks::{CLOSED, Port, Tracks, number_of, stretch};
use super::{children, text_of};

/// The two turnouts, each with its state for each of the routes A-C, A-D, B-D and B-C as JMRI numbers states, where a panel does not
/// say otherwise.
const USUAL_STATES: [(&str, [&str; 4]); 2] =
    [("turnout", [CLOSED, CLOSED, THROWN, THROWN]), ("turnoutB", [CLOSED, THROWN, THROWN, CLOSED])];
const ROUTES: [&str; 4] = ["A-C", "A-D", "B-D", "B-C"];
const THROWN: &str = "4";
/// The connections of each turnout, and a route over each of them by its place in `ROUTES`, and the other route over it.
const LEGS: [[(&str, [usize; 2]); 2]; 2] = [[("A", [0, 1]), ("B", [2, 3])], [("C", [0, 3]), ("D", [1, 2])]];

impl<'a> Tracks<'a, '_> {
    /// Reads the double slips; every other slip is listed, and tracks end at it.
    pub(super) fn read_slips(&mut self) {
        for slip in children(self.editor, "layoutSlip") {
            let ident = slip.attribute("ident").unwrap_or_default();
            if let Err(why) = self.slip(slip, ident) {
                self.left_out.push(format!("the slip {ident}: {why}; tracks end at it"));
            }
        }
    }

    fn slip(&mut self, slip: Node<'a, '_>, ident: &str) -> Result<(), String> {
        if !matches!(slip.attribute("slipType"), Some("DOUBLE_SLIP" | "8")) {
            return Err("it is a single slip, and a layout cannot say which route it lacks".to_owned());
        }
        let mut turnouts = Vec::new();
        for ((element, usual), legs) in USUAL_STATES.into_iter().zip(LEGS) {
            let name = self.system_name(text_of(slip, element).unwrap_or_default());
            let number =
                number_of(name).ok_or_else(|| format!("its `{element}` is `{name}`, without a number"))?;
            let state = |route: usize| {
                let written = children(slip, "states")
                    .next()
                    .and_then(|states| text_of(children(states, ROUTES.get(route)?).next()?, element));
                written.or_else(|| usual.get(route).copied())
            };
            let [one, other] = legs.map(|(letter, [route, same])| {
                (state(route) == state(same)).then(|| (letter, state(route) == Some(CLOSED)))
            });
            let (Some((first, is_closed)), Some((second, is_other))) = (one, other) else {
                return Err(format!("the states of its `{element}` are not those of a turnout at one end"));
            };
            if is_closed == is_other {
                return Err(format!("its `{element}` lies alike for {first} and {second}"));
            }
            let [straight, curved] = if is_closed { [first, second] } else { [second, first] };
            turnouts.push((number, [(straight, Leg::Straight), (curved, Leg::Curved)]));
        }
        let lies_in = self.detected(slip);
        self.with_turnouts.extend(slip.attribute("blockname").map(str::to_owned));
        let toes = turnouts.into_iter().map(|(number, legs)| {
            let names = [format!("BR{number}"), format!("MR{number}")];
            self.draw(&names, slip, ["xcen", "ycen"]);
            let [branch, merge] = &names;
            for (letter, leg) in legs {
                self.connect(slip, ident, letter, Port::of(branch, merge, Some(leg)), lies_in.clone());
            }
            let toe = Port::of(merge, branch, None);
            self.places.push(Place::Turnout { names, turnout: TurnoutId(number) });
            toe
        });
        let toes: Vec<Port> = toes.collect();
        if let [one, other] = toes.as_slice() {
            self.in_one_place.insert(self.stretches.len());
            self.stretches.push((stretch(one, other), BTreeSet::new()));
        }
        Ok(())
    }
}
