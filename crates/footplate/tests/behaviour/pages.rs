//! The examples of README and guides, run as they are printed, print what is shown there.
//!
//! A page is run in a folder of its own, from its first block to its last. In a block, `$ ` begins a command, and the lines after it
//! are what it prints; `…` stands for lines left out, and a command with no line after it may print anything. `$ cat FILE` shows a file,
//! which is written. A comment before a block, which a reader of the rendered page does not see, says what else it is:
//! `<!-- not run: WHY -->`, `<!-- file: NAME -->`, or `<!-- printed -->` for more lines of the last command.
//!
//! `./ci.sh expected` writes into the pages what is printed now.
#![cfg(unix)]

use std::fs::{self, File};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::program::folder;

const LEFT_OUT: &str = "…";

/// The page is written anew, not checked, where this is set.
const REWRITE: &str = "FOOTPLATE_REWRITE_PAGES";

struct Example {
    /// The line of the page, from zero.
    line: usize,
    command: String,
    /// Lines of the page that show what it prints, one range a block.
    shown: Vec<Range<usize>>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn lines_of(page: &Path) -> Vec<String> {
    fs::read_to_string(page).expect("the page is there").lines().map(str::to_owned).collect()
}

/// Each fenced block with its language and the comment above it.
fn blocks(page: &[String]) -> Vec<(&str, &str, Range<usize>)> {
    let mut blocks = Vec::new();
    let mut opened = None;
    for (at, line) in page.iter().enumerate() {
        let Some(language) = line.strip_prefix("```") else { continue };
        opened = match opened {
            None => Some((language, at)),
            Some((language, from)) => {
                let comment =
                    page[..from].iter().rev().find(|line| !line.is_empty()).map_or("", String::as_str);
                let inside = comment.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->"));
                blocks.push((language, inside.unwrap_or(""), from + 1..at));
                None
            }
        };
    }
    blocks
}

/// The commands of a page; files that it shows are written into the folder.
fn examples(page: &[String], folder: &Path, name: &str) -> Vec<Example> {
    let write = |file: &str, lines: Range<usize>| {
        fs::write(folder.join(file), page[lines].join("\n") + "\n").expect("a file of the page");
    };
    let mut examples: Vec<Example> = Vec::new();
    for (language, comment, inside) in blocks(page) {
        if comment.starts_with("not run: ") {
        } else if let Some(file) = comment.strip_prefix("file: ") {
            write(file, inside);
        } else if comment == "printed" {
            examples.last_mut().expect("a command before what it prints").shown.push(inside);
        } else if matches!(language, "" | "sh") {
            let starts = inside.clone().filter(|at| page[*at].starts_with("$ ")).collect::<Vec<_>>();
            if let Some(bare) =
                inside.clone().find(|at| ["footplate ", "cargo "].iter().any(|of| page[*at].starts_with(of)))
            {
                panic!(
                    "{name}:{}: begin it with `$ `, or write above the block: <!-- not run: WHY -->",
                    bare + 1
                );
            }
            for (index, line) in starts.iter().enumerate() {
                let shown = line + 1..starts.get(index + 1).copied().unwrap_or(inside.end);
                let command = page[*line][2..].to_owned();
                match command.strip_prefix("cat ") {
                    Some(file) => write(file, shown),
                    None => examples.push(Example { line: *line, command, shown: vec![shown] }),
                }
            }
        }
    }
    examples
}

/// Everything that a command prints, in the order of a terminal.
fn printed(folder: &Path, command: &str) -> (Vec<String>, Option<i32>) {
    let program = Path::new(env!("CARGO_BIN_EXE_footplate"));
    let path = format!(
        "{}:{}",
        program.parent().expect("a folder").display(),
        std::env::var("PATH").expect("a path")
    );
    let command = command.replacen("cargo run --release --", "footplate", 1);
    let out = folder.join("printed.txt");
    let both = File::create(&out).expect("a file of the test");
    let ended = Command::new("sh")
        .args(["-c", &command.replacen("cargo run --release", "footplate", 1)])
        .env("PATH", path)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(both.try_clone().expect("the same file"))
        .stderr(both)
        .status()
        .expect("a shell");
    (lines_of(&out), ended.code())
}

/// A line without what differs from run to run: dates, and the time that the computer took.
fn comparable(line: &str) -> String {
    let words = line.trim_end().split(' ').collect::<Vec<_>>();
    let digits = |word: &str, shape: &str| {
        word.len() == shape.len()
            && word.bytes().zip(shape.bytes()).all(|(is, of)| is == of || is.is_ascii_digit() && of == b'0')
    };
    let mut kept = Vec::new();
    for (at, word) in words.iter().enumerate() {
        let stripped = word.trim_end_matches(',');
        let took =
            at > 0 && words[at - 1] == "took" && words.get(at + 1).is_some_and(|unit| unit.starts_with('s'));
        kept.push(match () {
            () if digits(stripped, "0000-00-00") => "DATE",
            () if digits(stripped, "00:00:00") => "TIME",
            () if took => "SOME",
            () => word,
        });
    }
    kept.join(" ")
}

/// What stays of a line if its figures change: its letters, and in a table the word that begins the row.
fn skeleton(line: &str, of_table: bool) -> (String, Option<String>) {
    let letters = comparable(line).chars().filter(|c| c.is_alphabetic()).collect();
    (letters, line.split_whitespace().next().filter(|_| of_table).map(str::to_owned))
}

/// Where each shown line stands in what is printed, `None` for lines left out; or the first shown line that is not there.
fn find(
    shown: &[&str],
    printed: &[String],
    same: impl Fn(&str, &str) -> bool,
) -> Result<Vec<Option<usize>>, usize> {
    let (mut next, mut gap, mut found) = (0, false, Vec::new());
    let mut rest = shown;
    while let Some(first) = rest.first() {
        if first.trim() == LEFT_OUT {
            (gap, rest) = (true, &rest[1..]);
            found.push(None);
            continue;
        }
        let together = rest.iter().position(|line| line.trim() == LEFT_OUT).unwrap_or(rest.len());
        let fits =
            |at: &usize| (0..together).all(|i| printed.get(at + i).is_some_and(|line| same(rest[i], line)));
        // The last lines shown are the last printed.
        let at = match (gap, together == rest.len()) {
            (false, _) => Some(next).filter(fits),
            (true, true) => printed.len().checked_sub(together).filter(|at| *at >= next).filter(fits),
            (true, false) => (next..printed.len()).find(fits),
        };
        let Some(at) = at else {
            let most = |at: usize| {
                (0..together)
                    .take_while(|i| printed.get(at + i).is_some_and(|line| same(rest[*i], line)))
                    .count()
            };
            let most = if gap { (next..printed.len()).map(most).max().unwrap_or(0) } else { most(next) };
            return Err(found.len() + most.min(together - 1));
        };
        found.extend((at..at + together).map(Some));
        (next, gap, rest) = (at + together, false, &rest[together..]);
    }
    if gap || next == printed.len() { Ok(found) } else { Err(shown.len() - 1) }
}

/// What is shown of an example, one text a line, and the line of the page; blocks are apart by lines left out.
fn shown_lines<'p>(page: &'p [String], example: &Example) -> Vec<(Option<usize>, &'p str)> {
    let mut lines = Vec::new();
    for (block, range) in example.shown.iter().filter(|range| !range.is_empty()).enumerate() {
        if block > 0 || example.shown[0].is_empty() {
            lines.push((None, LEFT_OUT));
        }
        lines.extend(range.clone().map(|at| (Some(at), page[at].as_str())));
    }
    if example.shown.len() > 1 {
        lines.push((None, LEFT_OUT));
    }
    lines
}

