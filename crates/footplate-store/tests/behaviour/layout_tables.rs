//! Tables of nodes and edges become a layout, or the row that does not agree with the others is named.

use footplate_core::track::Survey;
use footplate_core::{Length, TurnoutId};
use footplate_store::{
    ImportContext, ImportError, LayoutFile, LayoutTables, import_layout, parse_layout, write_layout,
};

const NODES: &str = "\
name,type,number,reverse
A1,sensor,0,A2
A2,sensor,1,A1
B1,sensor,16,B2
B2,sensor,17,B1
BR1,branch,1,MR1
BR2,branch,2,MR2
MR1,merge,1,BR1
MR2,merge,2,BR2
EN1,enter,1,EX1
EX1,exit,1,EN1
EN2,enter,2,EX2
EX2,exit,2,EN2
";

/// A1 to turnout 1, two tracks of different length to turnout 2, B1 and a track end.
const EDGES: &str = "\
src,dst,direction,dist_mm
EN1,A1,ahead,70
A1,BR1,ahead,100
A2,EX1,ahead,70
B1,EX2,ahead,60.5
B2,BR2,ahead,0
BR1,MR2,straight,400
BR1,MR2,curved,420
BR2,MR1,straight,400
BR2,MR1,curved,420
MR1,A2,ahead,100
MR2,B1,ahead,0
EN2,B2,ahead,60.5
";

const POINTS: &str = "name,x_px,y_px\nA1,10,20\nA2,10,20\nMR2,1.5,-3\n";

fn context() -> ImportContext {
    ImportContext {
        name: "two tracks".into(),
        about: String::new(),
        survey: Survey::taped(Length::from_mm(3.0), "ruler".into()),
        never_both_curved: vec![],
    }
}

fn import(nodes: &str, edges: &str, points: Option<&str>) -> Result<LayoutFile, ImportError> {
    let tables = LayoutTables {
        nodes: ("nodes.csv".to_owned(), nodes.as_bytes()),
        edges: ("edges.csv".to_owned(), edges.as_bytes()),
        schematic: points.map(|points| ("points.csv".to_owned(), points.as_bytes())),
    };
    import_layout(tables, &context())
}

/// The complaint about the tables with one text of one of them replaced by another.
fn complaint(right: &str, wrong: &str) -> String {
    let (nodes, edges, points) = (NODES.to_owned(), EDGES.to_owned(), POINTS.to_owned());
    let with = |text: String| text.replacen(right, wrong, 1);
    assert!([&nodes, &edges, &points].iter().filter(|text| text.contains(right)).count() == 1, "{right}");
    import(&with(nodes), &with(edges), Some(&with(points))).unwrap_err().to_string()
}

#[test]
fn the_tables_are_right_and_write_as_a_layout_file() {
    let file = import(NODES, EDGES, Some(POINTS)).unwrap();
    assert_eq!((file.layout.nodes().len(), file.layout.edges().len()), (12, 12));
    assert!((file.layout.total_length().as_mm() - 1_050.5).abs() < 1e-9);
    assert_eq!(file.drawing.point(file.layout.node_named("BR2").unwrap()), Some([1.5, -3.0]));
    // The twin of each of the two tracks between the turnouts is the one of its own length.
    let text = write_layout(&file);
    assert!(text.contains("{ from = \"BR1 straight\", to = \"MR2 straight\", mm = 400 }"), "{text}");
    assert!(text.contains("{ from = \"BR1 curved\", to = \"MR2 curved\", mm = 420 }"), "{text}");
    assert_eq!(parse_layout("written.toml", text.as_bytes()).unwrap(), file);
    // The rows may come in any order, with more columns, Windows line ends and a byte order mark.
    let mut rows: Vec<String> = EDGES.lines().map(|line| format!("{line},more\r\n")).collect();
    rows[1..].reverse();
    let same = import(&format!("\u{feff}{NODES}"), &rows.concat(), None).unwrap();
    assert!((same.layout.total_length().as_mm() - 1_050.5).abs() < 1e-9);
}

#[test]
fn a_field_that_is_not_what_it_should_be_is_named() {
    assert_eq!(
        complaint("B1,sensor,16,B2", "B1,contact,16,B2"),
        "nodes.csv, line 4, column 2 (type): `contact` should be `sensor`, `branch`, `merge`, `enter` or `exit`"
    );
    assert_eq!(
        complaint("B1,sensor,16,B2", "B1,sensor,-1,B2"),
        "nodes.csv, line 4, column 3 (number): `-1` should be a whole number from 0 to 65535"
    );
    assert_eq!(
        complaint("A1,BR1,ahead,100", "A1,BR1,forward,100"),
        "edges.csv, line 3, column 3 (direction): `forward` should be `ahead`, `straight` or `curved`"
    );
    assert_eq!(
        complaint("A1,BR1,ahead,100", "A1,BR1,ahead,10 cm"),
        "edges.csv, line 3, column 4 (dist_mm): `10 cm` should be a length in millimetres"
    );
    assert_eq!(
        complaint("MR2,1.5,-3", "MR2,1.5,NaN"),
        "points.csv, line 4, column 3 (y_px): `NaN` should be a number between -1000000 and 1000000"
    );
    assert_eq!(
        complaint("type,number", "kind,index"),
        "nodes.csv: the header lacks these columns: type, number"
    );
    assert_eq!(
        import(NODES, EDGES.strip_suffix(",60.5\n").unwrap(), None).unwrap_err().to_string(),
        "edges.csv, line 13: the row is incomplete; was the whole file copied?"
    );
    assert_eq!(
        import("", EDGES, None).unwrap_err().to_string(),
        "nodes.csv: the file is empty; its first line should name the columns"
    );
}

