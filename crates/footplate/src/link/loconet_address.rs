//! What a person writes to name a LocoNet server: `loconet:192.168.0.20` or `loconet:HOST:PORT`, with
//! `[?first-sensor=17&first-turnout=5&straight=thrown&sensor-delay=60&speed=20]`.

use footplate_core::{Ratio, TimeSpan};
use footplate_sim::LocoNetSwitches;
use footplate_wire::loconet::Settings;

use super::parameters::number;
use super::place::{Place, host_and_port};

const SCHEME: &str = "loconet:";
/// The port at which servers listen (LbServer).
const PORT: u16 = 1234;
/// The shortest and the longest delay of a sensor that can be meant as its longest, in ms.
const SHORTEST_DELAY_MS: u16 = 3;
const LONGEST_DELAY_MS: u16 = 2_000;

/// Returns a server at a place in the network.
///
/// # Errors
/// When no place is named.
pub(super) fn read(place: &str) -> Result<(Place, Settings), String> {
    let named = place.strip_prefix("tcp://").unwrap_or(place);
    let (host, port) = host_and_port(named, PORT).ok_or_else(|| {
            format!(
                "`{SCHEME}{place}` names no server: write {SCHEME}192.168.0.20 or {SCHEME}HOST:{PORT}, where a LocoNet-over-TCP \
                 server (LbServer, JMRI, Rocrail, a gateway) runs"
            )
        })?;
    Ok((Place::Tcp { host, port }, Settings::default()))
}

pub(super) fn set(settings: &mut Settings, key: &str, value: &str) -> Result<(), String> {
    match key {
        "first-sensor" => settings.first_sensor = number(key, value, "17")?,
        "first-turnout" => settings.first_turnout = number(key, value, "5")?,
        "straight" => settings.closed_is_straight = is_closed_straight(value)?,
        "sensor-delay" => settings.sensor_delay = sensor_delay(key, value)?,
        _ => {
            return Err(format!(
                "a LocoNet link has no `{key}`; it has first-sensor, first-turnout, straight, sensor-delay and speed"
            ));
        }
    }
    Ok(())
}

/// Whether a closed turnout lies straight.
pub(super) fn is_closed_straight(value: &str) -> Result<bool, String> {
    match value {
        "closed" => Ok(true),
        "thrown" => Ok(false),
        _ => Err(format!("`{value}` is no state of a turnout: use straight=closed or straight=thrown")),
    }
}

/// The longest delay of a sensor, in ms.
pub(super) fn sensor_delay(key: &str, value: &str) -> Result<TimeSpan, String> {
    let ms: u16 = number(key, value, "60")?;
    if !(SHORTEST_DELAY_MS..=LONGEST_DELAY_MS).contains(&ms) {
        return Err(format!("{key} {ms} is not between {SHORTEST_DELAY_MS} and {LONGEST_DELAY_MS} ms"));
    }
    Ok(TimeSpan::from_ms(ms.into()))
}

/// How often the bus refuses a message of a simulated server that is bad: one in twenty.
const BAD: Ratio = Ratio::from_percent(5.0);

/// The quirks of a simulated LocoNet server, as they are listed for people.
pub(super) const QUIRKS: &str = "refused (messages do not come to the bus), no-echo (a client's messages are not repeated), no-version \
                                 (the server does not say what it is), one-slot (the station drives one locomotive), merged and split";

/// Sets a quirk of a simulated server; returns whether there is one of that name that only it has.
pub(super) fn set_quirk(switches: &mut LocoNetSwitches, name: &str) -> bool {
    match name {
        "refused" => switches.refused = BAD,
        "no-echo" => switches.echoes = false,
        "no-version" => switches.has_version = false,
        "one-slot" => switches.slots = 1,
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::address::Address;
    use super::super::station_address::StationSettings;
    use super::*;

    #[test]
    fn a_server_is_named_by_its_place_in_the_network() {
        for (text, place) in [
            ("loconet:192.168.0.20", ("192.168.0.20", 1234)),
            ("loconet:localhost:5550", ("localhost", 5550)),
            ("loconet:tcp://[::1]:5550", ("::1", 5550)),
        ] {
            let Ok(Address::Station(server)) = text.parse() else { panic!("{text}") };
            assert_eq!(server.cable.place, Place::Tcp { host: place.0.to_owned(), port: place.1 });
        }
        let written = "loconet:host?first-sensor=17&first-turnout=5&straight=thrown&sensor-delay=60&speed=20";
        let Ok(Address::Station(server)) = written.parse() else { panic!("a server") };
        let expected = Settings {
            first_sensor: 17,
            first_turnout: 5,
            closed_is_straight: false,
            sensor_delay: TimeSpan::from_ms(60),
        };
        assert_eq!(server.settings, StationSettings::LocoNet(expected));
        assert_eq!(server.cable.speed(), 20.0);
    }
}
