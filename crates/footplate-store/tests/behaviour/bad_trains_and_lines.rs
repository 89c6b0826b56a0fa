//! What is wrong with a train or a line is said with its place, and no text makes a reader panic.

use footplate_store::{parse_described, parse_line, parse_train};
use proptest::prelude::*;

const TRAIN: &str = "format = 1\nname = \"unit\"\nlength_m = 100.0\nmass_kg = 100e3\nrotating_mass = 0.1\n\
max_speed_m_s = 40.0\n[resistance]\nconstant_n = 1e3\nlinear_n_s_m = 20\nsquare_n_s2_m2 = 4.0\n[brake]\n\
service_m_s2 = 0.8\n[traction]\nforce_n = 1e5\npower_w = 1e6\n";

const LINE: &str = "format = 1\nname = \"line\"\nspeed_limits_km_h = [[0, 100], [500, 60]]\n\
gradients_per_mille = [[0, 5], [300, -5]]\nstops = [\n  { name = \"A\", at_m = 0 },\n  \
{ name = \"B\", at_m = 1000, dwell_s = 30 },\n]\n";

const OSRD: &str = include_str!("rolling_stock.json");

fn train_fault(file: &str, text: &str) -> String {
    parse_train(file, text.as_bytes(), None).unwrap_err().to_string()
}

fn line_fault(text: &str) -> String {
    parse_line("line.toml", text.as_bytes(), None).unwrap_err().to_string()
}

