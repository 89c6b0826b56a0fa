//! The page: one HTML file with its styles, scripts and data inside.

use std::fmt::Write;

use super::data::{ReportData, TrainReport};
use super::markup::{Table, json, text};
use super::tables;

const STYLE: &str = include_str!("../../../assets/report/report.css");
const CHARTS: &str = include_str!("../../../assets/report/charts.js");
const UPLOT_STYLE: &str = include_str!("../../../assets/vendor/uplot/uPlot.min.css");
const UPLOT: &str = include_str!("../../../assets/vendor/uplot/uPlot.iife.min.js");

/// What a browser may do for the page: nothing that leaves it.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

pub(super) fn page(data: &ReportData) -> serde_json::Result<String> {
    let numbers: Vec<String> = data.trains.iter().map(|train| train.calibration.train.to_string()).collect();
    let title = format!("Trains {} on {}", numbers.join(", "), data.layout);
    let title = text(&title);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{UPLOT_STYLE}\n{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>\n<p>Values are given with one standard deviation. In charts, drag to zoom, double-click \
         or press Escape to see all again; arrow keys move along a chart that has the focus.</p></header>\n<main>\n"
    );
    html.push_str(&overview(data));
    for train in &data.trains {
        html.push_str(&section(train));
    }
    html.push_str("<section aria-labelledby=\"recordings\"><h2 id=\"recordings\">Recordings</h2>\n");
    html.push_str(&tables::polling(&data.polling));
    html.push_str("</section>\n</main>\n");
    let _ = write!(
        html,
        "<script type=\"application/json\" id=\"report\">{}</script>\n<script>{UPLOT}</script>\n\
         <script type=\"module\">\n{CHARTS}</script>\n</body>\n</html>\n",
        json(&serde_json::to_string(data)?)
    );
    Ok(html)
}

fn overview(data: &ReportData) -> String {
    let columns = ["train", "state", "what to know", "prediction error", "steps", "contacts"];
    let mut table = Table::new("All trains", &columns, &[true, false, false, false, true, true]);
    for train in &data.trains {
        let health = &train.health;
        let number = train.calibration.train;
        let mut steps: Vec<_> = train.calibration.speeds.iter().map(|speed| speed.step).collect();
        steps.dedup();
        table.row_of_markup(&[
            format!("<a href=\"#train-{number}\">{number}</a>"),
            badge(train),
            text(&health.summary),
            text(health.checks.first().map_or("", |check| check.found.as_str())),
            steps.len().to_string(),
            train.forecasts.len().to_string(),
        ]);
    }
    format!("<section aria-label=\"Overview\">\n{}</section>\n", table.end())
}

fn badge(train: &TrainReport) -> String {
    format!("<span class=\"state {}\">{}</span>", train.health.state.class(), train.health.state.word())
}

fn section(train: &TrainReport) -> String {
    let form = &train.calibration;
    let number = form.train;
    let mut html = format!(
        "<section id=\"train-{number}\" aria-labelledby=\"name-{number}\">\n<h2 id=\"name-{number}\">Train {number}</h2>\n\
         <p class=\"health\">{} {}</p>\n",
        badge(train),
        text(&train.health.summary)
    );
    html.push_str(&tables::health(&train.health));
    html.push_str("<h3>Speed</h3>\n");
    html.push_str(&chart(train, "speeds", "Speed by throttle step, and the side it was reached from"));
    html.push_str(&tables::speeds(form));
    html.push_str("<h3>Changes of speed</h3>\n");
    html.push_str(&tables::laws(form));
    if !train.changes.is_empty() {
        html.push_str(&chart(
            train,
            "change",
            "A change of speed: the fitted law, and the contacts measured",
        ));
    }
    html.push_str("<h3>Forecasts</h3>\n");
    html.push_str(&chart(
        train,
        "forecasts",
        "How much later than forecast each contact reported; shaded: the 90 % interval stated beforehand",
    ));
    if let Some(stops) = &form.stops {
        html.push_str("<h3>Stops</h3>\n");
        html.push_str(&chart(train, "stops", "Stopping distance by speed, and the two-term law"));
        html.push_str(&tables::stops(stops));
    }
    html.push_str("<h3>Lengths</h3>\n");
    html.push_str(&tables::lengths(form));
    html.push_str("<h3>Suspicious measurements</h3>\n");
    html.push_str(&tables::suspicious(form));
    html.push_str("</section>\n");
    html
}

/// The place of a chart; the script draws it.
fn chart(train: &TrainReport, kind: &str, caption: &str) -> String {
    format!(
        "<figure data-chart=\"{kind}\" data-train=\"{}\"><figcaption>{caption}</figcaption>\
         <noscript><p>This chart needs JavaScript; the tables do without.</p></noscript></figure>\n",
        train.calibration.train
    )
}
