//! The field's words: private words that were used in their place, counted by folder, and never more than before.

use std::collections::BTreeMap;

use crate::project::{Fault, assert_none, text_files};

/// A private word and the field's word for it; a plural counts, too.
const PRIVATE: [(&str, &str); 26] = [
    ("nobody", "name the actor, or say what is unknown"),
    ("whoever", "name the actor"),
    ("told", "commanded, reported"),
    ("way", "path, route, distance"),
    ("contact", "sensor for the thing, detection for what it reports"),
    ("closure", "detection"),
    ("doubt", "uncertainty"),
    ("belief", "estimate"),
    ("believed", "estimated"),
    ("guess", "estimate"),
    ("crawl", "creep"),
    ("mishap", "fault, incident"),
    ("felt", "path length"),
    ("footprint", "reservation"),
    ("tell", "command, report"),
    ("untangle", "resolve the deadlock"),
    ("untangling", "deadlock"),
    ("restraint", "speed supervision"),
    ("attribution", "data association"),
    ("prospect", "expected information gain"),
    ("foresight", "reachable set"),
    ("outlook", "rollout"),
    ("vigil", "consistency monitor"),
    ("tongue", "formatter"),
    ("conductor", "script runner"),
    ("rehearing", "replay"),
];

/// Words that are private only as names in code: documents use them in their plain sense ("in this way").
const PLAIN_IN_PROSE: [&str; 1] = ["way"];

/// How many private words each folder still has. A folder without an entry has none; lower a number when it falls.
const LEFT: &str = include_str!("private_words.txt");

/// The folder by which a file is counted: three parts below `crates` (`footplate-core/src/model`), one below `docs`, else its first.
fn folder(path: &str) -> String {
    let parts: Vec<&str> = path.split('/').collect();
    match parts.as_slice() {
        ["crates", name, source, folder, _, ..] => format!("crates/{name}/{source}/{folder}"),
        ["crates", name, source, _] => format!("crates/{name}/{source}"),
        ["docs", folder, _, ..] => format!("docs/{folder}"),
        [folder, _, ..] => (*folder).to_owned(),
        _ => path.to_owned(),
    }
}

/// The words of a line, in small letters: `isTold`, `is_told` and "is told" are two words each.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for letter in line.chars() {
        if !letter.is_alphabetic() || letter.is_uppercase() && before.is_lowercase() {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| letter.is_alphabetic()) {
            word.extend(letter.to_lowercase());
        }
        before = letter;
    }
    words
}

fn instead(word: &str) -> Option<&'static str> {
    let is = |private: &str| word == private || word.strip_suffix('s') == Some(private);
    PRIVATE.iter().find(|(private, _)| is(private)).map(|(_, instead)| *instead)
}

fn is_plain_in_prose(word: &str) -> bool {
    PLAIN_IN_PROSE.iter().any(|plain| word == *plain || word.strip_suffix('s') == Some(*plain))
}

#[test]
fn private_words_only_become_fewer() {
    let left: BTreeMap<&str, usize> = LEFT
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(count, folder)| (folder, count.parse().expect("a count, a space and a folder")))
        .collect();
    let mut found: BTreeMap<String, Vec<Fault>> = BTreeMap::new();
    // This page and the list of words are about them.
    let about = |path: &str| path.ends_with("architecture/words.rs") || path.ends_with("glossary.md");
    // What is printed and recorded stays as it was.
    let is_record = |path: &str| path.starts_with("testdata/") || path.starts_with("docs/tables/");
    for file in text_files(&[".rs", ".md"]) {
        if about(&file.path) || is_record(&file.path) {
            continue;
        }
        let is_prose = file.path.ends_with(".md");
        for (at, line) in file.text.lines().enumerate() {
            for word in words(line).into_iter().filter(|word| !is_prose || !is_plain_in_prose(word)) {
                if let Some(instead) = instead(&word) {
                    let what = format!("`{word}` is a private word: {instead}");
                    let fault = Fault { path: file.path.clone(), line: at + 1, what };
                    found.entry(folder(&file.path)).or_default().push(fault);
                }
            }
        }
    }
    if std::env::var_os("PRINT_PRIVATE_WORDS").is_some() {
        found.iter().for_each(|(folder, faults)| println!("{} {folder}", faults.len()));
    }
    let more = |(folder, faults): &(String, Vec<Fault>)| {
        faults.len() > left.get(folder.as_str()).copied().unwrap_or(0)
    };
    let faults: Vec<Fault> = found.into_iter().filter(more).flat_map(|(_, faults)| faults).collect();
    assert_none(&faults);
}

#[test]
fn a_word_is_found_in_every_spelling() {
    let private =
        |line| words(line).iter().filter(|word| instead(word).is_some()).cloned().collect::<Vec<_>>();
    assert_eq!(private("let is_told = self.isTold(WayPoint, always);"), ["told", "told", "way"]);
    assert_eq!(private("/// Contacts that nobody closed."), ["contacts", "nobody"]);
}
