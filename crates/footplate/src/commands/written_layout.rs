//! A layout with the text it was read from, so that the session records exactly the layout it runs on.

use footplate_core::TurnoutId;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_store::{layout_named, parse_layout, write_layout};

/// A layout and its text.
#[derive(Debug, Clone)]
pub(crate) struct WrittenLayout {
    pub(crate) layout: Layout,
    /// The text of a layout file.
    pub(crate) text: String,
}

impl WrittenLayout {
    /// Reads a built-in layout or a file. The layout is parsed from its written form, which is rounded to a nanometre,
    /// so that a later parse gives the same bits.
    ///
    /// # Errors
    /// There is no such layout, or it is invalid.
    pub(crate) fn named(name: &str) -> anyhow::Result<Self> {
        Self::of(name, write_layout(&layout_named(name)?))
    }

    /// Parses the text of a layout; `place` is its name in messages.
    ///
    /// # Errors
    /// The text is not a layout.
    pub(crate) fn of(place: &str, text: String) -> anyhow::Result<Self> {
        let layout = parse_layout(place, text.as_bytes())?.layout;
        Ok(Self { layout, text })
    }

    /// The known turnout positions.
    pub(crate) fn legs(&self, turnouts: &TurnoutStates) -> Vec<(TurnoutId, Leg)> {
        let known = |(turnout, _)| Some((turnout, turnouts.get(turnout)?));
        self.layout.turnouts().filter_map(known).collect()
    }
}
