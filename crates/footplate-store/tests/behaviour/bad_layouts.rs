//! Whatever is wrong with a layout file, the message names file, line, column and value, and what would be right.

use footplate_store::{LARGEST_LAYOUT, parse_layout, read_layout, write_layout};

/// A loop with one siding, as a person would write it.
const OVAL: &str = r#"format = 1
name = "oval"
length_uncertainty_mm = 5
length_origin = "tape measure"
sensors = [
  { names = ["A1", "A2"], at = [0, 0] },
  { names = ["main", "main_back"], numbers = [40, 41] },
]
turnouts = [
  { number = 1, names = ["BR1", "MR1"] },
  { number = 2, names = ["BR2", "MR2"], at = [10, 20.5] },
]
never_both_curved = [[1, 2]]
ends = [
  { names = ["EN1", "EX1"] },
  { names = ["EN2", "EX2"] },
]
edges = [
  { from = "A1", to = "BR1", mm = 100 },
  { from = "BR1 straight", to = "main", mm = 250.5 },
  { from = "main", to = "MR2 straight", mm = 250.5 },
  { from = "MR2", to = "A1", mm = 900 },
  { from = "BR1 curved", to = "EX1", mm = 300 },
  { from = "EN2", to = "MR2 curved", mm = 0, zone = "siding" },
]
zones = [
  { name = "siding", max_mm_s = 150 },
]
"#;

/// The complaint about the oval with one text replaced by another.
fn complaint(right: &str, wrong: &str) -> String {
    assert!(OVAL.contains(right), "{right}");
    parse_layout("oval.toml", OVAL.replacen(right, wrong, 1).as_bytes()).unwrap_err().to_string()
}

#[test]
fn the_oval_is_right() {
    let file = parse_layout("oval.toml", OVAL.as_bytes()).unwrap();
    assert_eq!(file.layout.total_length().as_mm().round(), 1801.0);
    assert_eq!(file.layout.sensor_named("main").map(|sensor| sensor.0), Some(40));
    let turnout = file.layout.node_named("MR2").unwrap();
    assert_eq!(file.drawing.point(turnout), Some([10.0, 20.5]));
    assert_eq!(file.about, "");
    // Windows line ends and a file of the newest TOML are fine, too.
    assert_eq!(parse_layout("oval.toml", OVAL.replace('\n', "\r\n").as_bytes()).unwrap(), file);
}

