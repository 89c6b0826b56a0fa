//! The language that a page is read in.

use clap::ValueEnum;

/// A language that pages are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum Language {
    #[default]
    #[value(name = "en")]
    English,
    #[value(name = "de")]
    German,
}

impl Language {
    /// That of a code as browsers write it, such as `de-AT`; English for all that pages are not written in.
    pub(crate) fn of_code(code: &str) -> Self {
        match code.split('-').next() {
            Some(language) if language.eq_ignore_ascii_case("de") => Self::German,
            _ => Self::English,
        }
    }

    /// What browsers call it.
    pub(super) const fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::German => "de",
        }
    }

    /// The one of two texts that is read in it; both say the same.
    pub(in crate::commands) const fn pick<'t>(self, english: &'t str, german: &'t str) -> &'t str {
        match self {
            Self::English => english,
            Self::German => german,
        }
    }
}
