//! Trains and lines of four forms are read as what they say, and written so that nothing is lost.

use std::path::{Path, PathBuf};

use footplate_core::{Acceleration, Length, Speed, TimeSpan};
use footplate_sim::line::{Journey, LineProfile, Style, TractiveEffort, Train};
use footplate_store::{
    Described, LineFileForm, TrainFileForm, parse_line, parse_train, read_described, read_line, read_train,
    write_line, write_train,
};

fn testdata(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(path)
}

fn train(name: &str) -> Train {
    read_train(&testdata(&format!("trains/{name}")), None).unwrap().train
}

fn line(name: &str) -> LineProfile {
    read_line(&testdata(&format!("lines/{name}")), None).unwrap().line
}

fn files(folder: &str) -> Vec<PathBuf> {
    let all = std::fs::read_dir(testdata(folder)).unwrap().map(|entry| entry.unwrap().path());
    let is_form = |path: &PathBuf| path.extension().is_some_and(|end| end == "json" || end == "yaml");
    let mut files: Vec<PathBuf> = all.filter(is_form).collect();
    files.sort();
    files
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, not {expected}");
}

#[test]
fn a_formation_is_loaded_and_put_together_as_its_program_does() {
    let freight = train("trainruns_freight.yaml");
    assert_eq!(freight.name, "V 90 with 10 ore wagons of type Facs 124");
    // 80 t and ten cars of 25 t with 59 t each; 14.32 m and ten times 19.04 m; 1.09 and 1.03 over empty masses.
    near(freight.mass_kg, 920e3);
    near(freight.length.as_m(), 204.72);
    near(freight.rotating_mass.as_parts(), (0.09 * 80.0 + 0.03 * 250.0) / 330.0);
    near(freight.max_speed.as_m_per_s(), 80.0 / 3.6);
    near(freight.brake.service.as_m_per_s2(), 0.225);
    // The sum of the two figures that the program's documentation gives for 15 m/s.
    near(freight.resistance.at(Speed::from_m_per_s(15.0)), 5_461.127_252 + 20_900.732_702_64);
    near(freight.tractive_effort.at(Speed::from_m_per_s(40.5 / 3.6)), 0.5 * (55_830.0 + 54_300.0));

    let local = train("trainruns_local.yaml");
    near(local.mass_kg, 88e3);
    near(local.brake.service.as_m_per_s2(), 0.4253);
    // At rest: 45.333 t of driving axles at 3.0, 22.667 t of others at 1.4, 68 t at 3.9 in a wind of 15 km/h.
    let per_mille_t = 45.333 * 3.0 + 22.667 * 1.4 + 68.0 * 3.9 * 0.0225;
    near(local.resistance.at(Speed::ZERO), 9.806_65 * per_mille_t);
}

#[test]
fn quantities_of_ttobench_keep_their_units() {
    let flirt = train("ttobench_CH_Stadler_FLIRT_TPF.json");
    assert_eq!(flirt.tractive_effort, TractiveEffort::ForceAndPower { force_n: 200e3, power_w: 2.6e6 });
    near(flirt.inertia_kg(), 134_200.0);
    // 2.37888 + 0.01698165 · 100 + 0.00093264 · 100² kN at 100 km/h.
    near(flirt.resistance.at(Speed::from_m_per_s(100.0 / 3.6)), 13_403.445);
    assert_eq!(flirt.max_acceleration, Some(Acceleration::from_m_per_s2(1.1)));
    near(flirt.brake.service.as_m_per_s2(), 1.1);
    // 260 kN are all that brakes the metro's 278 t.
    let metro = train("ttobench_CN_Beijing_Subway.json");
    near(metro.brake.service.as_m_per_s2(), 260.0 / 278.0);
    near(metro.brake.full_n, 260e3);
}

#[test]
fn lines_of_ttobench_and_railtoolkit_keep_their_places() {
    let bern = line("ttobench_CH_Fribourg_Bern.json");
    assert_eq!(bern.stops().len(), 2);
    assert_eq!(bern.stops()[1].at, Length::from_m(31_240.7));
    near(bern.speed_limit().at(Length::from_m(500.0)), 110.0 / 3.6);
    assert_eq!(bern.gradient().at(Length::from_m(300.0)), -16.9);
    assert_eq!(line("ttobench_CN_Songjiazhuang_Yizhuang.json").stops().len(), 14);

    let slope = line("trainruns_slope.yaml");
    assert_eq!(slope.gradient().at(Length::from_m(8_700.0)), 20.0);
    assert_eq!(slope.stops()[1].at, Length::from_m(10_000.0));
}

