//! The shape of every file: its length, name and first sentence, and no trace of the machine it was written on.

use crate::project::{Fault, TextFile, assert_none, text_files};
use crate::source::Source;

/// Files settle between 100 and 400 lines; beyond this one is split by noun.
const LONGEST_FILE: usize = 500;

/// Extensions of files that people write.
const WRITTEN: [&str; 6] = [".rs", ".py", ".js", ".css", ".html", ".sh"];

/// Folders of third-party files, kept unchanged.
const FOREIGN: [&str; 1] = ["vendor"];

/// File names without a meaning.
const EMPTY_NAMES: [&str; 9] =
    ["util", "utils", "helper", "helpers", "common", "misc", "manager", "prelude", "extras"];

/// Folders of a particular machine.
const MACHINE_FOLDERS: [&str; 5] = ["work", "tmp", "root", "home", "Users"];

/// Servers of package registries, by name and domain; the ordinary client knows them or a mirror.
const REGISTRIES: [(&str, &str); 6] = [
    ("index", "crates.io"),
    ("static", "crates.io"),
    ("registry", "npmjs.org"),
    ("registry", "yarnpkg.com"),
    ("www", "pypi.org"),
    ("files", "pythonhosted.org"),
];

fn written_files() -> impl Iterator<Item = TextFile> {
    text_files(&WRITTEN).into_iter().filter(|file| !file.path.split('/').any(|part| FOREIGN.contains(&part)))
}

fn first_sentence_fault(text: &str) -> Option<&'static str> {
    let first = text.lines().next().unwrap_or_default();
    let Some(sentence) = first.strip_prefix("//! ") else {
        return Some("does not open with a sentence: `//! ` and what a stranger should know first");
    };
    let paragraph: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("//! ")).collect();
    let ends = paragraph.last().is_some_and(|line| line.ends_with(['.', ':', '?']));
    (sentence.trim().is_empty() || !ends).then_some("opens with a paragraph that does not end its sentence")
}

/// The machine folder or registry that a line names, if any.
fn machine_trace(line: &str) -> Option<String> {
    let folders = MACHINE_FOLDERS.iter().map(|folder| format!("/{folder}/"));
    let absolute = folders.into_iter().find(|folder| {
        line.match_indices(folder.as_str()).any(|(at, _)| {
            // Within a longer path or an address it is another folder.
            let before = line.get(..at).and_then(|text| text.chars().next_back());
            !before.is_some_and(|c| c.is_alphanumeric() || "._-~}/*)>]".contains(c))
        })
    });
    let hosts = REGISTRIES.iter().map(|(name, domain)| format!("{name}.{domain}"));
    absolute.or_else(|| hosts.into_iter().find(|host| line.contains(host.as_str())))
}

#[test]
fn no_file_is_too_long_to_hold_in_mind() {
    let long = written_files().filter_map(|file| {
        let lines = file.text.lines().count();
        let what = format!("{lines} lines; beyond {LONGEST_FILE} a file is split by noun");
        (lines > LONGEST_FILE).then_some(Fault { path: file.path, line: LONGEST_FILE, what })
    });
    assert_none(&long.collect::<Vec<_>>());
}

#[test]
fn every_name_says_what_is_inside() {
    let empty = written_files().filter_map(|file| {
        let stem_of = |part: &str| part.split('.').next().unwrap_or_default().to_string();
        let name = file.path.split('/').map(stem_of).find(|stem| EMPTY_NAMES.contains(&stem.as_str()))?;
        let what = format!("`{name}` does not say what is inside; name the noun");
        Some(Fault { path: file.path, line: 1, what })
    });
    assert_none(&empty.collect::<Vec<_>>());
}

#[test]
fn every_rust_file_opens_with_a_sentence() {
    let silent = written_files().filter(|file| file.path.ends_with(".rs")).filter_map(|file| {
        let what = first_sentence_fault(&file.text)?.into();
        Some(Fault { path: file.path, line: 1, what })
    });
    assert_none(&silent.collect::<Vec<_>>());
}

#[test]
fn mod_rs_is_a_contents_page() {
    let mut faults = Vec::new();
    for file in written_files().filter(|file| file.path.ends_with("/mod.rs")) {
        for item in Source::read(&file.path, &file.text).items {
            let what = format!("defines a {}; it belongs in a file that is named after it", item.word);
            faults.push(Fault { path: file.path.clone(), line: item.line, what });
        }
    }
    assert_none(&faults);
}

#[test]
fn nothing_points_into_one_machine() {
    let mut faults = Vec::new();
    for file in text_files(&[]) {
        for (at, line) in file.text.lines().enumerate() {
            if let Some(found) = machine_trace(line) {
                let what = format!("names {found}, which other machines do not have");
                faults.push(Fault { path: file.path.clone(), line: at + 1, what });
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn a_poor_opening_and_a_machine_path_are_noticed() {
    assert!(first_sentence_fault("use core::fmt;\n").is_some());
    assert!(first_sentence_fault("//! A train that\n\nfn f() {}\n").is_some());
    assert!(first_sentence_fault("//! A train.\n").is_none());
    assert!(first_sentence_fault("//! A train that runs\n//! in circles.\n//!\n//! More.\n").is_none());

    let folder = MACHINE_FOLDERS[0];
    assert!(machine_trace(&format!("read \"/{folder}/data.csv\"")).is_some());
    assert!(machine_trace(&format!("https://example.org/{folder}/data.csv")).is_none());
    let (name, domain) = REGISTRIES[0];
    assert!(machine_trace(&format!("https://{name}.{domain}/config")).is_some());
}
