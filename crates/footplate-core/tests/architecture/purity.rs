//! What is absent on purpose: std, clocks, randomness and dependencies from core and wire, floating point from files
//! for controllers without it, and platform-dependent mathematics from everything.

use std::str::FromStr as _;

use proc_macro2::{TokenStream, TokenTree};

use crate::project::{Fault, TextFile, assert_none, source_folders, sources_below, text_files};
use crate::source::Source;

const PURE: [&str; 2] = ["crates/footplate-core/src/", "crates/footplate-wire/src/"];

/// First path segments of impure crates, and what to use instead.
const WORLD: [(&str, &str); 5] = [
    ("std", "take it from core or alloc; input and output belong in the program"),
    ("rand", "draw random numbers in the simulator"),
    ("rand_core", "draw random numbers in the simulator"),
    ("rand_chacha", "draw random numbers in the simulator"),
    ("rand_distr", "draw random numbers in the simulator"),
];

/// Methods of `f64` that use the platform's library, which differs in the last bit. Rust guarantees the rest (the
/// four operations, `sqrt`, rounding).
const PLATFORM_MATHEMATICS: [&str; 22] = [
    "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "cbrt", "hypot", "sin", "cos",
    "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
];

/// What runs on controllers without floating point.
const INTEGER_FILES: [&str; 2] = [
    "crates/footplate-core/src/kinematics/integer_stop.rs",
    "crates/footplate-core/src/kinematics/integer_stop/power_of_half.rs",
];

/// Words that imply floating point: its types, its functions, and quantities, which contain it.
const FLOATING_POINT: [&str; 9] =
    ["f16", "f32", "f64", "f128", "libm", "units", "Length", "Speed", "TimeSpan"];

/// What each pure crate may depend on.
const DEPENDENCIES: [(&str, &[&str]); 2] = [
    // Elementary functions, and derives for the crates that write files.
    ("crates/footplate-core/Cargo.toml", &["libm", "serde"]),
    // Inflates the list of locomotives that a Central Station sends compressed; reads JMRI's JSON.
    ("crates/footplate-wire/Cargo.toml", &["footplate-core", "miniz_oxide", "serde_json"]),
];

fn worldly_paths(source: &Source) -> impl Iterator<Item = Fault> {
    source.named.iter().filter_map(|named| {
        let first = named.segments.first()?;
        let (_, instead) = WORLD.iter().find(|(name, _)| name == first)?;
        let what = format!("uses {}; {instead}", named.segments.join("::"));
        Some(Fault { path: source.path.clone(), line: named.line, what })
    })
}

fn platform_mathematics(source: &Source) -> impl Iterator<Item = Fault> {
    let methods = source.called.iter().map(|call| (call.line, call.word.as_str()));
    let functions = source.named.iter().filter_map(|named| match named.segments.as_slice() {
        [float, function] if matches!(float.as_str(), "f64" | "f32") => Some((named.line, function.as_str())),
        _ => None,
    });
    methods.chain(functions).filter(|(_, name)| PLATFORM_MATHEMATICS.contains(name)).map(|(line, name)| {
        Fault {
            path: source.path.clone(),
            line,
            what: format!("calls {name}, whose last bit differs from machine to machine; take it from libm"),
        }
    })
}

/// Where a file outside its tests names or writes a floating-point number: the line and the word.
fn floating_point(text: &str) -> Vec<(usize, String)> {
    let before_tests = text.split("#[cfg(test)]").next().unwrap_or_default();
    let tokens = TokenStream::from_str(before_tests).unwrap_or_else(|e| panic!("{before_tests}: {e}"));
    let (mut found, mut groups) = (Vec::new(), vec![tokens]);
    while let Some(tokens) = groups.pop() {
        for token in tokens {
            let word = token.to_string();
            let is_floating = match &token {
                TokenTree::Group(group) => {
                    groups.push(group.stream());
                    false
                }
                TokenTree::Ident(_) => FLOATING_POINT.contains(&word.as_str()),
                TokenTree::Literal(_) => is_floating_point(&word),
                TokenTree::Punct(_) => false,
            };
            if is_floating {
                found.push((token.span().start().line, word));
            }
        }
    }
    found
}

/// Whether a literal is floating point: with a point, an exponent or a type suffix; `0x1e5` is not.
fn is_floating_point(literal: &str) -> bool {
    let is_decimal = literal.starts_with(|c: char| c.is_ascii_digit())
        && !["0x", "0b", "0o"].iter().any(|prefix| literal.starts_with(prefix));
    let number = literal.trim_end_matches("usize").trim_end_matches("isize");
    is_decimal && number.contains(['.', 'e', 'E', 'f'])
}

