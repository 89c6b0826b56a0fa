//! The page: an overview, a section a train, and the recordings.

use super::data::{ReportData, TrainReport};
use super::tables;
use crate::commands::web_page::markup::{Table, text, without_script};
use crate::commands::web_page::{Language, WebPage};

const CHARTS: &str = include_str!("../../../assets/report/trains.js");

const INTRODUCTION: [&str; 2] = [
    "<p>Values are given with one standard deviation. In charts, drag to zoom, double-click or press Escape to see all \
     again; arrow keys move along a chart that has the focus, plus and minus zoom.</p>",
    "<p>Werte haben eine Standardabweichung bei sich. In Diagrammen vergrößert Ziehen, ein Doppelklick oder Escape zeigt \
     wieder alles; Pfeiltasten gehen ein gewähltes Diagramm entlang, Plus und Minus vergrößern.</p>",
];

pub(super) fn page(data: &ReportData, language: Language) -> serde_json::Result<String> {
    let numbers: Vec<String> = data.trains.iter().map(|train| train.calibration.train.to_string()).collect();
    let title = match language {
        Language::English => {
            let word = if numbers.len() == 1 { "Train" } else { "Trains" };
            format!("{word} {} on {}", numbers.join(", "), data.layout)
        }
        Language::German => {
            let word = if numbers.len() == 1 { "Zug" } else { "Züge" };
            format!("{word} {} auf {}", numbers.join(", "), data.layout)
        }
    };
    let mut main = overview(data, language);
    for train in &data.trains {
        main.push_str(&section(train, language));
    }
    main.push_str("<section aria-labelledby=\"recordings\"><h2 id=\"recordings\">");
    main.push_str(language.pick("Recordings", "Aufzeichnungen"));
    main.push_str("</h2>\n");
    main.push_str(&tables::polling(&data.polling, language));
    main.push_str("</section>\n");
    let [introduction, german_introduction] = INTRODUCTION;
    let warning =
        data.warning.iter().map(|said| format!("<p class=\"warning\" role=\"alert\">{}</p>\n", text(said)));
    let introduction = warning.collect::<String>() + language.pick(introduction, german_introduction);
    let page = WebPage {
        language,
        title: &title,
        introduction: &introduction,
        main: &main,
        style: "",
        script: CHARTS,
    };
    page.html(data)
}

fn overview(data: &ReportData, language: Language) -> String {
    let columns = language.pick(
        "train | state | what to know | prediction error | steps | detections",
        "Zug | Zustand | was zu wissen ist | Vorhersagefehler | Stufen | Meldungen",
    );
    let caption = language.pick("All trains", "Alle Züge");
    let mut table = Table::new(caption, columns, &[true, false, false, false, true, true]);
    for train in &data.trains {
        let health = &train.health;
        let number = train.calibration.train;
        let mut steps: Vec<_> =
            train.calibration.steps.iter().filter(|step| step.is_measured()).map(|step| step.step).collect();
        steps.dedup();
        table.row_of_markup(&[
            format!("<a href=\"#train-{number}\">{number}</a>"),
            badge(train, language),
            text(&health.summary),
            text(health.checks.first().map_or("", |check| check.found.as_str())),
            steps.len().to_string(),
            train.forecasts.len().to_string(),
        ]);
    }
    format!(
        "<section aria-label=\"{}\">\n{}</section>\n",
        language.pick("Overview", "Überblick"),
        table.end()
    )
}

fn badge(train: &TrainReport, language: Language) -> String {
    tables::badge(train.health.state, language)
}

fn section(train: &TrainReport, language: Language) -> String {
    let form = &train.calibration;
    let (number, name) = (form.train, language.pick("Train", "Zug"));
    let heading = |english, german| format!("<h3>{}</h3>\n", language.pick(english, german));
    let mut html = format!(
        "<section id=\"train-{number}\" aria-labelledby=\"name-{number}\">\n<h2 id=\"name-{number}\">{name} {number}</h2>\n\
         <p class=\"health\">{} {}</p>\n",
        badge(train, language),
        text(&train.health.summary)
    );
    html.push_str(&tables::health(&train.health, language));
    html.push_str(&heading("Speed", "Tempo"));
    let chart = |kind, english, german| chart(train, kind, language.pick(english, german), language);
    html.push_str(&chart(
        "speeds",
        "Speed by throttle step, and the side it was reached from",
        "Tempo je Fahrstufe, und die Seite, von der sie erreicht wurde",
    ));
    html.push_str(&tables::speeds(form, language));
    html.push_str(&heading("Changes of speed", "Tempowechsel"));
    html.push_str(&tables::laws(form, language));
    if !train.changes.is_empty() {
        html.push_str(&chart(
            "change",
            "A change of speed: the fitted law and the sensor reports",
            "Ein Tempowechsel: das Gesetz dazu, und die gemessenen Kontakte",
        ));
    }
    html.push_str(&heading("Forecasts", "Vorhersagen"));
    html.push_str(&chart(
        "forecasts",
        "Lateness of each sensor report against its prediction; shaded: the 90 % interval stated \
         beforehand",
        "Wie viel später als vorhergesagt jeder Kontakt sich meldete; getönt: das vorher genannte 90-%-Intervall",
    ));
    html.push_str(&heading("Stops", "Halte"));
    html.push_str(&chart(
        "stops",
        "Stopping distance by speed: the motion model, and what a tape measured",
        "Anhalteweg nach Tempo: das Fahrmodell, und was mit dem Maßband gemessen wurde",
    ));
    html.push_str(&tables::stops(form, language));
    html.push_str(&heading("Lengths", "Längen"));
    html.push_str(&tables::lengths(form, language));
    html.push_str(&heading("Suspicious measurements", "Verdächtige Messungen"));
    html.push_str(&tables::suspicious(form, language));
    html.push_str("</section>\n");
    html
}

/// The place of a chart; the script draws it.
fn chart(train: &TrainReport, kind: &str, caption: &str, language: Language) -> String {
    format!(
        "<figure data-chart=\"{kind}\" data-train=\"{}\"><figcaption>{caption}</figcaption>\
         <noscript><p>{}</p></noscript></figure>\n",
        train.calibration.train,
        without_script(language)
    )
}
