//! What a person reads above and below the charts: in words, and as tables that need no script.

use footplate_store::odometry::{OdometryScore, RunSummary};

use super::super::recording::{WalkedRecording, WalkedRun};
use super::super::walked::{Walked, leaves_bounds};
use super::MOST_RUNS;
use crate::commands::web_page::markup::{Table, text};
use crate::counted::counted;

/// The charts from top to bottom: what each is called in the script, its heading, and what it shows.
const CHARTS: [(&str, &str, &str); 5] = [
    (
        "speed",
        "Speed",
        "The estimate, the interval in which the speed lies, and the true speed where it is known.",
    ),
    (
        "wheels",
        "Wheels",
        "How fast each wheel turned by its pulses, as the mean of five periods, beside the estimate. Shaded: where a \
         wheelset is said to slip, to slide or not to be believed, the first in the upper half, the second in the lower.",
    ),
    ("shares", "Shares and mode", "What each source had in the estimate. The strip at the top is the mode."),
    (
        "distance",
        "Distance",
        "With the truth: the distance estimated less the true one, and the interval less the true distance, which holds \
         nought as long as the bounds are right. Without: how wide the interval is, and by how much at most the distance \
         is over- and under-read.",
    ),
    (
        "acceleration",
        "Acceleration",
        "The estimate, what an accelerometer said, and the command: −100 % full brake, 100 % full traction.",
    ),
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
    let mut html = format!(
        "<p>Vehicle: {}. Preset: {}. {}, {}.</p>\n",
        text(&walked.vehicle),
        walked.preset.key(),
        counted(runs, "run"),
        counted(periods, "period"),
    );
    if let Some(scores) = walked.known_scores() {
        html.push_str(&verdict(&scores.preset(walked.preset)));
    }
    html
}

/// A score in words.
fn verdict(score: &OdometryScore) -> String {
    let (class, word) = if leaves_bounds(score) {
        ("red", "the truth left the bounds")
    } else {
        ("green", "the truth stayed within the bounds")
    };
    let mut words = Vec::new();
    if let (Some(rms), Some(worst)) = (score.speed_rms_m_s, score.speed_max_m_s) {
        words.push(format!(
            "The speed was off by {rms:.3} m/s (root mean square), by {worst:.2} m/s at worst."
        ));
    }
    if let (Some(inside), Some(width)) = (score.speed_inside_pct, score.speed_width_mean_m_s) {
        words.push(format!(
            "It lay within its bounds in {} of all periods; they were {width:.2} m/s apart on average.",
            share(inside)
        ));
    }
    if let Some(end) = score.distance_end_m {
        let way = if end < 0.0 { "short" } else { "long" };
        let part = score.distance_end_pct.map_or_else(String::new, |pct| format!(" ({:.2} %)", pct.abs()));
        words.push(format!("At the end the distance was {:.2} m{part} too {way}.", end.abs()));
    }
    if let (Some(inside), Some(width)) = (score.distance_inside_pct, score.distance_width_end_m) {
        words.push(format!(
            "It lay within its bounds in {} of all periods; they were {width:.1} m apart at the end.",
            share(inside)
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
    let mut html = String::from(
        "<section aria-label=\"Charts\">\n<p class=\"note\">Drag over a chart to zoom into a stretch of time on all of \
         them, double-click to see all again. With a chart in focus, arrow keys move along the values, plus and minus \
         zoom, Escape shows all.</p>\n<p class=\"pick\" id=\"pick\" hidden><label>Run <select></select></label></p>\n",
    );
    let runs: usize = walked.recordings.iter().map(|recording| recording.runs.len()).sum();
    if charted < runs {
        html.push_str(&format!(
            "<p class=\"note\">The first {MOST_RUNS} of {runs} runs have charts; the table below has all.</p>\n"
        ));
    }
    for (kind, heading, caption) in CHARTS {
        html.push_str(&format!(
            "<h2 id=\"{kind}\">{heading}</h2>\n<figure data-chart=\"{kind}\" aria-labelledby=\"{kind}\"><figcaption>{caption}\
             </figcaption><noscript><p>This chart needs JavaScript; the tables do without.</p></noscript></figure>\n"
        ));
    }
    html.push_str("<div id=\"marks\"></div>\n</section>\n<section aria-labelledby=\"runs\">\n<h2 id=\"runs\">Runs</h2>\n");
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
    let columns = [
        "run",
        "duration s",
        "distance m",
        "at least m",
        "at most m",
        "top speed m/s",
        "normal %",
        "one slips %",
        "correction %",
        "ambiguous %",
        "degraded %",
    ];
    const NUMBERS: &[bool] = &[false, true, true, true, true, true, true, true, true, true, true];
    let mut table = Table::new("Distance, and the share of periods in each mode", &columns, NUMBERS);
    for (name, run) in each_run(walked) {
        let summary = run.odometry.summary();
        let RunSummary { modes, top_speed, .. } = summary;
        let ways = summary.last.map(|last| [last.distance, last.distance_low, last.distance_high]);
        let mut cells = vec![name, format!("{:.2}", summary.duration().as_s())];
        match ways {
            Some(ways) => cells.extend(ways.map(|way| decimals(Some(way.as_m()), 2))),
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
    let columns = [
        "run",
        "bounds",
        "speed error m/s",
        "at worst m/s",
        "speed inside %",
        "distance error m",
        "of the way %",
        "distance inside %",
        "noticed after s",
    ];
    const NUMBERS: &[bool] = &[false, false, true, true, true, true, true, true, true];
    let mut table = Table::new("Against the truth", &columns, NUMBERS);
    for (name, score) in scored {
        let (class, word) = if leaves_bounds(&score) { ("red", "left") } else { ("green", "held") };
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
