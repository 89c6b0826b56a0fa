//! The page: an overview, a section a train, and the recordings.

use super::data::{ReportData, TrainReport};
use super::tables;
use crate::commands::web_page::markup::{Table, text};
use crate::commands::web_page::{Language, WebPage};

const CHARTS: &str = include_str!("../../../assets/report/trains.js");

const INTRODUCTION: &str = "<p>Values are given with one standard deviation. In charts, drag to zoom, double-click or \
                            press Escape to see all again; arrow keys move along a chart that has the focus, plus and \
                            minus zoom.</p>";

pub(super) fn page(data: &ReportData) -> serde_json::Result<String> {
    let numbers: Vec<String> = data.trains.iter().map(|train| train.calibration.train.to_string()).collect();
    let title = format!("Trains {} on {}", numbers.join(", "), data.layout);
    let mut main = overview(data);
    for train in &data.trains {
        main.push_str(&section(train));
    }
    main.push_str("<section aria-labelledby=\"recordings\"><h2 id=\"recordings\">Recordings</h2>\n");
    main.push_str(&tables::polling(&data.polling));
    main.push_str("</section>\n");
    let page = WebPage {
        language: Language::English,
        title: &title,
        introduction: INTRODUCTION,
        main: &main,
        style: "",
        script: CHARTS,
    };
    page.html(data)
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
