//! Documentation refers to things that exist: relative links, headings, and paths.

use std::collections::BTreeSet;

use pulldown_cmark::{Event, Parser, Tag, TagEnd};

use crate::project::{Fault, TextFile, assert_none, paths, text_files};

const READING_ORDER: &str = "docs/README.md";

/// The references of one page, and the anchors that it offers.
#[derive(Default)]
struct Page {
    links: Vec<Pointer>,
    code_spans: Vec<Pointer>,
    anchors: BTreeSet<String>,
}

struct Pointer {
    line: usize,
    target: String,
}

impl Page {
    fn read(text: &str) -> Self {
        let mut page = Self::default();
        let mut heading: Option<String> = None;
        for (event, range) in Parser::new(text).into_offset_iter() {
            let line = text.get(..range.start).map_or(1, |before| before.lines().count().max(1));
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(Pointer { line, target: dest_url.to_string() });
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => page.anchors.extend(heading.take().map(|h| anchor(&h))),
                Event::Text(words) => heading.iter_mut().for_each(|h| h.push_str(&words)),
                Event::Code(words) => {
                    heading.iter_mut().for_each(|h| h.push_str(&words));
                    page.code_spans.push(Pointer { line, target: words.to_string() });
                }
                _ => {}
            }
        }
        page
    }
}

/// The anchor of a heading: lower case, no punctuation, hyphens for spaces.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.flat_map(char::to_lowercase).map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The path from the root that a link on a page leads to, or `None` above the root.
fn follow(page: &str, link: &str) -> Option<String> {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in link.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

/// The possible targets of links: the project's files and their folders.
struct Targets(BTreeSet<String>);

impl Targets {
    fn read() -> Self {
        let paths = paths();
        let ends = |path: &str| path.match_indices('/').map(|(at, _)| at).collect::<Vec<_>>();
        let folders = paths.iter().flat_map(|path| ends(path).into_iter().filter_map(|end| path.get(..end)));
        Self(folders.map(String::from).chain(paths.iter().cloned()).collect())
    }

    /// Whether a file or folder with this path from the root exists.
    fn contains(&self, path: &str) -> bool {
        self.0.contains(path.trim_end_matches('/'))
    }

    /// Whether some path ends like this: a page may name a file relative to a folder it has named.
    fn contains_end(&self, end: &str) -> bool {
        let end = format!("/{}", end.trim_end_matches('/'));
        self.0.iter().any(|path| path.ends_with(&end))
    }

    /// What is wrong with a code span, if it is a path.
    fn objection(&self, span: &str) -> Option<String> {
        let pattern = span.contains(['*', '{', '…', ' ', '<']);
        let from_top = span.split_once('/').is_some_and(|(first, _)| self.contains(first));
        let is_path = !pattern && (from_top || span.ends_with(".rs"));
        let missing = is_path && !self.contains(span) && !self.contains_end(span);
        missing.then(|| format!("names {span}, which is not there"))
    }
}

fn pages() -> Vec<TextFile> {
    text_files(&[".md"])
}

/// The pages of `docs` that a line of code or a message names.
fn pages_named(line: &str) -> impl Iterator<Item = &str> {
    let parts = line.split(|c: char| !c.is_alphanumeric() && !"/._-".contains(c));
    parts.filter(|part| part.starts_with("docs/") && part.ends_with(".md"))
}

fn link_objection(pages: &[TextFile], targets: &Targets, page: &str, link: &str) -> Option<String> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (file, heading) = link.split_once('#').map_or((link, None), |(file, heading)| (file, Some(heading)));
    let target = if file.is_empty() { Some(page.to_string()) } else { follow(page, file) };
    let Some(target) = target.filter(|target| targets.contains(target)) else {
        return Some(format!("links to {link}, which is not there"));
    };
    let heading = heading?;
    let led_to = pages.iter().find(|file| file.path == target);
    let found = led_to.is_some_and(|file| Page::read(&file.text).anchors.contains(heading));
    (!found).then(|| format!("links to {link}, and {target} has no such heading"))
}

#[test]
fn every_relative_link_leads_somewhere() {
    let (all, targets) = (pages(), Targets::read());
    let mut faults = Vec::new();
    for file in &all {
        for link in Page::read(&file.text).links {
            if let Some(what) = link_objection(&all, &targets, &file.path, &link.target) {
                faults.push(Fault { path: file.path.clone(), line: link.line, what });
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn every_path_named_in_passing_exists() {
    let targets = Targets::read();
    let mut faults = Vec::new();
    // A change log may name what no longer exists.
    for file in pages().into_iter().filter(|file| file.path != "CHANGELOG.md") {
        for span in Page::read(&file.text).code_spans {
            if let Some(what) = targets.objection(&span.target) {
                faults.push(Fault { path: file.path.clone(), line: span.line, what });
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn every_page_that_code_sends_people_to_exists() {
    let targets = Targets::read();
    let mut faults = Vec::new();
    for file in text_files(&[".rs", ".toml", ".sh"]) {
        for (at, line) in file.text.lines().enumerate() {
            for page in pages_named(line).filter(|page| !targets.contains(page)) {
                let what = format!("sends people to {page}, which is not there");
                faults.push(Fault { path: file.path.clone(), line: at + 1, what });
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn every_page_has_its_place_in_the_reading_order() {
    let all = pages();
    let order = all.iter().find(|file| file.path == READING_ORDER).expect("docs should have a reading order");
    let listed: BTreeSet<String> =
        Page::read(&order.text).links.iter().filter_map(|link| follow(READING_ORDER, &link.target)).collect();
    let lost = all.iter().filter(|file| file.path.starts_with("docs/") && file.path != READING_ORDER);
    let lost = lost.filter(|file| !listed.contains(&file.path)).map(|file| Fault {
        path: file.path.clone(),
        line: 1,
        what: format!("is not linked from {READING_ORDER}"),
    });
    assert_none(&lost.collect::<Vec<_>>());
}

#[test]
fn a_dead_link_and_a_missing_heading_are_noticed() {
    assert_eq!(follow("docs/wire/marklin_serial.md", "../glossary.md").as_deref(), Some("docs/glossary.md"));
    assert_eq!(follow("README.md", "../elsewhere.md"), None);
    assert_eq!(anchor("Why `f64`, and not decimals?"), "why-f64-and-not-decimals");

    let page = Page::read("# One\n\nSee [two](two.md) and `crates/none.rs`.\n\n```\n[no](link.md)\n```\n");
    assert_eq!(page.links.iter().map(|l| (l.line, l.target.as_str())).collect::<Vec<_>>(), [(3, "two.md")]);
    assert_eq!(page.code_spans.len(), 1);
    assert!(page.anchors.contains("one"));
    let targets = Targets(["crates", "crates/core/src/track/graph.rs"].map(String::from).into());
    assert!(targets.objection("crates/none.rs").is_some());
    assert!(targets.objection("track/none.rs").is_some());
    assert!(targets.objection("track/graph.rs").is_none());
    assert!(targets.objection("loop.toml").is_none(), "a file of the user's");
    assert_eq!(
        pages_named("see `docs/glossary.md` (docs/formats)").collect::<Vec<_>>(),
        ["docs/glossary.md"]
    );
    let targets = Targets(BTreeSet::new());
    assert!(link_objection(&[], &targets, "README.md", "no-such-page.md").is_some());
    assert!(link_objection(&[], &targets, "README.md", "https://example.org").is_none());
}
