//! A panel of JMRI's Layout Editor becomes a layout; what it does not say is listed and not made up.

use footplate_core::track::{Crossing, Leg, NodeKind, StretchLength, Survey};
use footplate_core::{Length, SensorId, TurnoutId};
use footplate_store::{ImportContext, ImportedPanel, import_panel, parse_layout, write_layout};

const SIDING: &str = include_str!("../../../../testdata/panels/jmri_siding.xml");
const SLIP: &str = include_str!("../../../../testdata/panels/jmri_slip.xml");

fn imported(text: &str) -> Result<ImportedPanel, String> {
    let context = ImportContext {
        name: "siding".to_owned(),
        about: String::new(),
        survey: Survey::taped(Length::from_mm(10.0), "assumed".to_owned()),
        never_both_curved: Vec::new(),
    };
    import_panel("panel.xml", text, &context).map_err(|error| error.to_string())
}

#[test]
fn a_panel_becomes_a_layout_with_its_blocks_turnouts_and_ends() {
    let panel = imported(SIDING).unwrap();
    let layout = &panel.file.layout;
    let count =
        |is_kind: fn(&NodeKind) -> bool| layout.nodes().filter(|(_, node)| is_kind(&node.kind)).count();
    assert_eq!(count(|kind| matches!(kind, NodeKind::Branch(_))), 2);
    assert_eq!(count(|kind| matches!(kind, NodeKind::Exit)), 2);
    let blocks: Vec<(&str, SensorId)> =
        layout.blocks().iter().map(|block| (block.name.as_str(), block.detector)).collect();
    // LS17 is input 17 of the station, and Footplate's sensor 16.
    let expected = [("East throat", 17), ("Main", 16), ("West", 0), ("West throat", 1)];
    assert_eq!(blocks, expected.map(|(name, number)| (name, SensorId(number))));
    // The edges whose length a block states: West, Main and Siding, which are one track each.
    let mut known: Vec<f64> = layout
        .edges()
        .filter(|(_, edge)| edge.known != StretchLength::Unknown)
        .map(|(_, edge)| edge.length.as_mm())
        .collect();
    known.dedup();
    known.sort_by(f64::total_cmp);
    known.dedup();
    assert_eq!(known, [800.0, 1_200.0, 1_210.0]);
    // From the bumper to the west switch, and by its closed leg to Main.
    let toe = layout.node_named("BR5").unwrap();
    let straight =
        layout.edges().find(|(_, edge)| edge.from == toe && edge.leg == Some(Leg::Straight)).unwrap().1;
    assert_eq!(layout.node_name(straight.to), "TO1Ba");
    let entered = layout.block_of_entry(layout.sensor_at(straight.to).unwrap()).unwrap();
    assert_eq!(entered.name, "Main");
    // The east switch is closed for its diverging leg.
    let merge = layout.node_named("BR6").unwrap();
    let closed =
        layout.edges().find(|(_, edge)| edge.from == merge && edge.leg == Some(Leg::Straight)).unwrap().1;
    assert_eq!(layout.node_name(closed.to), "TO2Ca");
    assert!(layout.turnouts().any(|(turnout, _)| turnout == TurnoutId(6)));
    assert_eq!(panel.file.drawing.point(toe), Some([200.0, 100.0]));
    let expected = [
        "the detector of block `Siding`: its sensor `ISSIDING` does not end with a number from 1 on",
        "the sensors at A1: add them as `sensors` if they are devices at the track",
        "what follows EC1: the track ends there on this panel",
    ];
    assert_eq!(panel.left_out[..3], expected);
    assert!(panel.left_out[3].starts_with("the lengths of 6 of 9 edges"), "{:?}", panel.left_out);
    assert_eq!(panel.left_out.len(), 4);
}

#[test]
fn the_layout_file_of_a_panel_is_read_as_the_same_layout() {
    let panel = imported(SIDING).unwrap();
    let text = write_layout(&panel.file);
    let read = parse_layout("siding.toml", text.as_bytes()).unwrap();
    // Nodes are numbered in the order of the file.
    assert_eq!(write_layout(&read), text);
}

#[test]
fn a_file_that_is_no_panel_is_refused_with_what_to_give() {
    let refused = |text: &str| imported(text).unwrap_err();
    assert!(refused("<layout-config>").contains("save the panel in JMRI again"));
    let without = refused("<locomotive-config/>");
    assert!(without.contains("give a file that JMRI's Layout Editor saved"), "{without}");
    let unnamed = refused(&SIDING.replace("turnoutname=\"LT6\"", "turnoutname=\"east\""));
    assert!(unnamed.starts_with("panel.xml, line 24, column 5: turnout TO2 has no number"), "{unnamed}");
    assert!(refused("<!DOCTYPE a [<!ENTITY x \"y\">]><layout-config/>").contains("not sound XML"));
}

