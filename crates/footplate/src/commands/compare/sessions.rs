//! `footplate compare --session`: what two sessions found of the same trains.

use std::io::{self, Write};

use footplate_store::{SessionCheck, SessionFigure, standardised};
use serde_json::{Value, json};

use super::approach;

pub(super) fn write(check: &SessionCheck, output: &mut dyn Write) -> io::Result<()> {
    for (title, unit, figures) in
        [("Steady speeds", "mm/s", &check.speeds), ("Stopping distances", "mm", &check.stops)]
    {
        let Some([rms, worst]) = standardised(figures) else { continue };
        writeln!(output, "{title} ({unit})\n")?;
        writeln!(
            output,
            "  train  step  reached from             ours            theirs  difference       σ"
        )?;
        for figure in figures {
            let SessionFigure { train, step, ours, theirs, .. } = figure;
            writeln!(
                output,
                "  {train:>5}  {step:>4}  {:<12} {:>9.1} ± {:<5.1} {:>9.1} ± {:<5.1}   {:>+6.1} %  {:>+6.1}",
                approach(figure.approach),
                ours[0],
                ours[1],
                theirs[0],
                theirs[1],
                figure.difference_percent(),
                figure.sigmas(),
            )?;
        }
        writeln!(
            output,
            "\n  {} figures: rms {rms:.2} σ, at most {worst:.1} σ; about 1 if what sessions differ by is stated truly\n",
            figures.len()
        )?;
    }
    Ok(())
}

pub(super) fn as_json(check: &SessionCheck) -> Value {
    let figures = |figures: &[SessionFigure]| {
        let [rms, worst] = standardised(figures).map_or([None, None], |both| both.map(Some));
        json!({
            "rms_sigmas": rms,
            "worst_sigmas": worst,
            "figures": figures.iter().map(figure).collect::<Vec<Value>>(),
        })
    };
    json!({ "speeds_mm_per_s": figures(&check.speeds), "stops_mm": figures(&check.stops) })
}

fn figure(figure: &SessionFigure) -> Value {
    json!({
        "train": figure.train, "step": figure.step, "approach": approach(figure.approach),
        "ours": figure.ours[0], "our_uncertainty": figure.ours[1],
        "theirs": figure.theirs[0], "their_uncertainty": figure.theirs[1],
        "difference_percent": figure.difference_percent(), "sigmas": figure.sigmas(),
    })
}