/// The names under `[dependencies]`, with their lines.
fn dependencies(manifest: &TextFile) -> Vec<(usize, &str)> {
    let lines = manifest.text.lines().enumerate().skip_while(|(_, line)| *line != "[dependencies]").skip(1);
    let section = lines.take_while(|(_, line)| !line.starts_with('['));
    let entries = section.filter(|(_, line)| line.starts_with(|c: char| c.is_ascii_alphabetic()));
    entries.filter_map(|(at, line)| Some((at + 1, line.split(['.', ' ', '=']).next()?))).collect()
}

#[test]
fn core_and_wire_know_no_world() {
    let faults: Vec<Fault> = PURE
        .iter()
        .flat_map(|folder| sources_below(folder))
        .flat_map(|s| worldly_paths(&s).collect::<Vec<_>>())
        .collect();
    assert_none(&faults);
}

#[test]
fn core_and_wire_declare_that_they_need_no_std() {
    let roots = PURE.map(|folder| format!("{folder}lib.rs"));
    let without =
        text_files(&[".rs"]).into_iter().filter(|file| roots.contains(&file.path)).filter_map(|file| {
            let declared = file.text.lines().any(|line| line == "#![no_std]");
            let what = "says nothing of std; a line #![no_std] would".into();
            (!declared).then_some(Fault { path: file.path, line: 1, what })
        });
    assert_none(&without.collect::<Vec<_>>());
}

#[test]
fn core_and_wire_depend_on_what_is_listed_here() {
    let mut faults = Vec::new();
    for (path, allowed) in DEPENDENCIES {
        for manifest in text_files(&[path]) {
            for (line, name) in dependencies(&manifest) {
                if !allowed.contains(&name) {
                    let what = format!("depends on {name}; allowed are {}", allowed.join(", "));
                    faults.push(Fault { path: path.into(), line, what });
                }
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn elementary_functions_come_from_libm() {
    let sources = source_folders().into_iter().flat_map(|folder| sources_below(&folder));
    let faults: Vec<Fault> = sources.flat_map(|s| platform_mathematics(&s).collect::<Vec<_>>()).collect();
    assert_none(&faults);
}

#[test]
fn what_runs_without_floating_point_names_none() {
    let files = text_files(&INTEGER_FILES);
    assert_eq!(files.len(), INTEGER_FILES.len(), "a file that is listed here is gone");
    let faults = files.iter().flat_map(|file| {
        floating_point(&file.text).into_iter().map(|(line, word)| {
            let what = format!("`{word}` is floating point; calculate it in constants.rs, before");
            Fault { path: file.path.clone(), line, what }
        })
    });
    assert_none(&faults.collect::<Vec<_>>());
}

#[test]
fn floating_point_is_noticed() {
    let words = |text| floating_point(text).into_iter().map(|(_, word)| word).collect::<Vec<_>>();
    assert_eq!(words("fn f(x: f64) -> i32 { x as i32 }"), ["f64"]);
    assert_eq!(words("use crate::units::{Length, Ratio};"), ["units", "Length"]);
    assert_eq!(words("const A: i64 = 1.5 as i64;"), ["1.5"]);
    assert_eq!(words("const A: i64 = 1e3 as i64;"), ["1e3"]);
    assert_eq!(
        words(
            "/// 1.5 f64\nconst A: u64 = 0x1e5 + 1_u64 + 2_usize;\n#[cfg(test)]\nmod tests { type X = f64; }"
        ),
        [""; 0]
    );
}

#[test]
fn a_clock_a_die_and_a_dependency_are_noticed() {
    let count = |text| worldly_paths(&Source::read("crates/footplate-core/src/time.rs", text)).count();
    assert_eq!(count("fn now() { std::time::Instant::now(); }"), 1);
    assert_eq!(count("use rand::Rng;"), 1);
    assert_eq!(count("extern crate std;"), 1);
    assert_eq!(count("use core::fmt::Display;"), 0);

    let count = |text| platform_mathematics(&Source::read("crates/footplate-sim/src/motor.rs", text)).count();
    assert_eq!(count("fn f(x: f64) -> f64 { x.exp() }"), 1);
    assert_eq!(count("fn f(x: f64) -> f64 { f64::ln(x) }"), 1);
    assert_eq!(count("fn f(x: f64) -> f64 { libm::exp(x).sqrt() }"), 0);

    let manifest = TextFile {
        path: "Cargo.toml".into(),
        text: "[dependencies]\nlibm.workspace = true\n# why\nrand = \"1\"\n[lints]\nworkspace = true\n"
            .into(),
    };
    assert_eq!(dependencies(&manifest), [(2, "libm"), (4, "rand")]);
}