#[test]
fn tracks_that_lead_nowhere_end_in_the_layout_and_are_listed() {
    // A crossover in the place of the east switch, and legs without a track.
    let slip = SIDING.replace("type=\"2\" continuing=\"4\"", "type=\"DOUBLE_XOVER\" continuing=\"2\"");
    let panel = imported(&slip).unwrap();
    assert!(panel.left_out.iter().any(|line| line.starts_with("TO2: neither")), "{:?}", panel.left_out);
    let layout = &panel.file.layout;
    assert_eq!(layout.nodes().filter(|(_, node)| node.kind == NodeKind::Exit).count(), 5);
    let open = SIDING.replace("connectcname=\"T5\"/>", "/>");
    let panel = imported(&open).unwrap();
    assert!(
        panel.left_out.iter().any(|line| line.starts_with("leg C of turnout TO1")),
        "{:?}",
        panel.left_out
    );
}

/// Where the legs of both turnouts of the slip lead, straight and curved, by the node that a train comes to.
fn routes(panel: &ImportedPanel) -> [[String; 2]; 2] {
    let layout = &panel.file.layout;
    ["BR7", "BR8"].map(|branch| {
        let node = layout.node_named(branch).unwrap();
        [Leg::Straight, Leg::Curved].map(|leg| {
            let mut edges = layout.edges().map(|(_, edge)| edge);
            let edge = edges.find(|edge| edge.from == node && edge.leg == Some(leg)).unwrap();
            layout.node_name(edge.to).to_owned()
        })
    })
}

#[test]
fn a_double_slip_becomes_two_turnouts_that_are_joined_at_their_toes() {
    let panel = imported(SLIP).unwrap();
    let layout = &panel.file.layout;
    let [merge, branch] = ["MR7", "BR8"].map(|name| layout.node_named(name).unwrap());
    let between = layout.edge(layout.edge_between(merge, branch).unwrap()).unwrap();
    assert_eq!((between.length, between.known), (Length::ZERO, Length::ZERO.into()));
    let names = |[one, other]: [[&str; 2]; 2]| [one.map(str::to_owned), other.map(str::to_owned)];
    // From A into the block of the middle, by a boundary there; from B over the crossing to the bumper.
    assert_eq!(routes(&panel), names([["SL1Aa", "EX_EB2"], ["EX_EB3", "EX_EB4"]]));
    // Thrown for what closed usually is, at the first end only.
    let state = |turnout: &str| format!("<turnout>{turnout}</turnout><turnoutB>");
    let inverted = SLIP.replace(&state("2"), "<turnout>x").replace(&state("4"), &state("2"));
    let inverted = inverted.replace("<turnout>x", &state("4"));
    assert_eq!(routes(&imported(&inverted).unwrap()), names([["EX_EB2", "SL1Aa"], ["EX_EB3", "EX_EB4"]]));
    // One drive for both ends: it lies alike for both routes that are straight, and for both that are curved.
    let single_drive =
        SLIP.replace("<B-D><turnout>4</turnout><turnoutB>4", "<B-D><turnout>2</turnout><turnoutB>2");
    let left_out = imported(&single_drive).unwrap().left_out;
    let expected =
        "the slip SL1: the states of its `turnout` are not those of a turnout at one end; tracks end at it";
    assert!(left_out.contains(&expected.to_owned()), "{left_out:?}");
    let left_out = imported(&SLIP.replace("DOUBLE_SLIP", "SINGLE_SLIP")).unwrap().left_out;
    assert!(left_out[0].starts_with("the slip SL1: it is a single slip"), "{left_out:?}");
}

#[test]
fn a_level_crossing_is_on_both_of_its_tracks() {
    let panel = imported(SLIP).unwrap();
    let layout = &panel.file.layout;
    let [Crossing { tracks: [one, other] }] = layout.crossings() else { panic!("one crossing") };
    // One track changes its block there: the crossing is at the boundary. The other one is an edge of unknown length.
    let ends =
        |edge| layout.edge(edge).map(|edge| [edge.from, edge.to].map(|node| layout.node_name(node))).unwrap();
    let at = [(ends(one.edge), one.offset.as_mm()), (ends(other.edge), other.offset.as_mm())];
    assert_eq!(at[0].1, 0.0, "{at:?}");
    assert!(at[0].0.contains(&"X1ACa"), "{at:?}");
    assert_eq!(at[1].1, 175.0, "the middle of 350 mm, which stand for an unknown length: {at:?}");
    let expected =
        "where the tracks of level crossing X1 cross: assumed; measure it and correct `mm` in `crossings`";
    assert!(panel.left_out.contains(&expected.to_owned()), "{:?}", panel.left_out);
    let text = write_layout(&panel.file);
    assert_eq!(write_layout(&parse_layout("junction.toml", text.as_bytes()).unwrap()), text);
}
