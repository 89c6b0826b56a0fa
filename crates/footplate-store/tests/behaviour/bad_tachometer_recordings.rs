//! A tachometer recording that is wrong is refused with its place and what would be right; none makes us panic.

use proptest::prelude::{Just, Strategy, any, prop, prop_assert, prop_assert_eq, prop_oneof, proptest};

use crate::tachometer_recordings::{read_in_pieces, read_text};

fn refusal(text: &str) -> String {
    read_text(text).expect_err("it is wrong").to_string()
}

/// The refusal of one row below a header with all kinds of columns.
fn row_refusal(row: &str) -> String {
    refusal(&format!("t_s,pulses_1,pulses_2,effort,direction_1,true_speed_m_s,run_id\n{row}\n"))
}

#[test]
fn a_wrong_value_is_named_with_what_would_be_right() {
    let right = "0.05,1,2,0,1,10,a";
    for (row, says) in [
        ("x,1,2,0,1,10,a", "run.csv, line 2, column 1 (t_s): `x` should be a time in seconds, such as 12.05"),
        (",1,2,0,1,10,a", "column 1 (t_s): `` should be a time in seconds"),
        ("nan,1,2,0,1,10,a", "column 1 (t_s): `nan` should be a time"),
        ("0,inf,2,0,1,10,a", "column 2 (pulses_1): `inf` should be a whole number, or nothing"),
        ("0,1,2.5,0,1,10,a", "column 3 (pulses_2): `2.5` should be a whole number"),
        ("0,1,99999999999999999999,0,1,10,a", "column 3 (pulses_2): `99999999999999999999` should be"),
        ("0,1,2,-50,1,10,a", "column 4 (effort): `-50` should be a part of the full force from -1"),
        ("0,1,2,0,2,10,a", "column 5 (direction_1): `2` should be 1 (forward), -1 (backward) or 0"),
        ("0,1,2,0,1,-inf,a", "column 6 (true_speed_m_s): `-inf` should be a finite number of m/s"),
        ("0,1,2,0,1,fast,a", "column 6 (true_speed_m_s): `fast` should be"),
        ("0,1,2,0,1,10,", "column 7 (run_id): `` should be the name of the run"),
        ("0,1,2,0,1,10", "run.csv, line 2: 6 fields where the header names 7 columns"),
        ("0,1,2,0,1,10,a,b", "run.csv, line 2: 8 fields where the header names 7 columns"),
        ("0,1,2,0,1,10,\"a", "run.csv, line 2: a quote is opened and not closed"),
    ] {
        let message = row_refusal(row);
        assert!(message.contains(says), "{message}");
        // The same behind a thousand good rows.
        let good = format!("{right}\n").repeat(1000);
        let message = row_refusal(&format!("{good}{row}"));
        assert!(message.starts_with("run.csv, line 1002"), "{message}");
    }
}

#[test]
fn a_file_that_is_none_is_told_what_one_is() {
    assert!(refusal("").contains("the file is empty"));
    assert!(refusal("t_s,pulses_1,pulses_2\n").contains("no rows below the header"));
    assert!(refusal("t_s,pulses_1,pulses_2\n\n\n").contains("no rows below the header"));
    assert!(refusal("t_s,pulses_1,pulses_1,pulses_2\n").contains("two columns are called `pulses_1`"));
    assert_eq!(
        refusal("\u{feff}time;pulses\n1;2\n"),
        "run.csv: missing columns: t_s, pulses_1 (or counter_1), pulses_2 (or counter_2); the header names time;pulses \
         (docs/formats/tachometer-recording.md)"
    );
    let long = format!("t_s,pulses_1,pulses_2\n0,1,1\n{}", "1".repeat(300_000));
    assert!(refusal(&long).contains("line 3: the line is longer than 65536 bytes"));
    let long = format!("t_s,pulses_1,pulses_2,x\n0,1,1,{}\n", "1".repeat(70_000));
    assert!(refusal(&long).contains("line 2: the line is longer than 65536 bytes"));
}

/// A field of a row, mostly right.
fn field() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => (0_i64..100).prop_map(|count| count.to_string()),
        2 => any::<f64>().prop_map(|number| number.to_string()),
        1 => any::<i64>().prop_map(|count| count.to_string()),
        1 => Just(String::new()),
        1 => prop_oneof![Just("nan"), Just("inf"), Just("-0"), Just("1e3"), Just("\"7\""), Just(" 7 "), Just("\"")]
            .prop_map(ToOwned::to_owned),
        1 => "\\PC{0,4}",
    ]
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused_with_their_place(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut text = b"t_s,pulses_1,pulses_2\n".to_vec();
        text.extend(&bytes);
        for text in [&bytes, &text] {
            if let Err(error) = read_text(text) {
                prop_assert!(error.to_string().starts_with("run.csv"), "{}", error);
            }
        }
    }

    #[test]
    fn any_table_is_read_alike_in_any_pieces(
        rows in prop::collection::vec(prop::collection::vec(field(), 5), 1..20),
        piece in 1_usize..50,
    ) {
        let mut text = "t_s,pulses_1,counter_2,accel_m_s2,run_id\n".to_owned();
        for row in rows {
            text += &format!("{}\n", row.join(","));
        }
        let whole = read_text(&text).map_err(|error| error.to_string());
        let pieces = read_in_pieces(text.as_bytes(), piece).map_err(|error| error.to_string());
        prop_assert_eq!(whole, pieces);
    }

    #[test]
    fn quotes_and_spaces_change_nothing(
        mut rows in prop::collection::vec((0_i64..10_000_000_000, 0_i64..1000, any::<Option<f64>>()), 1..20),
    ) {
        rows.sort_by_key(|(ns, ..)| *ns);
        let mut plain = "t_s,pulses_1,pulses_2,balise_m\n".to_owned();
        let mut quoted = plain.clone();
        for (ns, count, number) in rows {
            let time = format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000);
            let number = number.filter(|number| number.is_finite()).map_or_else(String::new, |n| n.to_string());
            plain += &format!("{time},{count},,{number}\n");
            quoted += &format!("\"{time}\", {count},nan,\"{number}\" \r\n");
        }
        prop_assert_eq!(read_text(plain).unwrap().rows, read_text(quoted).unwrap().rows);
    }
}

#[test]
fn times_and_counts_that_have_changed_places_are_noticed() {
    // A second a row, and 20 pulses give or take one: what stands below t_s goes up and down.
    let rows: String = (0..30).map(|row| format!("{},{row},{}\n", 20 + row % 3, 20 + row % 2)).collect();
    assert_eq!(
        refusal(&format!("t_s,pulses_1,pulses_2\n{rows}")),
        "run.csv: `t_s` does not increase from row to row and `pulses_1` does; are the two columns swapped in the header?"
    );
    assert!(read_text(format!("pulses_2,t_s,pulses_1\n{rows}")).is_ok());
    // A clock that stands or jumps once is left to the odometer.
    let rows: String =
        (0..30).map(|row| format!("{},{row},1\n", if row < 20 { 5 } else { row - 20 })).collect();
    assert!(read_text(format!("t_s,counter_1,pulses_2\n{rows}")).is_ok());
}
