//! A comparison as a person reads it in a terminal.

use std::io::{self, Write};

use footplate_store::{CheckedFigure, CrossCheck};

use super::{approach, counted_from, left_out, verdict};

pub(super) fn write(check: &CrossCheck, output: &mut dyn Write) -> io::Result<()> {
    for (title, unit, figures, spread) in [
        ("Steady speeds", "mm/s", &check.speeds, check.speed_spread_percent),
        ("Stopping distances, ours counted from the command", "mm", &check.stops, check.stop_spread_percent),
    ] {
        let Some(spread) = spread.filter(|_| !figures.is_empty()) else { continue };
        writeln!(output, "{title} ({unit}); standard deviation of one team about all: {spread:.1} %\n")?;
        writeln!(
            output,
            "  train  step  reached from             ours    theirs   n  difference       σ  verdict       team"
        )?;
        for figure in figures {
            write_figure(figure, output)?;
        }
        writeln!(output)?;
        for team in CrossCheck::by_team(figures) {
            let share = format!("{} of {}", team.agree, team.compared);
            writeln!(
                output,
                "  {share:>9} agree, ours {:+5.1} % in the middle: {}",
                team.median_percent, team.team
            )?;
        }
        writeln!(output)?;
    }
    left_out(check).iter().try_for_each(|sentence| writeln!(output, "{sentence}"))
}

fn write_figure(figure: &CheckedFigure, output: &mut dyn Write) -> io::Result<()> {
    let [value, uncertainty] = figure.ours;
    let counted =
        counted_from(figure.quantity).map_or_else(String::new, |from| format!(", counted from: {from}"));
    writeln!(
        output,
        "  {:>5}  {:>4}  {:<12} {value:>9.1} ± {uncertainty:<5.1} {:>7.1} {:>3}    {:>+6.1} %  {:>+6.1}  {:<12}  {} {}{counted}",
        figure.train,
        figure.step,
        approach(figure.approach),
        figure.theirs,
        figure.readings,
        figure.difference_percent(),
        figure.sigmas(),
        verdict(figure, figure.agrees()),
        figure.team,
        figure.term,
    )
}
