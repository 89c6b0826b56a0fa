//! What a person writes to name a Central Station or a track box on Märklin's CAN bus: `marklin-can:192.168.0.5` over UDP,
//! `marklin-can:tcp://192.168.0.5:15731`, `marklin-can:/dev/ttyACM0` through a serial CAN adapter, with
//! `[?locos=dcc&turnouts=dcc&first-contact=17&device=0&modules=5&scan=20&receive=15730&speed=20]`.

use footplate_core::{Ratio, TimeSpan};
use footplate_sim::CanSwitches;
use footplate_wire::marklin_can::{AccessoryProtocol, LocomotiveProtocol, Settings, Transport, Uid};

use super::datagrams::Correspondent;
use super::parameters::number;
use super::place::{Place, host_and_port};
use super::stream::SerialFormat;

const SCHEME: &str = "marklin-can:";
/// The port at which stations listen, for datagrams and for connections.
const PORT: u16 = 15_731;
/// The port to which they send datagrams.
const RECEIVE: u16 = 15_730;
/// The cycles of inputs that can be set on a station, in ms.
const SCANS_MS: std::ops::RangeInclusive<u16> = 10..=1000;

/// The speed of a serial CAN adapter. One on USB runs as fast as it can, whatever is set.
const ADAPTER_BAUD: u32 = 115_200;

/// Returns a station at a place.
///
/// # Errors
/// When no place is named.
pub(super) fn read(place: &str) -> Result<(Place, Settings), String> {
    let wanted = || {
        format!(
            "`{SCHEME}{place}` names no station: write {SCHEME}192.168.0.5, {SCHEME}tcp://HOST:{PORT}, or {SCHEME}/dev/ttyACM0 for \
                 a CAN adapter"
        )
    };
    let is_device = place.starts_with(['/', '\\']) || place.starts_with("COM");
    let place = if place.is_empty() {
        return Err(wanted());
    } else if is_device || place.starts_with("tcp://") {
        Place::named(SCHEME, place, "/dev/ttyACM0", PORT, SerialFormat::of_baud(ADAPTER_BAUD))?
    } else {
        let named = place.strip_prefix("udp://").unwrap_or(place);
        let (host, port) = host_and_port(named, PORT).ok_or_else(wanted)?;
        Place::Datagrams(Correspondent { host, port, receive_at: Some(RECEIVE) })
    };
    let transport = match &place {
        Place::Device(..) => Transport::Adapter,
        _ => Transport::Network,
    };
    // Each process has its own number, to recognise its own frames.
    let uid = Uid(Settings::default().uid.0 & 0xFFFF_0000 | std::process::id() & 0xFFFF);
    let settings = Settings { transport, uid, ..Settings::default() };
    Ok((place, settings))
}

/// Changes a setting of a station other than the number of its modules.
pub(super) fn set(settings: &mut Settings, place: &mut Place, key: &str, value: &str) -> Result<(), String> {
    match (key, value) {
        ("locos", _) => settings.locomotives = locomotives_named(value)?,
        ("turnouts", "mm") => settings.turnouts = AccessoryProtocol::Motorola,
        ("turnouts", "dcc") => settings.turnouts = AccessoryProtocol::Dcc,
        ("turnouts", _) => {
            return Err(format!("`{value}` is no protocol of turnouts: use turnouts=mm or turnouts=dcc"));
        }
        ("first-contact", _) => settings.first_input = number(key, value, "17")?,
        ("device", _) => settings.device = Some(number(key, value, "0")?),
        ("scan", _) => {
            let ms: u16 = number(key, value, "20")?;
            if !SCANS_MS.contains(&ms) {
                return Err(format!(
                    "scan {ms} is not between {} and {} ms, as a station's cycle is",
                    SCANS_MS.start(),
                    SCANS_MS.end()
                ));
            }
            settings.scan = TimeSpan::from_ms(ms.into());
        }
        ("receive", _) => match place {
            Place::Datagrams(station) => station.receive_at = Some(number(key, value, "15730")?),
            _ => {
                return Err(format!("`receive` is for datagrams: write {SCHEME}HOST?receive={value}"));
            }
        },
        _ => {
            return Err(format!(
                "a Märklin CAN link has no `{key}`; it has locos, turnouts, first-contact, device, modules, scan, receive and \
                     speed"
            ));
        }
    }
    Ok(())
}

