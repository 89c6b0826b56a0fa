//! Speeds that decoders report by RailCom over a Z21: what they give where sensors are far apart, and when a train stalls.

use footplate_core::control::{Alarm, Driver, LinkNews, Machine, Notice, Order, Output, StopOrder, Watchdog};
use footplate_core::track::{Landmark, Layout, TurnoutStates};
use footplate_core::{DecoderSteps, Length, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_eval::testbed::{Calibrated, VirtualLine, calibrate};
use footplate_sim::{LivingLayout, LivingSwitches, SpeedReports, VirtualStation, VirtualZ21, Z21Switches};
use footplate_store::parse_layout;
use footplate_wire::z21::{Client, Settings};
use footplate_wire::{Session as _, Transmit};

const TRAIN: TrainId = TrainId(24);
/// The length of either layout.
const LAP_MM: f64 = 8_000.0;
/// How long (s) a train runs at each step: about two laps.
const RUN: f64 = 45.0;
/// The steps it runs at, from rest.
const STEPS: [u8; 9] = [8, 11, 6, 9, 12, 7, 8, 11, 6];

/// An oval of stretches of these lengths (mm) between sensors.
fn oval(lengths: &[u16]) -> Layout {
    let count = lengths.len();
    let sensor = |nth: usize| {
        format!("{{ names = [\"S{nth}\", \"R{nth}\"], numbers = [{}, {}] }}", 2 * nth, 2 * nth + 1)
    };
    let sensors: Vec<String> = (0..count).map(sensor).collect();
    let edge = |(nth, mm): (usize, &u16)| {
        format!("{{ from = \"S{nth}\", to = \"S{}\", mm = {mm} }}", (nth + 1) % count)
    };
    let edges: Vec<String> = lengths.iter().enumerate().map(edge).collect();
    let text = format!(
        "format = 1\nname = \"oval\"\nlength_uncertainty_mm = 3\nlength_origin = \"made up\"\nsensors = [{}]\nedges = [{}]",
        sensors.join(", "),
        edges.join(", ")
    );
    parse_layout("oval.toml", text.as_bytes()).unwrap().layout
}

/// One with three sensors and 6 m without any.
fn far() -> Layout {
    oval(&[800, 1200, 6000])
}

/// A train that was calibrated there, a pause later.
fn calibrated(layout: &Layout, seed: u64) -> (LivingLayout<'_>, Calibrated) {
    let station = VirtualStation::draw(layout, seed, &[TRAIN], &LivingSwitches::faultless()).unwrap();
    let mut line = VirtualLine::open(station).unwrap();
    let found = calibrate(layout, &mut line, TRAIN, TimeSpan::from_s(480.0));
    let mut world = line.station.world.clone();
    world.begin_session(TimeSpan::from_s(3600.0));
    (world, found)
}

/// A watchdog that drives the train over a Z21.
struct Line<'l> {
    station: VirtualZ21<'l>,
    client: Client,
    watchdog: Watchdog,
    /// Whether it gets to know what decoders report.
    hears_speeds: bool,
    notices: Vec<(Timestamp, Notice)>,
}

impl<'l> Line<'l> {
    fn open(
        world: &LivingLayout<'l>,
        found: &Calibrated,
        seed: u64,
        speeds: SpeedReports,
        hears_speeds: bool,
    ) -> Self {
        let switches = Z21Switches { speeds, ..Z21Switches::default() };
        let station = VirtualZ21::new(world.clone(), seed, switches);
        let now = station.now();
        let mut client = Client::new(now, Settings { steps: DecoderSteps::Fourteen, ..Settings::default() });
        client.set_decoder(TRAIN, DecoderSteps::Fourteen).unwrap();
        let mut driver = Driver::new(world.layout().clone(), TurnoutStates::unknown());
        driver.add_located(found.model.clone(), found.locator.clone());
        let watchdog = Watchdog::new(driver, now);
        let mut line = Self { station, client, watchdog, hears_speeds, notices: Vec::new() };
        line.run(2.0, |_| {});
        line
    }

