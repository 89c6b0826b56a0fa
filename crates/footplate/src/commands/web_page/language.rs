//! The language of a page.

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
    /// The language of a browser's language code, such as `de-AT`; English if there is no translation.
    pub(crate) fn of_code(code: &str) -> Self {
        match code.split('-').next() {
            Some(language) if language.eq_ignore_ascii_case("de") => Self::German,
            _ => Self::English,
        }
    }

    /// The language code.
    pub(super) const fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::German => "de",
        }
    }

    /// The text in this language.
    pub(in crate::commands) const fn pick<'t>(self, english: &'t str, german: &'t str) -> &'t str {
        match self {
            Self::English => english,
            Self::German => german,
        }
    }
}
