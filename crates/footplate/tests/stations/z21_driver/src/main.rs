//! `roco_z21_driver`, a client that Footplate shares no line with, drives a train behind the virtual Z21.
//!
//! Needs FOOTPLATE, the program.

use std::io::{self, BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use roco_z21_driver::messages::LocoState;
use roco_z21_driver::{Loco, Z21Station};

const STATION: [&str; 12] = [
    "simulate",
    "layout",
    "--station",
    "udp:127.0.0.1:0",
    "--protocol",
    "z21",
    "--trains",
    "3850",
    "--steps",
    "126",
    "--seed",
    "7",
];

/// The virtual station, until it is dropped.
struct Standing(Child);

impl Drop for Standing {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The states of the locomotive that the station reported.
type States = Arc<Mutex<Vec<LocoState>>>;

/// Waits until the last state has a property; panics with its name.
async fn until(what: &str, states: &States, is_so: impl Fn(&LocoState) -> bool) {
    let began = Instant::now();
    while !states.lock().expect("states").last().is_some_and(&is_so) {
        assert!(
            began.elapsed() < Duration::from_secs(5),
            "not within 5 s: {what}: {:?}",
            states.lock().expect("states").last()
        );
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// Whether the state says this speed, in percent of 128 codes; negative is backward.
fn runs_at(percent: f64) -> impl Fn(&LocoState) -> bool {
    move |state| state.speed_percentage.is_some_and(|speed| (speed - percent).abs() < 0.01)
}

async fn drive(place: &str) -> io::Result<usize> {
    let station = Arc::new(Z21Station::new(place).await?);
    assert_eq!(station.get_serial_number().await?, 101_953);
    station.voltage_on().await?;
    let train = Loco::control(Arc::clone(&station), 3_850).await?;
    let states = States::default();
    let heard = Arc::clone(&states);
    train.subscribe_loco_state(Box::new(move |state| heard.lock().expect("states").push(state)));

    // 50 % of 128 is the code 64.
    train.drive(50.0).await?;
    until("forward at half speed", &states, runs_at(50.0)).await;
    train.set_headlights(true).await?;
    train.function_on(5).await?;
    train.function_toggle(28).await?;
    let is_on = |state: &LocoState, number: usize| state.functions.is_some_and(|functions| functions[number]);
    until("functions", &states, |state| [0, 5, 28].iter().all(|number| is_on(state, *number))).await;
    train.function_off(5).await?;
    until("F5 off, the others on", &states, |state| !is_on(state, 5) && is_on(state, 0) && is_on(state, 28))
        .await;
    train.drive(0.0).await?;
    train.drive(-25.0).await?;
    until("backward at a quarter", &states, runs_at(-25.0)).await;
    train.stop().await?;
    until("rest", &states, runs_at(0.0)).await;
    station.voltage_off().await?;
    station.logout().await?;
    Ok(Arc::clone(&states).lock().expect("states").len())
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> io::Result<()> {
    let program = std::env::var("FOOTPLATE").expect("FOOTPLATE, the program");
    let mut station = Standing(Command::new(program).args(STATION).stdout(Stdio::piped()).spawn()?);
    let mut address = String::new();
    BufReader::new(station.0.stdout.take().expect("its output")).read_line(&mut address)?;
    let place =
        address.trim().strip_prefix("z21:").expect("a link").split('?').next().unwrap_or_default().to_owned();
    let states = drive(&place).await?;
    println!("roco_z21_driver drove a train over {states} states");
    Ok(())
}
