//! `footplate layout` shows, checks and imports layouts, and leaves nothing half written.

use std::fs;
use std::path::Path;

use crate::program::{folder, footplate};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// An end, two sensors and an end; and the same as tables.
const LINE: &str = "format = 1\nname = \"line\"\nlength_uncertainty_mm = 2\nlength_origin = \"ruler\"\n\
    sensors = [{ names = [\"A1\", \"A2\"] }]\nends = [{ names = [\"EN1\", \"EX1\"] }, { names = [\"EN2\", \"EX2\"] }]\n\
    edges = [\n  { from = \"EN1\", to = \"A1\", mm = 120.5 },\n  { from = \"A1\", to = \"EX2\", mm = 80 },\n]\n";
const NODES: &str = "name,type,number,reverse\nA1,sensor,0,A2\nA2,sensor,1,A1\nEN1,enter,1,EX1\nEX1,exit,1,EN1\n\
    EN2,enter,2,EX2\nEX2,exit,2,EN2\n";
const EDGES: &str = "src,dst,direction,dist_mm\nEN1,A1,ahead,120.5\nA2,EX1,ahead,120.5\nA1,EX2,ahead,80\n\
    EN2,A2,ahead,80\n";

#[test]
fn show_tells_the_facts_of_a_built_in_layout() {
    let run = footplate(&["layout", "show", "track-a"]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    for fact in
        ["144: 80 sensors, 22 turnouts, 10 track ends", "156 of 0 to 875 mm", "19557 mm", "98 from sensor"]
    {
        assert!(run.output.contains(fact), "{fact}: {}", run.output);
    }
    let hops = footplate(&["layout", "show", "track-a", "--hops"]).output;
    assert!(hops.contains("C14 A4         581 mm  11 curved\n"), "{hops}");
    assert_eq!(hops.lines().count(), run.output.lines().count() + 98);
}

#[test]
fn show_as_json_is_the_same_facts() {
    let run = footplate(&["layout", "show", "track-b", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&run.output).unwrap();
    for (key, value) in
        [("nodes", 140.0), ("edges", 154.0), ("track_ends", 8.0), ("total_length_mm", 19_418.0)]
    {
        assert_eq!(summary[key].as_f64(), Some(value), "{key}");
    }
    let hops = summary["hops"].as_array().unwrap();
    assert_eq!(hops.len(), 100);
    assert!(hops.iter().all(|hop| hop["length_mm"].as_f64().is_some_and(|mm| mm > 0.0)));
    assert_eq!(summary["never_both_curved"], serde_json::json!([[153, 154], [155, 156]]));
}

#[test]
fn a_sensor_with_one_number_is_read_written_and_shown() {
    let folder = folder("layout/undirected");
    let file = folder.join("line.toml");
    fs::write(&file, LINE.replace("\"A2\"] }", "\"A2\"], number = 7 }")).unwrap();
    let checked = footplate(&["layout", "check", text(&file)]);
    assert!(checked.output.contains("a sound layout of 6 nodes and 4 edges"), "{}", checked.output);
    let shown = footplate(&["layout", "show", text(&file)]).output;
    assert!(shown.contains("        1 place reports both directions under one number\n"), "{shown}");
    // The same number in both rows of the tables is the same sensor.
    let (nodes, edges, out) = (folder.join("nodes.csv"), folder.join("edges.csv"), folder.join("out.toml"));
    fs::write(&nodes, NODES.replace("A1,sensor,0,A2\nA2,sensor,1", "A1,sensor,7,A2\nA2,sensor,7")).unwrap();
    fs::write(&edges, EDGES).unwrap();
    let tables = ["--nodes", text(&nodes), "--edges", text(&edges), "--out", text(&out)];
    let imported = footplate(&[&["layout", "import"], &tables[..]].concat());
    assert_eq!(imported.status, 0, "{}", imported.errors);
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.contains("{ names = [\"A1\", \"A2\"], number = 7 },"), "{written}");
}

#[test]
fn speed_restrictions_are_shown() {
    let folder = folder("layout/zones");
    let file = folder.join("line.toml");
    let zone = LINE.replace("mm = 80 }", "mm = 80, zone = \"end\" }");
    fs::write(&file, zone + "zones = [{ name = \"end\", max_mm_s = 90 }]\n").unwrap();
    let shown = footplate(&["layout", "show", text(&file)]).output;
    assert!(shown.contains("zone    end: at most 90 mm/s on 80 mm of rails\n"), "{shown}");
    let json = footplate(&["layout", "show", text(&file), "--json"]).output;
    let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
    let end = serde_json::json!([{ "name": "end", "max_mm_s": 90.0, "length_mm": 80.0 }]);
    assert_eq!(summary["zones"], end);
    let checked = footplate(&["layout", "check", text(&file)]).output;
    assert!(checked.ends_with("6 nodes and 4 edges, with 1 speed restriction\n"), "{checked}");
}

#[test]
fn blocks_are_shown_with_their_boundaries() {
    let shown = footplate(&["layout", "show", "oval-blocks"]).output;
    // From the layout file; the curve is half a circle with a radius of 437.5 mm.
    for fact in [
        "nodes   12: 0 sensors, 0 turnouts, 0 track ends, 6 boundaries\n",
        "block   right curve: detector 2, entered at B5, B8, 1374 mm of rails\n",
    ] {
        assert!(shown.contains(fact), "{fact}: {shown}");
    }
    let checked = footplate(&["layout", "check", "oval-blocks"]).output;
    let whole = "oval-blocks: a sound layout of 12 nodes and 12 edges, with 6 blocks between 6 boundaries\n";
    assert_eq!(checked, whole);
    let json = footplate(&["layout", "show", "oval-blocks", "--json"]).output;
    let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
    let curve = serde_json::json!({ "name": "right curve", "detector": 2, "entries": ["B5", "B8"], "length_mm": 1374.4 });
    assert_eq!((&summary["blocks"][2], &summary["sensors"]), (&curve, &serde_json::json!(0)));
}

#[test]
fn show_draws_a_layout_or_says_what_it_lacks() {
    let folder = folder("layout/drawing");
    let drawing = folder.join("track-a.svg");
    let run = footplate(&["layout", "show", "track-a", "--svg", text(&drawing)]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    assert!(fs::read_to_string(&drawing).unwrap().contains(">C13 C14</text>"));

    let layout = folder.join("line.toml");
    fs::write(&layout, LINE).unwrap();
    let run = footplate(&["layout", "show", text(&layout), "--svg", text(&folder.join("line.svg"))]);
    assert_eq!(run.status, 2);
    assert!(run.errors.ends_with("add `at = [x, y]` to its sensors, turnouts and ends\n"), "{}", run.errors);
    assert!(!folder.join("line.svg").exists());
}

#[test]
fn check_says_what_is_wrong_and_where() {
    let folder = folder("layout/check");
    let layout = folder.join("line.toml");
    fs::write(&layout, LINE).unwrap();
    let run = footplate(&["layout", "check", text(&layout)]);
    assert_eq!(run.status, 0, "{}", run.errors);
    assert_eq!(run.output, format!("{}: a sound layout of 6 nodes and 4 edges\n", text(&layout)));

    fs::write(&layout, LINE.replace("mm = 80", "mm = -80")).unwrap();
    let run = footplate(&["layout", "check", text(&layout)]);
    assert_eq!((run.status, run.output.as_str()), (2, ""));
    assert_eq!(
        run.errors,
        format!(
            "error: {}, line 9, column 35: a length of -80 mm is not between 0 and 100000 mm (is it in \
             millimetres?)\n",
            text(&layout)
        )
    );
    let run = footplate(&["layout", "check", "track-z"]);
    assert_eq!(run.status, 2);
    assert!(run.errors.starts_with("error: there is no layout `track-z`: give track-a or"), "{}", run.errors);
}

#[test]
fn import_makes_a_layout_file_that_is_right() {
    let folder = folder("layout/import");
    let [nodes, edges, out] = ["nodes.csv", "edges.csv", "line.toml"].map(|file| folder.join(file));
    fs::write(&nodes, NODES).unwrap();
    fs::write(&edges, EDGES).unwrap();
    let import = ["layout", "import", "--nodes", text(&nodes), "--edges", text(&edges), "--out", text(&out)];
    let run = footplate(&import);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    assert_eq!(run.output, format!("{}: 6 nodes and 4 edges\n", text(&out)));
    assert_eq!(footplate(&["layout", "check", text(&out)]).status, 0);
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.contains("name = \"line\"\n"), "called as the file: {written}");
    assert!(written.contains("{ from = \"EN1\", to = \"A1\", mm = 120.5 },\n"), "{written}");

    // A table that is wrong leaves the file that was there.
    fs::write(&edges, EDGES.replace("EN2,A2,ahead,80", "EN2,A2,ahead,81")).unwrap();
    let run = footplate(&import);
    assert_eq!(run.status, 2);
    assert!(
        run.errors.contains("edges.csv, line 4: the edge from `A1` to `EX2` is 80 mm long"),
        "{}",
        run.errors
    );
    assert_eq!(fs::read_to_string(&out).unwrap(), written);

    let run = footplate(&[&import[..], &["--never-both-curved", "153-154"]].concat());
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("write two turnout numbers as in 153+154"), "{}", run.errors);
}
