//! A vehicle file that is wrong is refused with line, column, value and what would be right; none makes us panic.

use footplate_core::odometry::wheels::{Axle, Thresholds};
use footplate_core::{Acceleration, TimeSpan};
use footplate_store::{DEFAULT_VEHICLE, parse_vehicle, write_vehicle};
use proptest::prelude::{any, prop, prop_assert, prop_assert_eq, proptest};

fn refusal(text: &str) -> String {
    parse_vehicle("train.toml", text.as_bytes()).expect_err("it is wrong").to_string()
}

/// The refusal of the built-in vehicle with one text of it replaced.
fn replaced(from: &str, to: &str) -> String {
    assert!(DEFAULT_VEHICLE.contains(from));
    refusal(&DEFAULT_VEHICLE.replacen(from, to, 1))
}

#[test]
fn what_is_wrong_is_named_with_its_place_and_what_would_be_right() {
    for (from, to, says) in [
        (
            "diameter_m = 0.86",
            "diameter_m = 860",
            "train.toml, line 9, column 14: diameter_m is 860; it should lie between 0.1 and 3",
        ),
        (
            "max_speed_m_s",
            "max_sped_m_s",
            "train.toml, line 3, column 1: `max_sped_m_s` is not a key of a vehicle; did you mean `max_speed_m_s`?",
        ),
        (
            "period_s = 0.05",
            "",
            "line 1, column 1: a vehicle lacks `period_s`; docs/formats/vehicle.md shows an",
        ),
        ("teeth = 80", "", "line 7, column 1: `[[wheelset]]` lacks `teeth`;"),
        (
            "period_s = 0.05",
            "period_s = nan",
            "line 2, column 12: period_s is NaN; it should lie between 0.001",
        ),
        ("period_s = 0.05", "period_s = \"fast\"", "period_s is the text `fast`; it should be a number"),
        ("teeth = 80", "teeth = 80.5", "line 8, column 9: teeth is 80.5; it should be a whole number"),
        ("teeth = 80", "teeth = -80", "line 8, column 9: teeth is -80; it should lie between 1 and 10000"),
        ("teeth = 80", "teeth = 0x1_0000_0000", "teeth is 4294967296; it should lie between 1 and 10000"),
        ("\"powered\"", "\"steam\"", "axle is the text `steam`; it should be \"powered\", \"trailing\" or"),
        ("\"powered\"", "1", "axle is 1; it should be \"powered\""),
        ("[[wheelset]]", "[[wheelsets]]", "line 13, column 1: 1 tables `[[wheelset]]`; there should be two"),
        ("name = ", "name = 7 #", "name is 7; it should be a text in quotes"),
        ("name", "nam", "line 1, column 1: `nam` is not a key of a vehicle; did you mean `name`?"),
        ("name", "wind", "`wind` is not a key of a vehicle; its keys are name, period_s,"),
        ("name = ", "= ", "line 1, column 1"),
    ] {
        let message = replaced(from, to);
        assert!(message.contains(says), "{message}");
    }
    assert!(
        refusal("wheelset = 2\nperiod_s = 1\nmax_speed_m_s = 1\nmax_traction_m_s2 = 1\nmax_brake_m_s2 = 1")
            .contains("line 1, column 12: wheelset is 2; it should be two tables, each below `[[wheelset]]`")
    );
    let third = format!("{DEFAULT_VEHICLE}\n[[wheelset]]\nteeth = 80\n");
    assert!(refusal(&third).contains("3 tables `[[wheelset]]`; there should be two"));
}

#[test]
fn the_second_wheelset_is_pointed_at_if_it_is_the_one() {
    let at = DEFAULT_VEHICLE.rfind("0.86").unwrap();
    let text = format!("{}9{}", &DEFAULT_VEHICLE[..at], &DEFAULT_VEHICLE[at + 4..]);
    assert!(refusal(&text).starts_with("train.toml, line 15, column 14: diameter_m is 9;"));
}

