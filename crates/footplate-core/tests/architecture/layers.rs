//! The layers of core: a module imports from rows below its own, or from its own folder.

use std::collections::BTreeMap;

use crate::project::{Fault, assert_none, sources_below, text_files};
use crate::source::Source;

const CORE: &str = "crates/footplate-core/src/";
const CORE_ROOT: &str = "crates/footplate-core/src/lib.rs";
const SIMULATOR: &str = "crates/footplate-sim/src/";

/// From top to bottom, as in the documentation of core's `lib.rs`.
const ROWS: [&[&str]; 6] = [
    &["control"],
    &["tracking", "odometry"],
    &["model"],
    &["kinematics", "link", "track"],
    &["event"],
    &["units", "time", "ids", "linalg", "estimate"],
];

/// Modules of one row of which the first may import the second, but not the reverse.
const ACQUAINTED: [(&str, &str); 2] = [
    // A speed times a time span is a length.
    ("units", "time"),
    // An estimate has a date.
    ("estimate", "time"),
];

/// What the simulator may import from core: words and places, but no formula that it is there to test.
const SHARED_WITH_SIMULATOR: [&str; 5] = ["units", "time", "ids", "event", "track"];

/// The module that each name at the root of core comes from: itself for a module, its home for a re-export.
struct Homes(BTreeMap<String, String>);

impl Homes {
    fn read(core: &[Source]) -> Self {
        let modules = core.iter().filter_map(|source| source.module().first().cloned());
        let mut homes: BTreeMap<String, String> = modules.map(|module| (module.clone(), module)).collect();
        let root = core.iter().filter(|source| source.path == CORE_ROOT);
        for named in root.flat_map(|source| &source.named) {
            if let [module, .., name] = named.segments.as_slice()
                && homes.contains_key(module)
            {
                homes.insert(name.clone(), module.clone());
            }
        }
        Self(homes)
    }

    fn of(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }
}

fn row_of(module: &str) -> Option<usize> {
    ROWS.iter().position(|row| row.contains(&module))
}

/// Why one module may not import another, if so.
fn objection(importer: &str, imported: &str) -> Option<String> {
    let (Some(here), Some(there)) = (row_of(importer), row_of(imported)) else {
        return Some(format!("`{importer}` imports `{imported}`, and one of them stands in no row"));
    };
    if importer == imported || there > here || ACQUAINTED.contains(&(importer, imported)) {
        return None;
    }
    let place = if there < here { "a row above it" } else { "its own row" };
    Some(format!(
        "`{importer}` imports `{imported}`, which stands in {place}; only rows below may be imported"
    ))
}

fn upward_imports(source: &Source, homes: &Homes) -> Vec<Fault> {
    let module = source.module();
    let Some(importer) = module.first() else {
        // The root of core is the map of all rows.
        return Vec::new();
    };
    let inside =
        source.named.iter().filter(|named| named.segments.first().is_some_and(|first| first == "crate"));
    let named_root = inside.filter_map(|named| Some((named.line, named.segments.get(1)?)));
    let objected = named_root.filter_map(|(line, name)| {
        let what = match homes.of(name) {
            Some(imported) => objection(importer, imported)?,
            None => format!("`crate::{name}` is neither a module nor a name that lib.rs re-exports"),
        };
        Some(Fault { path: source.path.clone(), line, what })
    });
    objected.collect()
}

#[test]
fn core_imports_only_from_rows_below() {
    let core = sources_below(CORE);
    let homes = Homes::read(&core);
    let faults: Vec<Fault> = core.iter().flat_map(|source| upward_imports(source, &homes)).collect();
    assert_none(&faults);
}

#[test]
fn every_module_of_core_has_a_row() {
    let without = sources_below(CORE).into_iter().filter_map(|source| {
        let module = source.module().first()?.clone();
        let what =
            format!("`{module}` stands in no row; add it to ROWS in layers.rs and to the map in lib.rs");
        row_of(&module).is_none().then_some(Fault { path: source.path, line: 1, what })
    });
    assert_none(&without.collect::<Vec<_>>());
}

#[test]
fn the_map_in_lib_rs_shows_these_rows() {
    let files = text_files(&[CORE_ROOT]);
    let root = files.first().expect("core should have a root");
    let map: Vec<&str> = root.text.lines().filter_map(|line| line.strip_prefix("//! ")).collect();
    let shows =
        |row: &[&str]| map.iter().any(|line| line.split_whitespace().take(row.len()).eq(row.iter().copied()));
    let missing = ROWS.iter().filter(|row| !shows(row)).map(|row| Fault {
        path: CORE_ROOT.into(),
        line: 1,
        what: format!("the map of layers has no line that begins with {}", row.join("  ")),
    });
    assert_none(&missing.collect::<Vec<_>>());
}

#[test]
fn the_simulator_shares_no_formula_with_core() {
    let homes = Homes::read(&sources_below(CORE));
    let mut faults = Vec::new();
    for source in sources_below(SIMULATOR) {
        for named in &source.named {
            let [root, name, ..] = named.segments.as_slice() else { continue };
            let shared = homes.of(name).is_some_and(|home| SHARED_WITH_SIMULATOR.contains(&home));
            if root == "footplate_core" && !shared {
                let what = format!(
                    "uses footplate_core::{name}; a simulator that shares a formula with the estimator proves \
                     nothing, so only {} are shared",
                    SHARED_WITH_SIMULATOR.join(", ")
                );
                faults.push(Fault { path: source.path.clone(), line: named.line, what });
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn an_import_from_above_or_beside_is_noticed() {
    let noticed = |path: &str, text: &str| {
        let root = Source::read(CORE_ROOT, "pub use estimation::Prediction; pub use units::Length;");
        let modules = ROWS.iter().flat_map(|row| row.iter());
        let mut core: Vec<Source> =
            modules.map(|name| Source::read(&format!("{CORE}{name}.rs"), "")).collect();
        core.push(root);
        upward_imports(&Source::read(&format!("{CORE}{path}"), text), &Homes::read(&core)).len()
    };
    assert_eq!(noticed("track/graph.rs", "use crate::estimation::Prediction;"), 1);
    assert_eq!(noticed("track/graph.rs", "fn f() -> crate::Prediction { todo!() }"), 1, "through the root");
    assert_eq!(noticed("track/graph.rs", "use super::super::kinematics::Trapezoid;"), 1, "from a row-mate");
    assert_eq!(
        noticed("time.rs", "use crate::units::Length;"),
        1,
        "units knows time, and time must not know units"
    );
    assert_eq!(noticed("track/graph.rs", "use super::node::Node; use crate::{Length, ids::NodeId};"), 0);
    assert_eq!(noticed("track/graph.rs", "#[cfg(test)] mod tests { use crate::estimation::Prediction; }"), 0);
}
