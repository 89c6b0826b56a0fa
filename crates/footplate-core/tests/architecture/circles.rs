//! Files that import each other in a circle: at most two, such as a machine and one family of its functions.
#![expect(clippy::indexing_slicing, reason = "numbers of files, each of which is one of the list")]

use std::collections::{BTreeMap, BTreeSet};

use crate::project::{Fault, assert_none, sources_below};
use crate::source::Source;

const CRATES: [&str; 6] =
    ["footplate-core", "footplate-wire", "footplate-sim", "footplate-store", "footplate-eval", "footplate"];
/// A larger group cannot be read file by file.
const LARGEST: usize = 2;

/// The files of a list that each file imports from.
fn imports(sources: &[Source]) -> Vec<BTreeSet<usize>> {
    let files = sources.iter().enumerate().filter(|(_, source)| !source.path.ends_with("/mod.rs"));
    let at: BTreeMap<Vec<String>, usize> = files.map(|(at, source)| (source.module(), at)).collect();
    let imported = |segments: &[String]| {
        let inside = segments.strip_prefix(&["crate".to_owned()])?;
        (1..=inside.len()).rev().find_map(|length| at.get(&inside[..length]).copied())
    };
    let of = |(own, source): (usize, &Source)| {
        let all = source.named.iter().filter_map(|named| imported(&named.segments));
        all.filter(|file| *file != own).collect()
    };
    sources.iter().enumerate().map(of).collect()
}

/// All files reachable from each file.
fn reached(imports: &[BTreeSet<usize>]) -> Vec<BTreeSet<usize>> {
    let from = |start: usize| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![start]);
        while let Some(file) = next.pop() {
            next.extend(imports[file].iter().filter(|file| seen.insert(**file)));
        }
        seen
    };
    (0..imports.len()).map(from).collect()
}

/// Groups of files that all reach each other.
fn circles(sources: &[Source]) -> Vec<Vec<&str>> {
    let reached = reached(&imports(sources));
    let group = |file: usize| -> Vec<usize> {
        (0..sources.len())
            .filter(|other| reached[file].contains(other) && reached[*other].contains(&file))
            .collect()
    };
    let groups: BTreeSet<Vec<usize>> =
        (0..sources.len()).map(group).filter(|group| group.len() > 1).collect();
    groups
        .into_iter()
        .map(|group| group.into_iter().map(|file| sources[file].path.as_str()).collect())
        .collect()
}

#[test]
fn no_more_than_two_files_import_each_other_in_a_circle() {
    let mut large = Vec::new();
    for name in CRATES {
        let sources = sources_below(&format!("crates/{name}/src/"));
        let circles = circles(&sources).into_iter().filter(|circle| circle.len() > LARGEST);
        large.extend(circles.map(|circle| Fault {
            path: circle[0].to_owned(),
            line: 1,
            what: format!("is in a circle of {} files: {}", circle.len(), circle.join(", ")),
        }));
    }
    assert_none(&large);
}

#[test]
fn a_circle_is_found() {
    let file =
        |name: &str, text: &str| Source::read(&format!("crates/footplate-core/src/track/{name}.rs"), text);
    let sources = [
        file("a", "use super::b::B;"),
        file("b", "use crate::track::c::C;"),
        file("c", "fn f() { super::a::g(); }"),
        file("d", "use super::a::A;"),
    ];
    let [circle] = &circles(&sources)[..] else { panic!("one circle") };
    assert_eq!(circle.len(), 3, "{circle:?}");
}
