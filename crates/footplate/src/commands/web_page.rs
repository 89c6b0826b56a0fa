//! A web page in one file, with its styles, scripts and data, that any browser opens without a network.

mod language;
pub(super) mod markup;

pub(crate) use language::Language;
use serde::Serialize;

use markup::{json, text};

const STYLE: &str = include_str!("../../assets/page/page.css");
const CHART: &str = include_str!("../../assets/page/chart.js");
const UPLOT_STYLE: &str = include_str!("../../assets/vendor/uplot/uPlot.min.css");
const UPLOT: &str = include_str!("../../assets/vendor/uplot/uPlot.iife.min.js");

/// The content security policy: the page loads nothing.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// The content of one page.
pub(super) struct WebPage<'a> {
    pub(super) language: Language,
    /// The title, as plain text.
    pub(super) title: &'a str,
    /// Markup below the heading.
    pub(super) introduction: &'a str,
    /// The markup of everything else.
    pub(super) main: &'a str,
    /// Styles in addition to those of all pages.
    pub(super) style: &'a str,
    /// The script that draws the page's charts with the functions of `assets/page/chart.js`.
    pub(super) script: &'a str,
}

impl WebPage<'_> {
    /// The whole page; its scripts find `data` in the element `report`.
    ///
    /// # Errors
    /// The data cannot be written as JSON.
    pub(super) fn html(&self, data: &impl Serialize) -> serde_json::Result<String> {
        let Self { language, title, introduction, main, style, script } = self;
        let language = language.code();
        let title = text(title);
        let data = json(&serde_json::to_string(data)?);
        Ok(format!(
            "<!doctype html>\n<html lang=\"{language}\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{UPLOT_STYLE}\n{STYLE}{style}</style>\n\
             </head>\n<body>\n<header><h1>{title}</h1>\n{introduction}</header>\n<main>\n{main}</main>\n\
             <script type=\"application/json\" id=\"report\">{data}</script>\n<script>{UPLOT}</script>\n\
             <script type=\"module\">\n{CHART}\n{script}</script>\n</body>\n</html>\n"
        ))
    }
}
