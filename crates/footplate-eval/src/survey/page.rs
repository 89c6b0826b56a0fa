//! The page of the survey scores: as text, as documentation, and as JSON.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::{Distance, Surveyed};
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# How well trains survey a layout

All lengths of a layout are taken away but one. Random simulated trains are calibrated on it from nothing known, one after
the other, over the bytes of a virtual 6051, and the lengths follow from all of them together. The simulator shares no
formula with what drives, and its truth is used for these figures alone.
";

const LEGEND: &str = "\
Distances are sums of edges between neighbouring sensors, in true millimetres. *Off* is the root mean square of what the
survey is off, *worst* the farthest; *inside* is how many true distances lie in their 95 % interval. *Path* is the root mean
square of a survey that knows all path lengths exactly, and the known distance: speed on curves and slopes is
not that on the straight, and sensors do not close where a tape would be laid; no survey by timing is nearer in the mean.
*Scale* is by how much all distances are longer in common, and what the survey says of that (one standard deviation).
*Unseen* are distances over which no train ran.
";

/// The content of the page.
pub struct Page<'r> {
    /// The results of all worlds.
    pub worlds: &'r [Surveyed],
    /// The names of the sensors at the ends of the known distance.
    pub known: [String; 2],
    /// The arguments of the command line.
    pub asked: String,
}

impl WrittenScores for Page<'_> {
    const SCORER: &'static str = "survey";

    fn head(&self) -> String {
        let [from, to] = &self.known;
        let asked = &self.asked;
        format!(
            "{HEAD}\nMade by `footplate simulate survey {asked}`. Known is the edge from {from} to {to}.\n\n{LEGEND}"
        )
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| seed | distances | unseen | off mm | worst mm | path mm | inside % | scale % | said ± % |\n\
             | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for world in self.worlds {
            let figures = Figures::of(world.scored());
            writeln!(
                output,
                "| {} | {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {:+.1} | {:.1} |",
                world.seed,
                figures.count,
                world.not_run,
                figures.off,
                figures.worst,
                figures.path_length,
                figures.inside_pct,
                figures.scale_pct,
                100.0 * world.scale
            )?;
        }
        let all = Figures::of(self.worlds.iter().flat_map(Surveyed::scored));
        let unseen: usize = self.worlds.iter().map(|world| world.not_run).sum();
        writeln!(
            output,
            "| all | {} | {unseen} | {:.1} | {:.1} | {:.1} | {:.1} | | |",
            all.count, all.off, all.worst, all.path_length, all.inside_pct
        )
    }

    fn rates(&self) -> Vec<Rate> {
        let wrecked = self.worlds.iter().filter(|world| !world.incidents.is_empty()).count();
        let distances = || self.worlds.iter().flat_map(Surveyed::scored);
        let outside = distances().filter(|distance| !distance.is_inside()).count();
        vec![
            Rate::grief(wrecked, self.worlds.len()),
            Rate::new("distances outside 95 %", outside, distances().count()),
        ]
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let worlds = self.worlds.iter().map(|world| {
            let figures = Figures::of(world.scored());
            let distances = world.distances.iter().map(|distance| {
                json!({
                    "from": distance.from, "to": distance.to, "true_mm": distance.true_mm, "off_mm": distance.off_mm,
                    "uncertainty_mm": distance.uncertainty_mm, "path_off_mm": distance.path_off_mm,
                })
            });
            json!({
                "seed": world.seed, "rms_mm": figures.off, "worst_mm": figures.worst, "path_rms_mm": figures.path_length,
                "inside_pct": figures.inside_pct, "scale_pct": figures.scale_pct, "said_scale_pct": 100.0 * world.scale,
                "unseen": world.not_run, "incidents": world.incidents, "distances": distances.collect::<Vec<Value>>(),
            })
        });
        let all = Figures::of(self.worlds.iter().flat_map(Surveyed::scored));
        let (off, inside) = (all.off, all.inside_pct);
        writeln!(
            output,
            "{}",
            json!({ "rms_mm": off, "path_rms_mm": all.path_length, "inside_pct": inside, "worlds": worlds.collect::<Vec<Value>>() })
        )
    }
}

impl Surveyed {
    /// All distances except the known one.
    fn scored(&self) -> impl Iterator<Item = &Distance> {
        self.distances.iter().filter(|distance| !distance.is_known)
    }
}

/// Statistics over many distances.
struct Figures {
    count: usize,
    off: f64,
    worst: f64,
    path_length: f64,
    inside_pct: f64,
    scale_pct: f64,
}

impl Figures {
    fn of<'d>(distances: impl Iterator<Item = &'d Distance>) -> Self {
        let all: Vec<&Distance> = distances.collect();
        let count = all.len().max(1) as f64;
        let sum = |of: fn(&Distance) -> f64| all.iter().map(|distance| of(distance)).sum::<f64>();
        Self {
            count: all.len(),
            off: (sum(|distance| distance.off_mm * distance.off_mm) / count).sqrt(),
            worst: all.iter().map(|distance| distance.off_mm.abs()).fold(0.0, f64::max),
            path_length: (sum(|distance| distance.path_off_mm * distance.path_off_mm) / count).sqrt(),
            inside_pct: 100.0 * sum(|distance| f64::from(u8::from(distance.is_inside()))) / count,
            scale_pct: 100.0 * sum(|distance| distance.off_mm) / sum(|distance| distance.true_mm).max(1.0),
        }
    }
}
