//! What a person reads above and below the charts: in words, and as tables that need no script.

use footplate_store::odometry::{OdometryScore, RunSummary};

use super::super::recording::{WalkedRecording, WalkedRun};
use super::super::walked::{Walked, leaves_bounds};
use super::MOST_RUNS;
use crate::commands::web_page::Language;
use crate::commands::web_page::markup::{Table, text, without_script};
use crate::counted::counted;

/// A chart: what it is called in the script, and its heading and what it shows in both languages.
struct Chart {
    kind: &'static str,
    heading: [&'static str; 2],
    caption: [&'static str; 2],
}

/// The charts from top to bottom.
const CHARTS: [Chart; 5] = [
    Chart {
        kind: "speed",
        heading: ["Speed", "Tempo"],
        caption: [
            "The estimate, the interval in which the speed lies, and the true speed where it is known.",
            "Die Schätzung, das Intervall, in dem das Tempo liegt, und das wahre Tempo, wo es bekannt ist.",
        ],
    },
    Chart {
        kind: "wheels",
        heading: ["Wheels", "Räder"],
        caption: [
            "How fast each wheel turned by its pulses, as the mean of five periods, beside the estimate. Shaded: where a \
             wheelset is said to slip, to slide or not to be trusted, the first in the upper half, the second in the lower.",
            "Wie schnell sich jedes Rad nach seinen Impulsen drehte, als Mittel von fünf Perioden, neben der Schätzung. \
             Getönt: wo ein Radsatz schleudern oder gleiten soll oder nicht geglaubt wird, der erste in der oberen Hälfte, der \
             zweite in der unteren.",
        ],
    },
    Chart {
        kind: "shares",
        heading: ["Shares and mode", "Anteile und Betriebsart"],
        caption: [
            "What each source had in the estimate. The strip at the top is the mode.",
            "Was jede Quelle zur Schätzung beitrug. Der Streifen oben ist die Betriebsart.",
        ],
    },
    Chart {
        kind: "distance",
        heading: ["Distance", "Weg"],
        caption: [
            "With the truth: the distance estimated less the true one, and the interval less the true distance, which holds \
             nought as long as the bounds are right. Without: how wide the interval is, and by how much at most the distance \
             is over- and under-read.",
            "Mit der Wahrheit: der geschätzte Weg weniger dem wahren und das Intervall weniger dem wahren Weg, in dem die Null \
             liegt, solange die Grenzen stimmen. Ohne: wie breit das Intervall ist, und um wie viel der Weg höchstens zu lang \
             und zu kurz gelesen wird.",
        ],
    },
    Chart {
        kind: "acceleration",
        heading: ["Acceleration", "Beschleunigung"],
        caption: [
            "The estimate, what an accelerometer said, and the command: −100 % full brake, 100 % full traction.",
            "Die Schätzung, was ein Beschleunigungsmesser sagte, und der Befehl: −100 % volle Bremse, 100 % volle Zugkraft.",
        ],
    },
];

/// What a run is called where there may be several recordings.
pub(super) fn run_name(recording: &WalkedRecording, run: &WalkedRun, several: bool) -> String {
    match &run.id {
        Some(id) if several => format!("{}: {id}", recording.file),
        _ => run.name.clone(),
    }
}

/// What the page is about, and how good it was.
pub(super) fn introduction(walked: &Walked) -> String {
    let runs: usize = walked.recordings.iter().map(|recording| recording.runs.len()).sum();
    let periods: u64 = walked
        .recordings
        .iter()
        .flat_map(|recording| &recording.runs)
        .map(|run| run.odometry.summary().periods)
        .sum();
    let (vehicle, preset) = (text(&walked.vehicle), walked.preset.key());
    let mut html = match walked.language {
        Language::English => {
            let (runs, periods) = (counted(runs, "run"), counted(periods, "period"));
            format!("<p>Vehicle: {vehicle}. Preset: {preset}. {runs}, {periods}.</p>\n")
        }
        Language::German => {
            let (one_run, one_period) = (
                if runs == 1 { "Fahrt" } else { "Fahrten" },
                if periods == 1 { "Periode" } else { "Perioden" },
            );
            format!(
                "<p>Fahrzeug: {vehicle}. Voreinstellung: {preset}. {runs} {one_run}, {periods} {one_period}.</p>\n"
            )
        }
    };
    for warning in walked.warnings(walked.language) {
        html.push_str(&format!("<p class=\"warning\" role=\"alert\">{}</p>\n", text(&warning)));
    }
    if let Some(scores) = walked.known_scores() {
        let score = scores.preset(walked.preset);
        html.push_str(&verdict(&score, walked.language));
    }
    html
}

/// Whether the bounds held.
pub(super) fn held(score: &OdometryScore) -> &'static str {
    if leaves_bounds(score) { "the truth left the bounds" } else { "the truth stayed within the bounds" }
}

/// A score in words.
fn verdict(score: &OdometryScore, language: Language) -> String {
    let pick = |english: String, german: String| match language {
        Language::English => english,
        Language::German => german,
    };
    let (class, word) = if leaves_bounds(score) {
        ("red", language.pick(held(score), "die Wahrheit hat die Grenzen verlassen"))
    } else {
        ("green", language.pick(held(score), "die Wahrheit blieb in den Grenzen"))
    };
    let mut words = Vec::new();
    if let (Some(rms), Some(worst)) = (score.speed_rms_m_s, score.speed_max_m_s) {
        words.push(pick(
            format!("The speed was off by {rms:.3} m/s (root mean square), by {worst:.2} m/s at worst."),
            format!(
                "Das Tempo lag um {rms:.3} m/s daneben (quadratisches Mittel), höchstens um {worst:.2} m/s."
            ),
        ));
    }
    if let (Some(inside), Some(width)) = (score.speed_inside_pct.map(share), score.speed_width_mean_m_s) {
        words.push(pick(
            format!(
                "It lay within its bounds in {inside} of all periods; they were {width:.2} m/s apart on average."
            ),
            format!(
                "Es lag in {inside} aller Perioden in seinen Grenzen; sie waren im Mittel {width:.2} m/s auseinander."
            ),
        ));
    }
    if let Some(end) = score.distance_end_m {
        let sense = if end < 0.0 { ["short", "kurz"] } else { ["long", "lang"] };
        let part = score.distance_end_pct.map_or_else(String::new, |pct| format!(" ({:.2} %)", pct.abs()));
        let off = format!("{:.2} m{part}", end.abs());
        words.push(pick(
            format!("At the end the distance was {off} too {}.", sense[0]),
            format!("Am Ende war der Weg {off} zu {}.", sense[1]),
        ));
    }
    if let (Some(inside), Some(width)) = (score.distance_inside_pct.map(share), score.distance_width_end_m) {
        words.push(pick(
            format!("It lay within its bounds in {inside} of all periods; they were {width:.1} m apart at the end."),
            format!("Er lag in {inside} aller Perioden in seinen Grenzen; am Ende waren sie {width:.1} m auseinander."),
        ));
    }
    format!("<p class=\"verdict\"><span class=\"state {class}\">{word}</span> {}</p>\n", words.join(" "))
}

/// Per cent, of which 100 is said only if it is all.
fn share(pct: f64) -> String {
    if pct >= 100.0 { "100 %".to_owned() } else { format!("{:.2} %", (pct * 100.0).floor() / 100.0) }
}

/// The charts' places and the tables.
pub(super) fn main(walked: &Walked, charted: usize) -> String {
    let language = walked.language;
    let (charts, zooms, run) = match language {
        Language::English => (
            "Charts",
            "Drag over a chart to zoom into a stretch of time on all of them, double-click to see all again. With a chart in \
             focus, arrow keys move along the values, plus and minus zoom, Escape shows all.",
            "Run",
        ),
        Language::German => (
            "Diagramme",
            "Über ein Diagramm ziehen vergrößert ein Stück Zeit auf allen, ein Doppelklick zeigt wieder alles. In einem \
             gewählten Diagramm gehen Pfeiltasten die Werte entlang, Plus und Minus vergrößern, Escape zeigt alles.",
            "Fahrt",
        ),
    };
    let mut html = format!(
        "<section aria-label=\"{charts}\">\n<p class=\"note\">{zooms}</p>\n<p class=\"pick\" id=\"pick\" hidden><label>{run} \
         <select></select></label></p>\n"
    );
    let runs: usize = walked.recordings.iter().map(|recording| recording.runs.len()).sum();
    if charted < runs {
        let said = match language {
            Language::English => {
                format!("The first {MOST_RUNS} of {runs} runs have charts; the table below has all.")
            }
            Language::German => {
                format!(
                    "Die ersten {MOST_RUNS} von {runs} Fahrten haben Diagramme; die Tabelle unten hat alle."
                )
            }
        };
        html.push_str(&format!("<p class=\"note\">{said}</p>\n"));
    }
    let no_script = without_script(language);
    for Chart { kind, heading: [heading, german_heading], caption: [caption, german_caption] } in CHARTS {
        let (heading, caption) =
            (language.pick(heading, german_heading), language.pick(caption, german_caption));
        html.push_str(&format!(
            "<h2 id=\"{kind}\">{heading}</h2>\n<figure data-chart=\"{kind}\" aria-labelledby=\"{kind}\"><figcaption>{caption}\
             </figcaption><noscript><p>{no_script}</p></noscript></figure>\n"
        ));
    }
    html.push_str(
        "<div id=\"marks\"></div>\n</section>\n<section aria-labelledby=\"runs\">\n<h2 id=\"runs\">",
    );
    html.push_str(language.pick("Runs", "Fahrten"));
    html.push_str("</h2>\n");
    html.push_str(&runs_table(walked));
    html.push_str(&score_table(walked));
    html.push_str("</section>\n");
    html
}

/// Every run with what its table rows call it.
fn each_run(walked: &Walked) -> impl Iterator<Item = (String, &WalkedRun)> {
    let several = walked.recordings.len() > 1;
    walked.recordings.iter().flat_map(move |recording| {
        recording.runs.iter().map(move |run| (run_name(recording, run, several), run))
    })
}

fn runs_table(walked: &Walked) -> String {
    let columns = walked.language.pick(
        "run | duration s | distance m | at least m | at most m | top speed m/s | normal % | one slips % | \
         correction % | ambiguous % | degraded %",
        "Fahrt | Dauer s | Weg m | mindestens m | höchstens m | Höchsttempo m/s | normal % | einer gleitet % | \
         Korrektur % | mehrdeutig % | beeinträchtigt %",
    );
    let caption = walked.language.pick(
        "Distance, and the share of periods in each mode",
        "Weg, und der Anteil der Perioden in jeder Betriebsart",
    );
    let mut table =
        Table::new(caption, columns, &[false, true, true, true, true, true, true, true, true, true, true]);
    for (name, run) in each_run(walked) {
        let summary = run.odometry.summary();
        let RunSummary { modes, top_speed, .. } = summary;
        let distances = summary
            .last
            .map(|last| [last.distance, last.guaranteed.distance_low, last.guaranteed.distance_high]);
        let mut cells = vec![name, format!("{:.2}", summary.duration().as_s())];
        match distances {
            Some(distances) => cells.extend(distances.map(|distance| decimals(Some(distance.as_m()), 2))),
            None => cells.extend([(); 3].map(|()| "–".to_owned())),
        }
        cells.push(decimals(Some(top_speed.as_m_per_s()), 2));
        let counts = [modes.normal, modes.one_slip, modes.correction, modes.ambiguous, modes.degraded];
        cells.extend(
            counts.map(|count| decimals(Some(100.0 * count as f64 / summary.periods.max(1) as f64), 1)),
        );
        table.row(&cells);
    }
    table.end()
}

/// A row a run whose truth is known; nothing if there is none.
fn score_table(walked: &Walked) -> String {
    let mut scored = each_run(walked)
        .filter_map(|(name, run)| Some((name, run.odometry.scores()?.preset(walked.preset))))
        .filter(|(_, score)| score.scored > 0)
        .peekable();
    if scored.peek().is_none() {
        return String::new();
    }
    let columns = walked.language.pick(
        "run | bounds | speed error m/s | at worst m/s | speed inside % | distance error m | of distance % | \
         distance inside % | noticed after s",
        "Fahrt | Grenzen | Tempofehler m/s | höchstens m/s | Tempo darin % | Wegfehler m | vom Weg % | \
         Weg darin % | bemerkt nach s",
    );
    let caption = walked.language.pick("Against the truth", "Gegen die Wahrheit");
    let mut table = Table::new(caption, columns, &[false, false, true, true, true, true, true, true, true]);
    for (name, score) in scored {
        let (class, word) = if leaves_bounds(&score) {
            ("red", walked.language.pick("left", "verlassen"))
        } else {
            ("green", walked.language.pick("held", "gehalten"))
        };
        let mut cells = vec![text(&name), format!("<span class=\"state {class}\">{word}</span>")];
        cells.extend([
            decimals(score.speed_rms_m_s, 3),
            decimals(score.speed_max_m_s, 2),
            decimals(score.speed_inside_pct, 2),
            decimals(score.distance_end_m, 2),
            decimals(score.distance_end_pct, 3),
            decimals(score.distance_inside_pct, 2),
            decimals(score.detect_delay_s, 2),
        ]);
        table.row_of_markup(&cells);
    }
    table.end()
}

/// A figure with a true minus sign, or a dash.
fn decimals(figure: Option<f64>, decimals: usize) -> String {
    let text = figure.map_or_else(|| "–".to_owned(), |figure| format!("{figure:.decimals$}"));
    let nought = text.trim_start_matches('-');
    if nought.chars().all(|c| "0.".contains(c)) { nought.to_owned() } else { text.replace('-', "−") }
}