    fn run(&mut self, seconds: f64, mut look: impl FnMut(&Self)) {
        let end = self.station.now() + TimeSpan::from_s(seconds);
        let mut looks = self.station.now();
        while self.station.now() < end {
            self.settle();
            let now = self.station.now();
            if now >= looks {
                looks = now + TimeSpan::from_ms(100);
                look(self);
            }
            let timeouts = [self.watchdog.next_timeout(), self.client.next_timeout(), Some(looks)];
            let wake = timeouts.into_iter().flatten().fold(end, Timestamp::min).max(now);
            match self.station.advance(wake) {
                Some((_, datagram)) => self.client.handle_bytes(self.station.now(), &datagram),
                None => {
                    let now = self.station.now();
                    self.client.handle_timeout(now);
                    if self.watchdog.next_timeout().is_some_and(|due| due <= now) {
                        self.watchdog.handle_timeout(now);
                    }
                }
            }
        }
    }

    fn settle(&mut self) {
        let now = self.station.now();
        loop {
            while let Some(output) = self.client.poll_output() {
                match output {
                    Transmit::Message(bytes) => self.station.write(0, &bytes),
                    Transmit::Event(event) => self.watchdog.handle_event(now, &event),
                    Transmit::ReportedSpeed(train, number) if self.hears_speeds => {
                        self.watchdog.handle_link(now, LinkNews::ReportedSpeed { train, number });
                    }
                    _ => {}
                }
            }
            match self.watchdog.poll_output() {
                Some(Output::Command(command)) => self.client.handle_command(now, command).unwrap(),
                Some(Output::Notice(notice)) => self.notices.push((now, notice)),
                Some(Output::HoldLine(_) | Output::Watch(_)) => {}
                None => return,
            }
        }
    }

    fn go(&mut self, number: u8) {
        let order = Order::Speed { train: TRAIN, step: SpeedStep::new(number).unwrap() };
        self.watchdog.order(self.station.now(), order).unwrap();
    }

    /// By how much (mm) the estimated place is wrong, and one standard deviation that the estimate has.
    fn error(&self) -> Option<[f64; 2]> {
        let driver = self.watchdog.driver();
        let located = driver.locate(TRAIN, self.station.now())?;
        let said = driver.landmark(TRAIN, located.at)?;
        let past = self.station.world.truth().past(TRAIN, driver.layout().sensor_at(said.node)?)?;
        let error = (said.offset - past).as_mm();
        // Distances are known up to whole laps.
        Some([error - LAP_MM * (error / LAP_MM).round(), located.uncertainty.as_mm()])
    }

    fn alarm(&self, alarm: Alarm) -> Option<Timestamp> {
        self.notices.iter().find_map(|(at, notice)| {
            matches!(notice, Notice::Danger { why, .. } if *why == alarm).then_some(*at)
        })
    }
}

/// A part of some numbers is at most the result.
fn percentile(numbers: &mut [f64], part: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[(part * (numbers.len() - 1) as f64) as usize]
}

/// Errors (mm, without their signs) of the estimated place ten times a second, and how many are within the 95 % interval.
#[derive(Debug, Default)]
struct Places {
    errors: Vec<f64>,
    covered: usize,
}

impl Places {
    fn take(&mut self, line: &mut Line<'_>) {
        for step in STEPS {
            line.go(step);
            line.run(RUN, |line| {
                if let Some([error, deviation]) = line.error() {
                    self.errors.push(error.abs());
                    self.covered += usize::from(error.abs() <= 1.96 * deviation);
                }
            });
            line.go(0);
            line.run(8.0, |_| {});
        }
    }

    /// The 50, 90, 95 and 99 % percentiles, and the share that is within the interval.
    fn figures(&mut self, name: &str) -> [f64; 5] {
        let covered = self.covered as f64 / self.errors.len() as f64;
        let [half, most, nearly, all] = [0.5, 0.9, 0.95, 0.99].map(|part| percentile(&mut self.errors, part));
        println!(
            "{name}: 50 % {half:.1}, 90 % {most:.1}, 95 % {nearly:.1}, 99 % {all:.1} mm; {:.1} % within 95 % intervals",
            100.0 * covered
        );
        [half, most, nearly, all, covered]
    }
}