#[test]
fn tables_replace_only_what_they_name() {
    let text = format!(
        "{DEFAULT_VEHICLE}\n[thresholds]\ncreepage = 0.1\nclear_after_s = 2\n\n[brake_command]\nbuild_up_s = 1.5\n"
    );
    let vehicle = parse_vehicle("train.toml", text.as_bytes()).unwrap().vehicle;
    let mut thresholds = Thresholds::derived(vehicle.max_traction, vehicle.max_brake);
    thresholds.creepage = 0.1;
    thresholds.clear_after = TimeSpan::from_s(2.0);
    assert_eq!(vehicle.thresholds, thresholds);
    assert_eq!(vehicle.brake_command.build_up, TimeSpan::from_ms(1500));
    // Three quarters of the emergency brake, as docs/formats/vehicle.md says.
    assert!((vehicle.brake_command.full - Acceleration::from_m_per_s2(1.05)).abs().as_m_per_s2() < 1e-12);

    let text = format!(
        "{DEFAULT_VEHICLE}\n[thresholds]\nrolling_creepage = 0.01\n[brake_command]\nresistance_m_s2 = 0.2\n"
    );
    let vehicle = parse_vehicle("train.toml", text.as_bytes()).unwrap().vehicle;
    assert_eq!(vehicle.thresholds.rolling_creepage, 0.01);
    assert_eq!(vehicle.brake_command.resistance.as_m_per_s2(), 0.2);
    let wrong = format!("{DEFAULT_VEHICLE}\n[brake_command]\nresistance_m_s2 = -0.2\n");
    assert!(refusal(&wrong).contains("resistance_m_s2 is -0.2; it should lie between 0 and 5"));

    let wrong = format!("{DEFAULT_VEHICLE}\n[thresholds]\ncreepge = 0.1\n");
    assert!(refusal(&wrong).contains("`creepge` is not a key of `[thresholds]`; did you mean `creepage`?"));
    let wrong = format!("{DEFAULT_VEHICLE}\n[thresholds]\ncreepage = 8\n");
    assert!(refusal(&wrong).contains("creepage is 8; it should lie between 0 and 1"));
    let wrong = DEFAULT_VEHICLE.replacen("name", "thresholds = 3\nname", 1);
    assert!(refusal(&wrong).contains("thresholds is 3; it should be a table `[thresholds]`"));
}

#[test]
fn whether_wheelsets_are_braked_independently_is_said_with_true_or_false() {
    let with = |value: &str| DEFAULT_VEHICLE.replacen("name", &format!("independent = {value}\nname"), 1);
    let read = |text: &str| parse_vehicle("train.toml", text.as_bytes()).unwrap().vehicle.independent;
    assert_eq!([DEFAULT_VEHICLE, &with("true"), &with("false")].map(read), [false, true, false]);
    assert_eq!(
        refusal(&with("1")),
        "train.toml, line 1, column 15: independent is 1; it should be true or false"
    );
}

#[test]
fn what_is_no_text_or_too_long_is_said() {
    let error = parse_vehicle("train.toml", b"name = \"a\"\nx = \"\xff\"").unwrap_err().to_string();
    assert_eq!(error, "train.toml, line 2, column 6: no UTF-8 text; save the file as UTF-8");
    assert!(refusal(&"#".repeat(70_000)).contains("longer than 65536 bytes"));
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_with_its_place(text in any::<String>(), at in 0_usize..600, cut in 0_usize..40) {
        let base = DEFAULT_VEHICLE;
        let at = at.min(base.len());
        let end = (at + cut).min(base.len());
        for text in [text.clone(), format!("{}{text}{}", &base[..at], &base[end..])] {
            match parse_vehicle("train.toml", text.as_bytes()) {
                Ok(file) => prop_assert!(file.vehicle.check().is_ok()),
                Err(error) => prop_assert!(error.to_string().starts_with("train.toml"), "{}", error),
            }
        }
    }

    #[test]
    fn what_is_written_reads_back_as_the_same(
        name in any::<String>(),
        numbers in prop::array::uniform4(0.02_f64..0.99),
        teeth in 1_u32..=10_000,
        axle in prop::sample::select(vec![Axle::Powered, Axle::Trailing, Axle::Unbraked]),
    ) {
        let [period, traction, creepage, tolerance] = numbers;
        let mut file = parse_vehicle("train.toml", DEFAULT_VEHICLE.as_bytes()).unwrap();
        file.name = name;
        file.vehicle.period = TimeSpan::from_s(period);
        file.vehicle.max_traction = Acceleration::from_m_per_s2(traction);
        file.vehicle.thresholds.creepage = creepage;
        file.vehicle.brake_command.tolerance = tolerance;
        file.vehicle.independent = teeth % 2 == 0;
        file.vehicle.wheelsets[1].teeth = teeth;
        file.vehicle.wheelsets[1].axle = axle;
        let text = write_vehicle(&file);
        prop_assert_eq!(parse_vehicle("train.toml", text.as_bytes()).unwrap(), file, "{}", text);
    }
}
