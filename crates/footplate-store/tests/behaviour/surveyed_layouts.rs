//! Layouts of which lengths are not known, or known from trains: read, written and read again as the same.

use footplate_core::Length;
use footplate_core::track::{StretchLength, Survey, SurveyedDistance};
use footplate_store::{LayoutFile, built_in, parse_layout, write_layout};

const LOOP: &str = "format = 1\nname = \"loop\"\nlength_uncertainty_mm = 2\nlength_origin = \"tape\"\n\
    sensors = [{ names = [\"A1\", \"A2\"] }, { names = [\"A3\", \"A4\"] }]\n\
    edges = [\n  { from = \"A1\", to = \"A3\" },\n  { from = \"A3\", to = \"A1\", mm = 800 },\n]\n";

#[test]
fn an_edge_needs_no_length() {
    let file = parse_layout("loop.toml", LOOP.as_bytes()).unwrap();
    let known: Vec<StretchLength> = file.layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
    assert_eq!(known, [StretchLength::Unknown, StretchLength::Measured(Length::from_mm(800.0))]);
    assert!(!file.layout.is_measured());
    let text = write_layout(&file);
    assert!(text.contains("{ from = \"A1\", to = \"A3\" },"), "{text}");
    assert_eq!(parse_layout("again.toml", text.as_bytes()).unwrap(), file);
}

#[test]
fn a_survey_is_kept_with_its_uncertainty() {
    let file = built_in("track-a").unwrap();
    let layout = &file.layout;
    let mut lengths: Vec<StretchLength> = layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
    let hop = layout.hops_from(layout.node_named("C14").unwrap()).next().unwrap();
    let mm = Length::from_mm;
    for edge in hop.edges {
        let edge = &mut lengths[usize::from(edge.stretch().0)];
        let (length, _) = edge.estimate(layout.survey());
        *edge = StretchLength::Estimated { length: length + mm(3.25), uncertainty: mm(41.5) };
    }
    let longer = hop.length + hop.edges.len() as f64 * mm(3.25);
    let distances = vec![SurveyedDistance {
        from: "C14".into(),
        to: layout.node_name(hop.to).into(),
        length: longer,
        uncertainty: mm(4.5),
    }];
    let survey = Survey { scale: 0.0125, distances, ..layout.survey().clone() };
    let surveyed = LayoutFile { layout: layout.surveyed(&lengths, survey).unwrap(), ..file.clone() };
    let text = write_layout(&surveyed);
    assert!(text.contains("length_scale_uncertainty_percent = 1.25"), "{text}");
    let again = parse_layout("again.toml", text.as_bytes()).unwrap();
    // Millimetres in decimals are metres but for the last bit; written again they are the same text.
    assert_eq!(write_layout(&again), text);
    let hop = again.layout.hop(hop.id).unwrap();
    assert_eq!(again.layout.surveyed_distance(hop.id), Some(mm(4.5)));
}

#[test]
fn what_is_wrong_with_a_survey_is_said_with_its_place() {
    let refusal = |from: &str, to: &str| {
        let text = LOOP.replace(from, to);
        parse_layout("loop.toml", text.as_bytes()).unwrap_err().to_string()
    };
    assert_eq!(
        refusal("to = \"A3\" }", "to = \"A3\", uncertainty_mm = 3 }"),
        "loop.toml, line 7, column 46: an uncertainty without a length: add `mm`, or leave out \
         `uncertainty_mm`"
    );
    let negative = refusal("mm = 800", "mm = 800, uncertainty_mm = -1");
    assert!(negative.contains("line 8, column 56: an uncertainty of -1 mm is not between"), "{negative}");
    let distance = "length_origin = \"tape\"\ndistances = [{ from = \"A3\", to = \"A1\", mm = 810, uncertainty_mm = 3 }]";
    let unequal = refusal("length_origin = \"tape\"", distance);
    assert!(unequal.ends_with(
        "a distance of 810 mm is not the sum of the edges between, 800 mm: correct one or the other"
    ));
    assert!(unequal.starts_with("loop.toml, line 5, column 14"), "{unequal}");
}