fn locomotives_named(value: &str) -> Result<LocomotiveProtocol, String> {
    match value {
        "mm" => Ok(LocomotiveProtocol::Motorola),
        "mfx" => Ok(LocomotiveProtocol::Mfx),
        "dcc" => Ok(LocomotiveProtocol::Dcc),
        _ => Err(format!("`{value}` is no protocol of locomotives: use locos=mm, locos=mfx or locos=dcc")),
    }
}

/// How often a datagram is lost, comes twice or is overtaken in a simulated network that is bad: one in fifty.
const BAD: Ratio = Ratio::from_percent(2.0);
/// The cycle of a station whose owner has set the shortest.
const FAST_SCAN: TimeSpan = TimeSpan::from_ms(10);

/// The quirks of a simulated Central Station, as they are listed for people.
pub(super) const QUIRKS: &str = "lossy, twice and overtaken (datagrams), split (frames arrive in parts), mute (nothing is confirmed), \
                                 no-times (reports do not say how long the state before lasted), no-polls and no-list (it does not \
                                 answer for its modules or locomotives), fast-scan (contacts are read every 10 ms), mm and dcc \
                                 (decoders in the place of mfx)";

/// Sets a quirk of a simulated Central Station; returns whether there is one of that name.
pub(super) fn set_quirk(switches: &mut CanSwitches, name: &str) -> bool {
    match name {
        "lossy" => switches.lost = BAD,
        "twice" => switches.duplicated = BAD,
        "overtaken" => switches.overtaken = BAD,
        "split" => switches.is_split = true,
        "mute" => switches.is_mute = true,
        "no-times" => switches.has_times = false,
        "no-polls" => switches.answers_polls = false,
        "no-list" => switches.has_list = false,
        "fast-scan" => switches.scan = FAST_SCAN,
        "mm" => switches.locomotives = LocomotiveProtocol::Motorola,
        "dcc" => switches.locomotives = LocomotiveProtocol::Dcc,
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::address::Address;
    use super::super::station_address::{StationAddress, StationSettings};
    use super::*;

    #[test]
    fn a_station_is_named_by_its_place() {
        let datagrams = |host: &str, port, receive_at| {
            Place::Datagrams(Correspondent { host: host.into(), port, receive_at: Some(receive_at) })
        };
        let can = |text: &str| match text.parse() {
            Ok(Address::Station(StationAddress {
                cable,
                settings: StationSettings::Can { settings, modules },
            })) => (cable.place, settings, modules),
            other => panic!("{text}: {other:?}"),
        };
        let places = [
            ("marklin-can:192.168.0.5", datagrams("192.168.0.5", 15_731, 15_730)),
            ("marklin-can:cs3.home?receive=0", datagrams("cs3.home", 15_731, 0)),
            ("marklin-can:udp://127.0.0.1:3000", datagrams("127.0.0.1", 3_000, 15_730)),
            ("marklin-can:tcp://cs3:15731", Place::Tcp { host: "cs3".into(), port: 15_731 }),
            (
                "marklin-can:/dev/ttyACM0",
                Place::Device("/dev/ttyACM0".into(), SerialFormat::of_baud(ADAPTER_BAUD)),
            ),
        ];
        for (text, place) in places {
            let (there, settings, _) = can(text);
            assert_eq!(
                (settings.transport == Transport::Adapter, there),
                (text.contains("/dev/"), place),
                "{text}"
            );
        }
        let written = "marklin-can:cs3?locos=dcc&turnouts=dcc&first-contact=17&device=2&modules=3&scan=20";
        let (_, settings, modules) = can(written);
        let expected = Settings {
            uid: settings.uid,
            locomotives: LocomotiveProtocol::Dcc,
            turnouts: AccessoryProtocol::Dcc,
            first_input: 17,
            device: Some(2),
            scan: TimeSpan::from_ms(20),
            ..Settings::default()
        };
        assert_eq!((settings, modules), (expected, Some(3)));
    }
}
