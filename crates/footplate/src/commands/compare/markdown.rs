//! A comparison as a page of the documentation.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::PathBuf;

use footplate_store::{CheckedFigure, CrossCheck};

use super::{approach, counted_from, left_out, verdict};

/// What is compared.
pub(super) struct Sources<'a> {
    pub(super) logs: &'a [PathBuf],
    pub(super) tables: &'a [PathBuf],
}

/// The folder of the tables whose README says more.
const OUR_TABLES: &str = "`testdata/published-tables`";

const ABOUT_OUR_TABLES: &str = "\
[`testdata/published-tables`](../../testdata/published-tables/README.md), which says where the figures come from and what
the comparison shows. The number of a train stayed on the locomotive for years; the locomotive was serviced, wore and ran
on rails that were laid anew.";

const HEAD: &str = "
A difference is in percent of theirs, and in σ: of how far two teams differ anyway, our uncertainty, and the scatter of
their readings. Up to 2 σ counts as agreement. *n* is the number of readings behind their figure.
";

pub(super) fn write(check: &CrossCheck, sources: &Sources<'_>, output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "# Beside what other teams measured\n")?;
    let (logs, tables) = (folders(sources.logs), folders(sources.tables));
    writeln!(
        output,
        "Made by `footplate compare --markdown` from the recordings in {logs} and the tables in"
    )?;
    if tables == OUR_TABLES {
        writeln!(output, "{ABOUT_OUR_TABLES}")?;
    } else {
        writeln!(output, "{tables}.")?;
    }
    writeln!(output, "{HEAD}")?;
    let sections = [
        ("Steady speeds", "mm/s", &check.speeds, check.speed_spread_percent),
        ("Stopping distances", "mm", &check.stops, check.stop_spread_percent),
    ];
    for (title, unit, figures, spread) in sections {
        let Some(spread) = spread.filter(|_| !figures.is_empty()) else { continue };
        let agree = figures.iter().filter(|figure| figure.agrees()).count();
        writeln!(output, "## {title}\n")?;
        writeln!(
            output,
            "{agree} of {} figures agree. Single teams differ from the mean of all by {spread:.1} % \
             (one standard deviation, from the\nteams themselves), so two teams differ by {:.1} %.\n",
            figures.len(),
            spread * std::f64::consts::SQRT_2
        )?;
        if unit == "mm" {
            writeln!(
                output,
                "Ours are counted from the command. Where a team does not say whether it counts from \
                 the command or from the sensor\nreport that triggered it, σ includes another 70 ms of \
                 running.\n"
            )?;
        }
        write_teams(figures, output)?;
        write_figures(figures, unit, output)?;
    }
    left_out(check).iter().try_for_each(|sentence| writeln!(output, "Left out: {sentence}."))
}

/// The folders of files, each once.
fn folders(files: &[PathBuf]) -> String {
    let folder = |file: &PathBuf| match file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => format!("`{}`", folder.display()),
        None => "this folder".to_owned(),
    };
    let distinct: BTreeSet<String> = files.iter().map(folder).collect();
    distinct.into_iter().collect::<Vec<_>>().join(", ")
}

fn write_teams(figures: &[CheckedFigure], output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "| team | compared | agree | ours, in the middle |\n| --- | ---: | ---: | ---: |")?;
    for team in CrossCheck::by_team(figures) {
        writeln!(
            output,
            "| {} | {} | {} | {:+.1} % |",
            cell(&team.team),
            team.compared,
            team.agree,
            team.median_percent
        )?;
    }
    writeln!(output)
}

fn write_figures(figures: &[CheckedFigure], unit: &str, output: &mut dyn Write) -> io::Result<()> {
    writeln!(
        output,
        "| train | step | reached from | ours {unit} | theirs {unit} | n | difference | σ | verdict | team | counted \
         from |\n| ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | --- | --- | --- |"
    )?;
    for figure in figures {
        let [value, uncertainty] = figure.ours;
        writeln!(
            output,
            "| {} | {} | {} | {value:.1} ± {uncertainty:.1} | {:.1} | {} | {:+.1} % | {:+.1} | {} | {} {} | {} |",
            figure.train,
            figure.step,
            approach(figure.approach),
            figure.theirs,
            figure.readings,
            figure.difference_percent(),
            figure.sigmas(),
            verdict(figure, figure.agrees()),
            cell(&figure.team),
            cell(&figure.term),
            counted_from(figure.quantity).unwrap_or("–"),
        )?;
    }
    writeln!(output)
}

/// Text of others as it may stand in a cell.
fn cell(text: &str) -> String {
    text.replace('\\', "\\\\").replace('|', "\\|").replace('<', "&lt;")
}