#[test]
fn a_node_that_does_not_agree_with_its_reverse_is_named() {
    assert_eq!(
        complaint("B1,sensor,16,B2", "A1,sensor,16,B2"),
        "nodes.csv, line 4: the node `A1` is already in line 2; every node needs its own name"
    );
    assert_eq!(
        complaint("B1,sensor,16,B2", "B1,sensor,16,"),
        "nodes.csv, line 4: the reverse of `B1` should be a node of this file; `` is not"
    );
    assert_eq!(
        complaint("B1,sensor,16,B2", "B1,sensor,16,A2"),
        "nodes.csv, line 4: the reverse of `B1` is `A2`, so the reverse of `A2` should be `B1`, not `A1`"
    );
    assert_eq!(
        complaint("B1,sensor,16,B2", "B1,sensor,16,B1"),
        "nodes.csv, line 4: `B1` cannot be its own reverse: each direction of travel is a node of its own"
    );
    assert_eq!(
        complaint("B2,sensor,17,B1", "B2,exit,17,B1"),
        "nodes.csv, line 4: `B1` is of type sensor, so its reverse `B2` should be of type sensor, not exit"
    );
    assert_eq!(
        complaint("MR1,merge,1,BR1", "MR1,merge,3,BR1"),
        "nodes.csv, line 6: `BR1` is turnout 1, so its reverse `MR1` should be, too, and it is 3"
    );
    assert_eq!(
        complaint("B2,sensor,17,B1", "B2,sensor,0,B1"),
        "nodes.csv, line 4: sensor 0 is placed at `A1` and again at `B2`"
    );
}

#[test]
fn an_edge_that_does_not_agree_with_its_twin_is_named() {
    assert_eq!(
        complaint("A1,BR1,ahead,100\n", ""),
        "edges.csv, line 10: the edge from `MR1` to `A2` has no twin: there should be one from `A1` to `BR1`"
    );
    assert_eq!(
        complaint("MR1,A2,ahead,100", "MR1,A2,ahead,101"),
        "edges.csv, line 3: the edge from `A1` to `BR1` is 100 mm long and its twin in line 11 101 mm; they are \
         the same rail"
    );
    assert_eq!(
        complaint("BR2,MR1,curved,420", "BR2,MR1,curved,421"),
        "edges.csv, line 8: the edge from `BR1` to `MR2` is 420 mm long and its twin in line 10 421 mm; they \
         are the same rail"
    );
    assert_eq!(
        complaint("A1,BR1,ahead,100", "A1,BR9,ahead,100"),
        "edges.csv, line 3: no node is called `BR9`"
    );
    assert_eq!(
        complaint("BR1,MR2,curved,420", "BR1,MR2,straight,420"),
        "edges.csv, line 8: line 7 already has an edge that leaves `BR1` by the same exit"
    );
    assert_eq!(
        complaint("A1,BR1,ahead,100", "A1,A2,ahead,100"),
        "edges.csv, line 3: the edge from `A1` to `A2` has no twin: there should be one from `A1` to `A2`"
    );
}

#[test]
fn what_is_no_layout_is_named_with_its_row() {
    assert_eq!(
        complaint("A1,BR1,ahead,100", "A1,BR1,straight,100"),
        "edges.csv, line 3: `A1 straight` names a leg, but this node has only one exit: write `A1`"
    );
    let long = EDGES.replace(",100\n", ",185000\n");
    assert_eq!(
        import(NODES, &long, None).unwrap_err().to_string(),
        "edges.csv, line 3: a length of 185000 mm is not between 0 and 100000 mm (is it in millimetres?)"
    );
    let open = EDGES.replace("BR1,MR2,curved,420\n", "").replace("BR2,MR1,curved,420\n", "");
    assert_eq!(
        import(NODES, &open, None).unwrap_err().to_string(),
        "nodes.csv, line 6: no edge leads on from `BR1 curved`: join it to another node, or to an end if the \
         track ends there"
    );
    let tables = LayoutTables {
        nodes: ("nodes.csv".to_owned(), NODES.as_bytes()),
        edges: ("edges.csv".to_owned(), EDGES.as_bytes()),
        schematic: None,
    };
    let pair = ImportContext { never_both_curved: vec![[TurnoutId(1), TurnoutId(9)]], ..context() };
    assert_eq!(
        import_layout(tables, &pair).unwrap_err().to_string(),
        "turnout 9 makes no pair: it takes two different turnouts of this layout, each in one pair"
    );
}

#[test]
fn points_are_those_of_places() {
    assert_eq!(complaint("MR2,1.5,-3", "MR9,1.5,-3"), "points.csv, line 4: no node is called `MR9`");
    assert_eq!(
        complaint("A2,10,20", "A2,10,21"),
        "points.csv, line 3: `A2` and `A1` are one place, but are drawn at different points"
    );
}