/// The first and last lines of what was printed.
fn brief(printed: &[String]) -> String {
    const ENDS: usize = 12;
    match printed.len() {
        count if count <= 2 * ENDS => printed.join("\n"),
        count => [&printed[..ENDS], &[LEFT_OUT.to_owned()], &printed[count - ENDS..]].concat().join("\n"),
    }
}

fn check(page: &Path, name: &str) -> Vec<String> {
    let folder = folder(&format!("page-{}", name.replace('/', "-")));
    std::os::unix::fs::symlink(root().join("testdata"), folder.join("testdata")).expect("a link");
    let mut lines = lines_of(page);
    let (mut objections, mut rewritten) = (Vec::new(), Vec::new());
    for example in examples(&lines, &folder, name) {
        let (printed, status) = printed(&folder, &example.command);
        let place = |line: usize| format!("{name}:{}: {}", line + 1, example.command);
        let shown = shown_lines(&lines, &example);
        // Status 2 is that of the errors that a page shows.
        let expected = if shown.iter().any(|(_, line)| line.starts_with("error: ")) { 2 } else { 0 };
        if status != Some(expected) {
            objections.push(format!("{}\nended with {status:?}:\n{}", place(example.line), brief(&printed)));
        }
        let texts = shown.iter().map(|(_, line)| *line).collect::<Vec<_>>();
        if texts.is_empty() {
            continue;
        }
        let same = |shown: &str, printed: &str| comparable(shown) == comparable(printed);
        let Err(missing) = find(&texts, &printed, same) else { continue };
        let objection = format!(
            "{}\nno longer prints:\n{}\nbut:\n{}",
            place(example.line),
            texts[missing],
            brief(&printed)
        );
        let like = |of_table| {
            find(&texts, &printed, |shown, printed| skeleton(shown, of_table) == skeleton(printed, of_table))
        };
        let alike = like(true).or_else(|_| like(false));
        let whole = !texts.iter().any(|line| line.trim() == LEFT_OUT);
        match (std::env::var_os(REWRITE), alike) {
            (None, _) => objections.push(objection),
            (Some(_), _) if whole => rewritten.push((example.shown[0].clone(), printed)),
            (Some(_), Err(_)) => objections.push(objection + "\nwrite by hand which lines are shown"),
            (Some(_), Ok(found)) => {
                for ((line, _), at) in shown.iter().zip(found) {
                    if let (Some(line), Some(at)) = (line, at) {
                        rewritten.push((*line..line + 1, vec![printed[at].clone()]));
                    }
                }
            }
        }
    }
    for (range, printed) in rewritten.iter().rev() {
        lines.splice(range.clone(), printed.iter().map(|line| line.trim_end().to_owned()));
    }
    if !rewritten.is_empty() {
        fs::write(page, lines.join("\n") + "\n").expect("the page can be written");
    }
    objections
}

#[test]
fn the_examples_of_readme_and_guides_print_what_is_shown() {
    let guides = fs::read_dir(root().join("docs/guides")).expect("the guides are there");
    let mut pages = guides.map(|file| file.expect("a guide").path()).collect::<Vec<_>>();
    pages.push(root().join("README.md"));
    pages.sort();
    let objections = std::thread::scope(|scope| {
        let checks = pages.iter().map(|page| {
            let name = page.file_name().expect("a name").to_string_lossy().into_owned();
            scope.spawn(move || check(page, &name))
        });
        let checks = checks.collect::<Vec<_>>();
        checks.into_iter().flat_map(|check| check.join().expect("a page")).collect::<Vec<_>>()
    });
    assert!(
        objections.is_empty(),
        "{}\n\nif what is printed is right: ./ci.sh expected",
        objections.join("\n\n")
    );
}