#[test]
fn every_train_and_line_at_hand_is_written_and_read_again() {
    for path in files("trains") {
        let file = read_train(&path, None).unwrap();
        let text = write_train(&file.train, &file.about);
        let again = parse_train("train.toml", text.as_bytes(), None).unwrap();
        assert_eq!(again.train, file.train, "{}", path.display());
        assert_eq!((again.form, &again.about), (TrainFileForm::Own, &file.about));
        assert_eq!(write_train(&again.train, &again.about), text);
    }
    for path in files("lines") {
        let file = read_line(&path, None).unwrap();
        let text = write_line(&file.line, &file.about);
        let again = parse_line("line.toml", text.as_bytes(), None).unwrap();
        assert_eq!(again.line, file.line, "{}", path.display());
        assert_eq!((again.form, &again.about), (LineFileForm::Own, &file.about));
    }
    assert_eq!(files("trains").len() + files("lines").len(), 12);
}

#[test]
fn every_train_runs_every_line_that_it_can_climb() {
    let step = TimeSpan::from_ms(50);
    let mut stalled: Vec<(String, String, String)> = Vec::new();
    for (train_path, line_path) in files("trains")
        .iter()
        .flat_map(|train| files("lines").into_iter().map(move |line| (train.clone(), line)))
    {
        let train = read_train(&train_path, None).unwrap().train;
        let line = read_line(&line_path, None).unwrap().line;
        let of = format!("{} on {}", train_path.display(), line_path.display());
        let run = match Journey::run(&train, &line, Style::FASTEST, step) {
            Ok(run) => run,
            Err(error) => {
                stalled.push((train.name, line.name().to_owned(), error.to_string()));
                continue;
            }
        };
        assert_eq!(run.calls.len(), line.stops().len(), "{of}");
        for call in &run.calls {
            assert!(call.beyond.abs() < Length::from_m(0.5), "{of}: {call:?}");
        }
        let work = run.work;
        let lost = work.traction_j - work.brake_j - work.resistance_j - work.line_j;
        assert!(lost.abs() < 1e-9 * work.traction_j, "{of}: {lost} J");
    }
    // 920 t of ore are too heavy for the 24 per mille of a metro: 217 kN and the resistance, and 187 kN to pull.
    let names: Vec<_> = stalled.iter().map(|(train, line, _)| (train.as_str(), line.as_str())).collect();
    let ore = "V 90 with 10 ore wagons of type Facs 124";
    assert_eq!(names, [(ore, "CN_Songjiazhuang_Yizhuang")]);
    assert!(stalled[0].2.starts_with("the train stalls at 18675 m: it pulls 186940 N"), "{}", stalled[0].2);
}

#[test]
fn the_examples_in_the_documentation_are_what_they_say() {
    let example = |page: &str| {
        let text = std::fs::read_to_string(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats").join(page),
        );
        let text = text.unwrap();
        let begin = text.find("```toml\n").unwrap() + "```toml\n".len();
        text[begin..].split("```").next().unwrap().to_owned()
    };
    let train = parse_train("train.toml", example("train.md").as_bytes(), None).unwrap().train;
    // Per mille of 120 t at rest, in a wind of 15 km/h; and half as much again braked as planned.
    near(train.resistance.at(Speed::ZERO), 120.0 * 9.806_65 * (2.0 + 3.0 * 0.0225));
    near(train.brake.full_n, 1.5 * 0.7 * 120e3 * 1.08);
    let line = parse_line("line.toml", example("line.md").as_bytes(), None).unwrap().line;
    assert!(Journey::run(&train, &line, Style::FASTEST, TimeSpan::from_ms(50)).is_ok());
}

#[test]
fn rolling_stock_of_osrd_is_read_where_it_lies() {
    let Some(data) = std::env::var_os("FOOTPLATE_DATA") else {
        eprintln!("LEFT OUT: FOOTPLATE_DATA names no folder with the rolling stock of OSRD");
        return;
    };
    let folder = PathBuf::from(data).join("osrd-rolling-stock");
    let read = |name: &str| read_described(&folder.join(name), None).unwrap();
    let (Described::Train(fast), Described::Train(electric)) =
        (read("fast_rolling_stock.json"), read("electric_rolling_stock.json"))
    else {
        panic!("both are trains")
    };
    assert_eq!((fast.form, fast.train.name.as_str()), (TrainFileForm::Osrd, "fast_rolling_stock"));
    near(fast.train.inertia_kg(), 945e3);
    // 5400 + 200 · 10 + 12 · 100 N at 10 m/s; the curve has 435714 N there.
    near(fast.train.resistance.at(Speed::from_m_per_s(10.0)), 8600.0);
    near(fast.train.tractive_effort.at(Speed::from_m_per_s(10.0)), 435_714.285_714_285_74);
    near(fast.train.brake.service.as_m_per_s2(), 0.5);
    assert_eq!(fast.train.max_acceleration, Some(Acceleration::from_m_per_s2(0.25)));
    // The default mode is 25000V, whose default curve begins at 500 kN.
    near(electric.train.tractive_effort.at(Speed::ZERO), 500e3);
    let run =
        Journey::run(&electric.train, &line("trainruns_slope.yaml"), Style::FASTEST, TimeSpan::from_ms(50));
    assert!(run.is_ok());
}