fn testdata(path: &str) -> String {
    std::fs::read_to_string(format!("{}/../../testdata/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

#[test]
fn a_wrong_value_of_a_train_is_pointed_at() {
    let fault = |from: &str, to: &str| train_fault("unit.toml", &TRAIN.replacen(from, to, 1));
    assert_eq!(
        fault("mass_kg = 100e3", "mass_kg = -3"),
        "unit.toml, line 4, column 11: the mass is -3; it should lie between 100 and 200000000"
    );
    assert_eq!(
        fault("length_m = 100.0", "length_m = \"long\""),
        "unit.toml, line 3, column 12: `length_m` is \"long\"; it should be a number"
    );
    assert_eq!(
        fault("linear_n_s_m = 20", "linear_n_s_m = nan"),
        "unit.toml, line 9, column 16: `linear_n_s_m` is NaN; it should be a number"
    );
    assert_eq!(fault("force_n = 1e5\n", ""), "unit.toml, line 13, column 1: `traction` lacks `force_n`");
    assert_eq!(
        fault("service_m_s2", "servise_m_s2"),
        "unit.toml, line 12, column 16: `servise_m_s2` is not a key of `brake`; its keys are service_m_s2, full_n"
    );
    assert_eq!(
        fault("format = 1", "format = 9"),
        "unit.toml, line 1, column 10: `format` is 9; it should be 1, the one that this version of Footplate knows"
    );
    assert_eq!(
        fault("force_n = 1e5\npower_w = 1e6", "effort_n_at_m_s = [[1e5, 0], [5e4, 10, 20]]"),
        "unit.toml, line 14, column 30: an entry of `effort_n_at_m_s` is a list of 3; it should be a list of 2: \
         force in N, speed in m/s"
    );
}

#[test]
fn a_wrong_value_of_a_line_is_pointed_at() {
    let fault = |from: &str, to: &str| line_fault(&LINE.replacen(from, to, 1));
    assert_eq!(
        fault("[500, 60]", "[0, 60]"),
        "line.toml, line 3, column 32: speed limit 2 begins at 0 m, and the one before it at 0 m; places should rise"
    );
    assert_eq!(
        fault("[300, -5]", "[300, -500]"),
        "line.toml, line 4, column 32: gradient 2 is -500; it should lie between -150 and 150"
    );
    assert_eq!(
        fault("at_m = 1000, dwell_s = 30", "at_m = 1000, dwell_s = -1"),
        "line.toml, line 7, column 3: stop 2 has a dwell of -1 s; it should lie between 0 and 86400"
    );
    assert_eq!(
        fault("speed_limits_km_h", "speed_limits"),
        "line.toml, line 3, column 16: `speed_limits` is not a key of a line; its keys are format, name, about, \
         speed_limits_km_h, gradients_per_mille, curve_resistances_per_mille, stops"
    );
}

#[test]
fn a_wrong_value_of_another_form_is_pointed_at() {
    let ttobench = testdata("trains/ttobench_NL_Intercity_VIRM6.json");
    assert_eq!(
        train_fault("virm.json", &ttobench.replacen("\"kg\"", "\"lb\"", 1)),
        "virm.json, line 9, column 17: the unit of `mass` is \"lb\"; it should be kg or t"
    );
    assert_eq!(
        train_fault("virm.json", &ttobench.replacen("391000.0", "391000000000.0", 1)),
        "virm.json, line 8, column 13: the mass is 391000000000; it should lie between 100 and 200000000"
    );
    let yaml = testdata("trains/trainruns_local.yaml");
    assert_eq!(
        train_fault("local.yaml", &yaml.replacen("[DB_BR_642]", "[DB_BR_641]", 1)),
        "local.yaml, line 8, column 17: there is no `DB_BR_641` in the file, which describes DB_BR_642"
    );
    assert_eq!(
        train_fault("local.yaml", &yaml.replacen("2022.05", "2031.05", 1)),
        "local.yaml, line 4, column 17: `schema_version` is \"2031.05\"; it should be \"2022.05\""
    );
    assert_eq!(
        train_fault("stock.json", &OSRD.replacen("\"davis\"", "\"table\"", 1)),
        "stock.json, line 9, column 35: `type` is \"table\"; it should be \"davis\", the one kind that is known"
    );
    assert_eq!(
        train_fault("stock.json", &OSRD.replacen("[400000, 300000]", "[400000]", 1)),
        "stock.json, line 14, column 62: `max_efforts` is a list of 1; it should be a list of 2, as long as `speeds`"
    );
    assert!(parse_train("stock.json", OSRD.as_bytes(), None).is_ok());
}

#[test]
fn one_of_several_is_asked_for_by_name() {
    let yaml = testdata("lines/trainruns_const.yaml");
    let second = yaml.replacen("    id: const", "    id: other", 1);
    let both = yaml + second.split("paths:\n").nth(1).unwrap();
    let read = |which| parse_line("both.yaml", both.as_bytes(), which);
    assert!(read(Some("other")).is_ok());
    assert_eq!(
        read(None).unwrap_err().to_string(),
        "both.yaml, line 6, column 3: the file describes const, other; say which one"
    );
    assert_eq!(
        read(Some("third")).unwrap_err().to_string(),
        "both.yaml, line 6, column 3: there is no `third` in the file, which describes const, other"
    );
}

#[test]
fn the_only_one_is_not_given_out_for_another() {
    let fault = |which| parse_line("line.toml", LINE.as_bytes(), which).map_err(|error| error.to_string());
    assert!(fault(Some("line")).is_ok());
    assert_eq!(
        fault(Some("branch")).unwrap_err(),
        "line.toml, line 1, column 1: there is no `branch` in the file, which describes line"
    );
    assert!(parse_train("stock.json", OSRD.as_bytes(), Some("another")).is_err());
}

#[test]
fn what_is_neither_train_nor_line_is_told_so() {
    let fault = |file: &str, bytes: &[u8]| parse_described(file, bytes, None).unwrap_err().to_string();
    assert!(
        fault("log.csv", b"t_s,kind\n")
            .ends_with("its name should end in .toml (Footplate's own form), .json or .yaml")
    );
    assert!(fault("x.json", b"{\"a\": 1}").contains("neither a train nor a line"));
    assert!(fault("x.json", b"{\"a\": 1").starts_with("x.json, line "));
    assert_eq!(
        fault("x.toml", b"name = \"\xff\"\n"),
        "x.toml, line 1, column 9: no UTF-8 text; save the file as UTF-8"
    );
    assert!(fault("x.yaml", &vec![b' '; 2 * 1024 * 1024]).contains("is it a train or a line?"));
    // An empty file is told what its form lacks.
    assert_eq!(fault("x.toml", b""), "x.toml, line 1, column 1: a train lacks `format`");
}

/// Texts that are nearly trains and lines: a piece cut out, doubled or replaced.
fn nearly() -> impl Strategy<Value = (String, Vec<u8>)> {
    let texts = [
        ("x.toml", TRAIN.to_owned()),
        ("x.toml", LINE.to_owned()),
        ("x.json", OSRD.to_owned()),
        ("x.json", testdata("trains/ttobench_CN_Beijing_Subway.json")),
        ("x.yaml", testdata("trains/trainruns_local.yaml")),
        ("x.json", testdata("lines/ttobench_00_var_gradient_minusplus_6.json")),
        ("x.yaml", testdata("lines/trainruns_speed.yaml")),
    ];
    let replacements = prop::sample::select(vec![
        "", "-", "1e999", "nan", "null", "[]", "{}", "\"", "[[", "1e-300", "-0", "&a ", "*a", "!t ", "\t",
        "\n", "\u{feff}", "'", ": ", "0",
    ]);
    (prop::sample::select(texts.to_vec()), 0.0..1.0_f64, 0_usize..40, replacements, any::<bool>()).prop_map(
        |((file, text), at, length, replacement, double)| {
            let mut bytes = text.into_bytes();
            let at = (at * bytes.len() as f64) as usize;
            let end = (at + length).min(bytes.len());
            let piece = bytes[at..end].to_vec();
            bytes.splice(at..end, replacement.bytes());
            if double {
                bytes.splice(at..at, piece);
            }
            (file.to_owned(), bytes)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn what_is_nearly_right_is_read_or_named((file, bytes) in nearly()) {
        match parse_described(&file, &bytes, None) {
            Ok(footplate_store::Described::Train(read)) => prop_assert!(read.train.check().is_ok()),
            Ok(footplate_store::Described::Line(read)) => prop_assert!(read.line.stops().len() >= 2),
            Err(error) => {
                let says = error.to_string();
                prop_assert!(says.starts_with(&file) && says.len() < 1000 && !says.contains('\n'), "{says}");
            }
        }
    }

    #[test]
    fn no_text_makes_a_reader_panic(text in "\\PC*|[\\[\\]{}:,\"'#&*!|>%@`\\-? \n\ta0.]{0,80}", toml in any::<bool>()) {
        let file = if toml { "x.toml" } else { "x.yaml" };
        prop_assert!(parse_described(file, text.as_bytes(), None).is_err());
    }
}
