//! A layout together with the text of it, so that what is driven on is what can be written down.

use footplate_core::TurnoutId;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_store::{layout_named, parse_layout, write_layout};

/// A layout as its own text says it.
#[derive(Debug, Clone)]
pub(crate) struct WrittenLayout {
    pub(crate) layout: Layout,
    /// The text of a layout file.
    pub(crate) text: String,
}

impl WrittenLayout {
    /// The layout of a name or a file. It is read from the text that is kept of it, which ends at the nanometre, so that
    /// both are the same to the last bit.
    ///
    /// # Errors
    /// There is no such layout, or it is wrong.
    pub(crate) fn named(name: &str) -> anyhow::Result<Self> {
        Self::of(name, write_layout(&layout_named(name)?))
    }

    /// The layout that a text says; `place` is what messages call it.
    ///
    /// # Errors
    /// The text is none of a layout.
    pub(crate) fn of(place: &str, text: String) -> anyhow::Result<Self> {
        let layout = parse_layout(place, text.as_bytes())?.layout;
        Ok(Self { layout, text })
    }

    /// How its turnouts lie, as far as that is known.
    pub(crate) fn legs(&self, turnouts: &TurnoutStates) -> Vec<(TurnoutId, Leg)> {
        let known = |(turnout, _)| Some((turnout, turnouts.get(turnout)?));
        self.layout.turnouts().filter_map(known).collect()
    }
}