#[test]
fn tracks_cross_where_the_file_says() {
    let crossing = "crossings = [\n  { tracks = [{ from = \"MR2\", to = \"A1\", mm = 450 }, { from = \"BR1 curved\", to = \"EX1\", mm = 120.5 }] },\n]\n";
    let file = parse_layout("oval.toml", format!("{OVAL}{crossing}").as_bytes()).unwrap();
    let places = file.layout.crossings()[0].tracks.map(|at| (at.edge.0, at.offset.as_mm()));
    assert_eq!(places, [(6, 450.0), (8, 120.5)]);
    assert_eq!(parse_layout("again", write_layout(&file).as_bytes()).unwrap(), file);
    let complaint = |right: &str, wrong: &str| {
        let text = format!("{OVAL}{}", crossing.replacen(right, wrong, 1));
        parse_layout("oval.toml", text.as_bytes()).unwrap_err().to_string()
    };
    let place = "oval.toml, line 30, column 3: ";
    let unknown = "no edge leads from `A1` to `MR2`: name it as it is written in `edges`";
    assert_eq!(complaint(r#""MR2", to = "A1""#, r#""A1", to = "MR2""#), format!("{place}{unknown}"));
    let beyond = "`mm` of a crossing is not on its edge: write the distance from the start of the edge to the crossing";
    for wrong in ["901", "-1", "nan"] {
        assert_eq!(complaint("450", wrong), format!("{place}{beyond}"));
    }
}

#[test]
fn a_zone_restricts_the_edges_that_name_it() {
    let layout = parse_layout("oval.toml", OVAL.as_bytes()).unwrap().layout;
    let limits =
        layout.edges().filter_map(|(edge, _)| Some((edge.0, layout.zone(edge)?.limit.as_mm_per_s())));
    // The sixth edge of the file and the way back over it.
    assert_eq!(limits.collect::<Vec<_>>(), [(10, 150.0), (11, 150.0)]);
}

#[test]
fn a_zone_that_is_wrong_is_named_where_it_stands() {
    assert_eq!(
        complaint("zone = \"siding\" }", "zone = \"sidings\" }"),
        "oval.toml, line 24, column 53: no zone is called `sidings`: add `{ name = \"sidings\", max_mm_s = .. }` to \
         `zones`"
    );
    assert_eq!(
        complaint("max_mm_s = 150", "max_mm_s = 0.15"),
        "oval.toml, line 27, column 33: a limit of 0.15 mm/s is not between 1 and 5000 mm/s (is it in millimetres a \
         second?)"
    );
    assert_eq!(
        complaint(", zone = \"siding\"", ""),
        "oval.toml, line 27, column 3: no edge is in zone `siding`: write `zone = \"siding\"` on the edges it restricts"
    );
}

#[test]
fn the_layout_in_the_documentation_is_right() {
    let page = include_str!("../../../../docs/formats/layout.md");
    let (_, example) = page.split_once("```toml\n").unwrap();
    let (example, _) = example.split_once("```").unwrap();
    let file = parse_layout("docs/formats/layout.md", example.as_bytes()).unwrap();
    assert_eq!(file.layout.name(), "oval with a siding");
    assert_eq!(file.layout.edges().len(), 12);
}

#[test]
fn what_is_no_toml_is_named() {
    assert_eq!(
        complaint("mm = 900 }", "mm = 900 "),
        "oval.toml, line 23, column 3: missing key for inline table element, expected key"
    );
    assert_eq!(
        complaint("name = \"oval\"", "name = oval"),
        "oval.toml, line 2, column 8: string values must be quoted, expected literal string"
    );
    assert_eq!(
        parse_layout("oval.toml", b"name = \"a\"\nformat = 1\nb\xFFd = 2").unwrap_err().to_string(),
        "oval.toml, line 3: byte 2 of the line is not UTF-8; save the file as UTF-8"
    );
}

#[test]
fn keys_are_those_of_a_layout() {
    assert_eq!(
        complaint("edges = [", "edge = ["),
        "oval.toml, line 18, column 1: unknown field `edge`, expected one of `format`, `name`, `about`, \
         `length_uncertainty_mm`, `length_origin`, `length_scale_uncertainty_percent`, `sensors`, `turnouts`, \
         `never_both_curved`, `ends`, `zones`, `blocks`, `boundaries`, `edges`, `crossings`, `distances`"
    );
    assert_eq!(
        complaint("length_origin = \"tape measure\"\n", ""),
        "oval.toml, line 1, column 1: missing field `length_origin`"
    );
    assert_eq!(
        complaint("mm = 900", "cm = 90"),
        "oval.toml, line 22, column 30: unknown field `cm`, expected one of `from`, `to`, `mm`, \
         `uncertainty_mm`, `zone`"
    );
    assert_eq!(
        complaint("mm = 900", "mm = \"900\""),
        "oval.toml, line 22, column 35: invalid type: string \"900\", expected a number"
    );
    assert_eq!(
        complaint("number = 2,", "number = 70000,"),
        "oval.toml, line 11, column 14: invalid value: integer `70000`, expected a whole number from 0 to 65535"
    );
    assert_eq!(
        complaint("[\"A1\", \"A2\"]", "[\"A1\"]"),
        "oval.toml, line 6, column 13: invalid length 1, expected an array of length 2"
    );
    assert_eq!(
        complaint("format = 1", "format = 2"),
        "oval.toml, line 1, column 10: format 2 is not known to this version of Footplate, which reads format 1"
    );
}

#[test]
fn places_are_named_with_what_is_wrong() {
    assert_eq!(
        complaint("length_uncertainty_mm = 5", "length_uncertainty_mm = -5"),
        "oval.toml, line 3, column 25: an uncertainty of -5 mm is not between 0 and 100000 mm"
    );
    assert_eq!(
        complaint(", numbers = [40, 41]", ""),
        "oval.toml, line 7, column 3: `main` does not imply the sensor's number: add `numbers = [.., ..]`, `number = ..` if it \
         reports the same number for both directions, or call it A1 to E16"
    );
    assert_eq!(
        complaint("numbers = [40, 41]", "numbers = [40, 40]"),
        "oval.toml, line 7, column 3: numbers = [40, 40] are one number: write `number = 40` if the sensor reports both \
         directions under it"
    );
    assert_eq!(
        complaint("numbers = [40, 41]", "numbers = [40, 41], number = 40"),
        "oval.toml, line 7, column 3: `main` has `number` and `numbers`: keep `number` if it reports the same number for both \
         directions, `numbers` if it reports one for each"
    );
    assert_eq!(
        complaint("numbers = [40, 41]", "number = 1"),
        "oval.toml, line 7, column 3: sensor 1 is placed at `A2` and again at `main`"
    );
    assert_eq!(
        complaint("numbers = [40, 41]", "numbers = [40, 1]"),
        "oval.toml, line 7, column 3: sensor 1 is placed at `A2` and again at `main_back`"
    );
    assert_eq!(
        complaint("number = 2,", "number = 1,"),
        "oval.toml, line 11, column 3: turnout 1 is placed at `BR1` and again at `BR2`"
    );
    assert_eq!(
        complaint("\"EX2\"", "\"EX1\""),
        "oval.toml, line 16, column 3: the name `EX1` is taken; every node needs its own"
    );
    assert_eq!(
        complaint("\"EX2\"", "\"exit 2\""),
        "oval.toml, line 16, column 3: the name `exit 2` is not 1 to 32 letters, digits, `_` or `.`"
    );
    assert_eq!(
        complaint("at = [10, 20.5]", "at = [10, nan]"),
        "oval.toml, line 11, column 46: [10, NaN] is out of range: coordinates are between -1000000 and 1000000"
    );
    assert_eq!(
        complaint("[[1, 2]]", "[[1, 3]]"),
        "oval.toml, line 13, column 22: turnout 3 makes no pair: it takes two different turnouts of this layout, each in one pair"
    );
}

#[test]
fn edges_are_named_with_what_is_wrong() {
    let to = "oval.toml, line 22, column 24: ";
    assert_eq!(
        complaint("to = \"A1\"", "to = \"A9\""),
        format!("{to}no sensor, turnout or end is called `A9`")
    );
    assert_eq!(
        complaint("to = \"A1\"", "to = \"A1 straight\""),
        format!("{to}`A1 straight` names a leg, but this node has only one exit: write `A1`")
    );
    assert_eq!(
        complaint("to = \"A1\"", "to = \"EN2\""),
        format!("{to}the track ends at `EN2`: edges leave an entry and reach an exit")
    );
    assert_eq!(
        complaint("to = \"A1\"", "to = \"A1 left\""),
        format!(
            "{to}`A1 left` is not an end of an edge: write a name like `C13`, or `BR6 straight` or `BR6 curved`"
        )
    );
    assert_eq!(
        complaint("to = \"A1\"", "to = \"\""),
        format!(
            "{to}`` is not an end of an edge: write a name like `C13`, or `BR6 straight` or `BR6 curved`"
        )
    );
    assert_eq!(
        complaint("to = \"MR2 straight\"", "to = \"MR2\""),
        "oval.toml, line 21, column 25: `MR2` has two legs: write `MR2 straight` or `MR2 curved`"
    );
    for (wrong, shown) in
        [("-0.5", "-0.5"), ("185000", "185000"), ("nan", "NaN"), ("inf", "inf"), ("1e300", "1e300")]
    {
        let shown = if wrong == "1e300" { format!("{}", 1e300) } else { shown.to_owned() };
        assert_eq!(
            complaint("mm = 900", &format!("mm = {wrong}")),
            format!(
                "oval.toml, line 22, column 35: a length of {shown} mm is not between 0 and 100000 mm (is it in millimetres?)"
            )
        );
    }
    assert_eq!(
        complaint(
            "{ from = \"MR2\", to = \"A1\", mm = 900 }",
            "{ from = \"A2\", to = \"BR2\", mm = 900 }, { from = \"MR2\", to = \"A1\", mm = 890 }"
        ),
        "oval.toml, line 22, column 51: there is an edge from `MR2` already; each stretch is written once, in \
         either direction"
    );
    assert_eq!(
        complaint("{ from = \"MR2\", to = \"A1\",", "{ from = \"MR2\", to = \"BR2\","),
        "oval.toml, line 22, column 12: an edge that leaves `MR2` comes back to the same rail end"
    );
}

#[test]
fn rails_that_lead_nowhere_are_named_by_their_place() {
    assert_eq!(
        complaint("  { from = \"BR1 curved\", to = \"EX1\", mm = 300 },\n", ""),
        "oval.toml, line 10, column 3: no edge leads on from `BR1 curved`: join it to another node, or to an end \
         if the track ends there"
    );
    assert_eq!(
        complaint("  { from = \"MR2\", to = \"A1\", mm = 900 },\n", ""),
        "oval.toml, line 6, column 3: no edge leads on from `A2`: join it to another node, or to an end if the \
         track ends there"
    );
}

#[test]
fn a_loop_without_length_is_named() {
    let flat =
        OVAL.replace("mm = 100 ", "mm = 0 ").replace("mm = 250.5", "mm = 0").replace("mm = 900", "mm = 0");
    let error = parse_layout("oval.toml", flat.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("oval.toml, line "), "{error}");
    assert!(error.ends_with("come back to it after 0 mm: at least one must be longer"), "{error}");
}

#[test]
fn too_many_turnouts_without_a_sensor_are_named() {
    // Diamonds in a row: the number of ways doubles with each.
    let diamonds = 30;
    let mut text = "format = 1\nname = \"diamonds\"\nlength_uncertainty_mm = 5\nlength_origin = \"none\"\nturnouts = [\n".to_owned();
    for turnout in 1..=2 * diamonds {
        text += &format!("  {{ number = {turnout}, names = [\"BR{turnout}\", \"MR{turnout}\"] }},\n");
    }
    text += "]\nends = [{ names = [\"EN1\", \"EX1\"] }, { names = [\"EN2\", \"EX2\"] }]\nedges = [\n  { from = \"EN1\", to = \"BR1\", mm = 1 },\n";
    for first in (1..2 * diamonds).step_by(2) {
        let (second, next) =
            (first + 1, if first + 2 > 2 * diamonds { "EX2".to_owned() } else { format!("BR{}", first + 2) });
        for leg in ["straight", "curved"] {
            text += &format!("  {{ from = \"BR{first} {leg}\", to = \"MR{second} {leg}\", mm = 1 }},\n");
        }
        text += &format!("  {{ from = \"MR{second}\", to = \"{next}\", mm = 1 }},\n");
    }
    text += "]\n";
    assert_eq!(
        parse_layout("diamonds.toml", text.as_bytes()).unwrap_err().to_string(),
        "diamonds.toml, line 6, column 3: there are too many paths from `BR1` to the next sensors: put sensors \
         between the turnouts"
    );
}

#[test]
fn a_file_that_is_not_there_or_too_large_is_named() {
    let error = read_layout("no such layout.toml".as_ref()).unwrap_err().to_string();
    assert!(error.starts_with("no such layout.toml: cannot be read: "), "{error}");
    assert_eq!(
        parse_layout("big.toml", &vec![b'#'; LARGEST_LAYOUT + 1]).unwrap_err().to_string(),
        "big.toml: the file is longer than 1048576 bytes; is it a layout?"
    );
    assert!(
        parse_layout("empty.toml", b"")
            .unwrap_err()
            .to_string()
            .starts_with("empty.toml, line 1, column 1: missing field")
    );
}

/// The message for the built-in oval of blocks with one thing changed.
fn complaint_of_blocks(from: &str, to: &str) -> String {
    let text = include_str!("../../layouts/oval-blocks.toml");
    assert!(text.contains(from), "{from}");
    let text = text.replace(from, to);
    parse_layout("oval.toml", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_block_that_is_wrong_is_named_with_its_place() {
    assert_eq!(
        complaint_of_blocks("enters = [\"right curve\"", "enters = [\"curve\""),
        "oval.toml, line 35, column 3: no block is called `curve`: add `{ name = \"curve\", number = .. }` to `blocks`"
    );
    assert_eq!(
        complaint_of_blocks("[\"back right\", \"right curve\"]", "[\"back right\", \"\"]"),
        "oval.toml, line 36, column 3: the rails at `B8` belong to block `right curve`, but trains enter no block there: \
         write `right curve` in `enters`, or put a boundary between"
    );
    assert_eq!(
        complaint_of_blocks("number = 4", "number = 3"),
        "oval.toml, line 27, column 3: detector 3 belongs to `back right` already; give the number that this block reports"
    );
    assert_eq!(
        complaint_of_blocks("blocks = [\n", "blocks = [\n  { name = \"yard\", number = 9 },\n"),
        "oval.toml, line 23, column 3: no boundary leads into block `yard`: name it in `enters` of its boundaries"
    );
    assert_eq!(
        complaint_of_blocks("number = 5", "number = 65536"),
        "oval.toml, line 28, column 35: invalid value: integer `65536`, expected a whole number from 0 to 65535"
    );
}
