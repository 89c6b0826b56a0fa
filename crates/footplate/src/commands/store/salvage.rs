//! `footplate store salvage`: what can still be read of a damaged store.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use footplate_store::salvage;
use serde_json::{Value, json};

use crate::commands::Outcome;

/// Copy what can be read of a damaged store into a new one. The damaged file is left as it is.
#[derive(Args)]
#[command(after_help = "Example: footplate store salvage --store railway.db --out salvaged.db\n\n\
                  Exit status: 0 all is there, 1 something is lost or may be, 2 nothing can be read.")]
pub(super) struct Arguments {
    /// The store to make.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Report as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, store: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let salvaged = salvage(store, &self.out)?;
        if self.json {
            let tables = salvaged.tables.iter().map(|table| {
                let counts = json!({ "rows": table.rows, "lost": table.lost, "end_is_known": table.is_end_known, "stand_ins": table.stand_ins });
                (table.name.to_owned(), counts)
            });
            let tables: Value = tables.collect::<serde_json::Map<_, _>>().into();
            writeln!(
                output,
                "{}",
                json!({
                    "file": self.out, "tables": tables, "damage": salvaged.damage, "unread_log": salvaged.unread_log,
                    "ambiguous": salvaged.ambiguous,
                })
            )?;
        } else {
            writeln!(output, "{}", self.out.display())?;
            for table in &salvaged.tables {
                write!(output, "  {:<12} {:>9} rows", table.name, table.rows)?;
                if table.lost > 0 {
                    write!(output, ", {} lost", table.lost)?;
                }
                if !table.is_end_known {
                    write!(output, ", and perhaps more at its end: no index tells how many there were")?;
                }
                if table.stand_ins > 0 {
                    write!(output, ", {} stand-ins for what they belong to", table.stand_ins)?;
                }
                writeln!(output)?;
            }
            if salvaged.ambiguous > 0 {
                writeln!(
                    output,
                    "  {} rows could belong to more than one table and did not come over",
                    salvaged.ambiguous
                )?;
            }
            if let Some(damage) = &salvaged.damage {
                writeln!(
                    output,
                    "  the file is damaged ({damage}): values in rows without a checksum, which older versions wrote, may have \
                     changed"
                )?;
            }
            if let Some(unread) = &salvaged.unread_log {
                writeln!(
                    output,
                    "  {unread}; the newest rows of every table may be lost without being counted"
                )?;
            }
        }
        Ok(if salvaged.is_all() { Outcome::Done } else { Outcome::FallsShort })
    }
}