#[test]
fn reports_locate_trains_better_far_from_sensors_and_nonsense_changes_nothing() {
    let layout = far();
    let [mut without, mut with, mut nonsense] = [(); 3].map(|()| Places::default());
    let mut ignored = 0;
    for seed in 1..=40 {
        let (world, found) = calibrated(&layout, seed);
        let kinds =
            [(SpeedReports::Speed, false), (SpeedReports::Speed, true), (SpeedReports::Nonsense, true)];
        for (places, (speeds, hears)) in [&mut without, &mut with, &mut nonsense].into_iter().zip(kinds) {
            let mut line = Line::open(&world, &found, seed, speeds, hears);
            places.take(&mut line);
            assert!(
                !line.notices.iter().any(|(_, notice)| matches!(notice, Notice::Danger { .. })),
                "seed {seed}"
            );
            let said = |(_, notice): &&(_, Notice)| matches!(notice, Notice::SpeedReportsIgnored { .. });
            let said = line.notices.iter().filter(said).count();
            assert!(said <= usize::from(speeds == SpeedReports::Nonsense), "seed {seed}: {said}");
            ignored += said;
        }
    }
    println!("nonsense found out {ignored} times of 40");
    let [without, with] = [without.figures("without"), with.figures("with")];
    assert_eq!(nonsense.figures("nonsense"), without);
    assert!(ignored >= 38, "{ignored}");
    assert!(with[1] < 0.95 * without[1] && with[3] < 1.02 * without[3], "{with:?}, {without:?}");
    assert!(with[4] > 0.95, "{with:?}");
}

#[test]
fn reports_make_stops_among_many_sensors_no_worse() {
    let layout = oval(&[700, 900, 800, 800, 600, 1000, 850, 750, 800, 800]);
    let [mut without, mut with] = [(); 2].map(|()| Vec::new());
    for seed in 1..=16 {
        let (world, found) = calibrated(&layout, seed);
        for (errors, hears) in [(&mut without, false), (&mut with, true)] {
            let mut line = Line::open(&world, &found, seed, SpeedReports::Speed, hears);
            for step in STEPS {
                line.go(step);
                line.run(12.0, |_| {});
                let Some(located) = line.watchdog.driver().locate(TRAIN, line.station.now()) else {
                    continue;
                };
                let landmark = Landmark { node: located.at.node, offset: Length::from_mm(300.0) };
                let stop = StopOrder::at(TRAIN, landmark);
                let now = line.station.now();
                if line.watchdog.order(now, Order::Stop(stop)).is_err() {
                    line.watchdog.order(now, Order::Stop(StopOrder { next_round: true, ..stop })).unwrap();
                }
                line.run(90.0, |_| {});
                let is_at_rest = line.watchdog.driver().is_at_rest(TRAIN, line.station.now());
                assert!(is_at_rest, "seed {seed}: {:?}", line.notices.last());
                let sensor = layout.sensor_at(landmark.node).unwrap();
                let past = line.station.world.truth().past(TRAIN, sensor).unwrap();
                let error = (past - landmark.offset).as_mm();
                errors.push((error - LAP_MM * (error / LAP_MM).round()).abs());
            }
        }
    }
    for (name, errors) in [("without", &mut without), ("with", &mut with)] {
        let [half, nearly] = [0.5, 0.95].map(|part| percentile(errors, part));
        println!("{name}: {} stops, 50 % {half:.2}, 95 % {nearly:.2} mm", errors.len());
    }
    for part in [0.5, 0.95] {
        assert!(percentile(&mut with, part) <= 1.05 * percentile(&mut without, part));
    }
}

#[test]
fn a_train_that_stalls_between_sensors_is_reported_within_seconds() {
    let layout = far();
    let [mut without, mut with] = [(); 2].map(|()| Vec::new());
    for seed in 1..=20 {
        let (world, found) = calibrated(&layout, seed);
        for (times, hears) in [(&mut without, false), (&mut with, true)] {
            let mut line = Line::open(&world, &found, seed, SpeedReports::Speed, hears);
            for step in [8, 11, 8] {
                line.go(step);
                line.run(RUN, |_| {});
            }
            let stalled = line.station.now();
            line.station.world.dirty_wheels(TRAIN, 0.0);
            line.run(90.0, |_| {});
            let alarm = line.alarm(Alarm::Stalled).or(line.alarm(Alarm::Lost)).unwrap();
            times.push((alarm - stalled).as_s());
        }
    }
    let [without, with] =
        [without, with].map(|mut times| [0.0, 0.5, 1.0].map(|part| percentile(&mut times, part)));
    println!("shortest, median and longest time to the alarm: {without:.1?} s without, {with:.1?} s with");
    assert!(with[1] < 3.5 && with[2] < without[2] && without[1] > 10.0);
}
