//! What a person writes to say which station is meant.
//!
//! `sim:LAYOUT[?seed=7&trains=24,58&steps=126&speed=20&law=…&faults=…&world=…]` is a simulated one in this process,
//! `marklin-serial:DEVICE` or `marklin-serial:tcp://HOST:PORT` a 6050 or 6051 behind a cable, with
//! `[?pace=careful&cts=no&modules=5&speed=20]`, `dcc-ex:DEVICE` or `dcc-ex:tcp://HOST:PORT` a DCC-EX board, `z21:HOST` a Z21, `marklin-can:HOST` a
//! Central Station, `loconet:HOST` a LocoNet server, `jmri:HOST` JMRI.

use std::collections::BTreeMap;
use std::str::FromStr;

use footplate_core::{DecoderSteps, Ratio, TrainId};
use footplate_sim::{
    BoardSwitches, CanSwitches, Delivery, JmriSwitches, LawFamily, LocoNetSwitches, PhysicsRange, Z21Switches,
};

use super::cable::Cable;
use super::named_train::{NamedTrain, decoder_of, trains};
use super::parameters::{number, pair, times};
use super::station_address::StationAddress;
use super::station_kind::StationKind;
use super::z21_address::{QUIRKS, set_quirk};
use super::{can_address, jmri_address, loconet_address};

/// The trains of the course's track that its reports are about.
const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(58)];

/// Which station is meant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Address {
    /// A simulated station in this process.
    Simulated(SimulatedAddress),
    /// A station outside this process.
    Station(StationAddress),
}

impl Address {
    /// Returns the simulated world, if the station is simulated.
    pub(crate) const fn simulated(&self) -> Option<&SimulatedAddress> {
        match self {
            Self::Simulated(simulated) => Some(simulated),
            Self::Station(_) => None,
        }
    }

    /// Which station it is.
    pub(crate) const fn kind(&self) -> StationKind {
        match self {
            Self::Simulated(simulated) => simulated.station,
            Self::Station(station) => station.kind(),
        }
    }

    /// The trains that a person named, and those of a simulated layout, with the steps of their decoders where they were said.
    ///
    /// # Errors
    /// What the station does not have, for people.
    pub(crate) fn decoders(
        &self,
        named: &[NamedTrain],
    ) -> Result<BTreeMap<TrainId, Option<DecoderSteps>>, String> {
        let simulated = self.simulated().into_iter();
        let simulated =
            simulated.flat_map(|world| world.trains.iter().map(|train| (*train, Some(world.decoder))));
        let mut decoders: BTreeMap<_, _> = named.iter().map(|one| (one.train, one.decoder)).collect();
        for (train, there) in simulated {
            let said = decoders.entry(train).or_insert(there);
            if said.is_some() && *said != there {
                let there = there.unwrap_or(DecoderSteps::Fourteen);
                return Err(format!(
                    "train {train} has {there} speed steps on this simulated layout: add `steps=` to the link"
                ));
            }
            *said = there;
        }
        for (train, decoder) in &decoders {
            self.kind().check(*train, decoder.unwrap_or(DecoderSteps::Fourteen))?;
        }
        Ok(decoders)
    }

    /// Returns the line to a station outside this program.
    pub(crate) fn cable(&self) -> Option<Cable> {
        match self {
            Self::Simulated(_) => None,
            Self::Station(station) => Some(station.cable.clone()),
        }
    }
}

/// A simulated world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SimulatedAddress {
    /// The layout: the name of a built-in one or a layout file.
    pub(crate) layout: String,
    /// The seed of the world.
    pub(crate) seed: u64,
    /// The trains that stand on it.
    pub(crate) trains: Vec<TrainId>,
    /// The decoders of all of them.
    pub(crate) decoder: DecoderSteps,
    /// Their law of speed change; if left out, each train has the next one.
    pub(crate) law: Option<LawFamily>,
    /// Whether sensors and turnouts fail at times.
    pub(crate) faults: bool,
    /// The physics that is drawn from wider ranges than usual.
    pub(crate) physics: PhysicsRange,
    /// The speed of its clock, if given.
    pub(crate) speed: Option<Speed>,
    /// The station in front of it.
    pub(crate) station: StationKind,
    /// The station's quirks.
    pub(crate) quirks: Quirks,
}

/// How a simulated station behaves, by its kind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Quirks {
    /// Quirks of a DCC-EX board.
    pub(crate) board: BoardSwitches,
    /// Quirks of a Z21.
    pub(crate) z21: Z21Switches,
    /// Quirks of a Central Station.
    pub(crate) can: CanSwitches,
    /// Quirks of a LocoNet server.
    pub(crate) loconet: LocoNetSwitches,
    /// Quirks of JMRI.
    pub(crate) jmri: JmriSwitches,
}

/// How fast a simulated clock runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Speed {
    /// As fast as it goes.
    Unpaced,
    /// This many times as fast as real time.
    Times(f64),
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (place, parameters) = text.split_once('?').unwrap_or((text, ""));
        let (scheme, place) = place.split_once(':').unwrap_or(("", place));
        let mut address = if scheme == "sim" {
            Self::Simulated(SimulatedAddress::of(place)?)
        } else {
            let station = StationAddress::read(scheme, place).ok_or_else(|| {
                format!(
                    "`{text}` is not a link: use sim:track-a?seed=7, marklin-serial:/dev/ttyUSB0, \
                     dcc-ex:/dev/ttyACM0, z21:192.168.0.111, marklin-can:192.168.0.5, loconet:192.168.0.20, jmri:192.168.0.20, or tcp://host:port in place of a port"
                )
            })?;
            Self::Station(station?)
        };
        for one in parameters.split('&').filter(|one| !one.is_empty()) {
            let (key, value) = pair(one)?;
            match &mut address {
                Self::Simulated(simulated) => simulated.set(key, value)?,
                Self::Station(station) => station.set(key, value)?,
            }
        }
        if let Self::Simulated(simulated) = &address {
            simulated
                .trains
                .iter()
                .try_for_each(|train| simulated.station.check(*train, simulated.decoder))?;
        }
        Ok(address)
    }
}

impl SimulatedAddress {
    /// Returns the default world of a layout.
    ///
    /// # Errors
    /// When no layout is named.
    pub(crate) fn of(layout: &str) -> Result<Self, String> {
        if layout.is_empty() {
            return Err("`sim:` wants a layout; write sim:track-a or the path of a layout file".into());
        }
        let layout = layout.to_owned();
        Ok(Self {
            layout,
            seed: 1,
            trains: TRAINS.to_vec(),
            decoder: DecoderSteps::Fourteen,
            law: None,
            faults: true,
            physics: PhysicsRange::Usual,
            speed: None,
            station: StationKind::default(),
            quirks: Quirks::default(),
        })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "seed" => self.seed = number(key, value, "7")?,
            "speed" if value == "max" => self.speed = Some(Speed::Unpaced),
            "speed" => self.speed = Some(Speed::Times(times(value)?)),
            "trains" => self.trains = trains(value)?,
            "steps" => self.decoder = decoder_of(value)?,
            "law" => self.law = Some(law_named(value)?),
            "world" => self.physics = physics_named(value)?,
            "station" => self.station = StationKind::named(value)?,
            "quirks" => self.quirks = quirks(value)?,
            "faults" => {
                self.faults = match value {
                    "some" => true,
                    "none" => false,
                    _ => {
                        return Err(format!(
                            "`{value}` is not a kind of faults: use faults=some or faults=none"
                        ));
                    }
                }
            }
            _ => {
                return Err(format!(
                    "a simulated link has no `{key}`; it has seed, speed, trains, steps, law, faults, world, station and quirks"
                ));
            }
        }
        Ok(())
    }
}

/// How often a board that chatters prints other text before a message.
const CHATTER: Ratio = Ratio::from_percent(50.0);
/// How often a lossy line drops a byte: one message in fifty is hit.
const LOSSY: Ratio = Ratio::from_percent(0.2);

/// Reads quirks of a DCC-EX board, a Z21 or a Central Station as `chatter,split`.
pub(crate) fn quirks(value: &str) -> Result<Quirks, String> {
    let Quirks { mut board, mut z21, mut can, mut loconet, mut jmri } = Quirks::default();
    for one in value.split(',') {
        let is_of_another = set_quirk(&mut z21, one)
            | can_address::set_quirk(&mut can, one)
            | loconet_address::set_quirk(&mut loconet, one)
            | jmri_address::set_quirk(&mut jmri, one);
        match one {
            "chatter" => board.chatter = CHATTER,
            "merged" => (board.delivery, loconet.delivery) = (Delivery::Merged, Delivery::Merged),
            "split" => (board.delivery, loconet.delivery) = (Delivery::Split, Delivery::Split),
            "lossy" => board.lost = LOSSY,
            "silent" => board.has_banner = false,
            "undefined" => board.defines = false,
            _ if is_of_another => {}
            _ => {
                return Err(format!(
                    "there is no quirk `{one}`; there are chatter (other text between messages), merged and split \
                     (messages arrive together or in parts), lossy (bytes are lost), silent (no banner after a reset), \
                     undefined (no turnout can be defined) of a DCC-EX board, of a Z21 {QUIRKS}, of a Central Station {}, of a LocoNet server {}, and of JMRI {}",
                    can_address::QUIRKS,
                    loconet_address::QUIRKS,
                    jmri_address::QUIRKS
                ));
            }
        }
    }
    Ok(Quirks { board, z21, can, loconet, jmri })
}

/// The law of a name.
///
/// # Errors
/// The names that exist, if there is no such name.
pub(crate) fn law_named(value: &str) -> Result<LawFamily, String> {
    let names = || LawFamily::ALL.map(LawFamily::name).join(", ");
    let named = LawFamily::ALL.into_iter().find(|law| law.name() == value);
    named.ok_or_else(|| format!("there is no law `{value}`; there are {}", names()))
}

/// The range of physics of a name.
///
/// # Errors
/// The names that exist, if there is no such name.
pub(crate) fn physics_named(value: &str) -> Result<PhysicsRange, String> {
    let names = || PhysicsRange::EVERY.map(PhysicsRange::name).join(", ");
    PhysicsRange::named(value).ok_or_else(|| format!("there is no world `{value}`; there are {}", names()))
}

#[cfg(test)]
mod tests {
    use footplate_wire::marklin_serial::Pace;

    use super::super::station_address::StationSettings;
    use super::*;

    fn refused(text: &str) -> String {
        text.parse::<Address>().expect_err(text)
    }

    #[test]
    fn a_simulated_world_is_named_with_what_it_is_made_of() {
        let written = "sim:track-a?seed=7&speed=20&trains=24,58,74&faults=none";
        let expected = SimulatedAddress {
            layout: "track-a".into(),
            seed: 7,
            trains: vec![TrainId(24), TrainId(58), TrainId(74)],
            decoder: DecoderSteps::Fourteen,
            law: None,
            faults: false,
            physics: PhysicsRange::Usual,
            speed: Some(Speed::Times(20.0)),
            station: StationKind::Marklin,
            quirks: Quirks::default(),
        };
        assert_eq!(written.parse(), Ok(Address::Simulated(expected)));
        let Ok(Address::Simulated(plain)) = "sim:loop.toml".parse() else { panic!("a plain one") };
        assert_eq!((plain.seed, plain.trains, plain.speed), (1, TRAINS.to_vec(), None));
        for law in LawFamily::ALL {
            assert!(format!("sim:track-a?law={law}&speed=max").parse::<Address>().is_ok());
        }
    }

    #[test]
    fn a_cable_is_named_by_its_port() {
        let serial = |text: &str| match text.parse() {
            Ok(Address::Station(StationAddress { cable, settings })) => {
                (cable.to_string(), cable.speed(), settings)
            }
            other => panic!("{text}: {other:?}"),
        };
        let plain = StationSettings::Serial { pace: None, modules: None };
        assert_eq!(serial("marklin-serial:/dev/ttyUSB0"), ("/dev/ttyUSB0".into(), 1.0, plain.clone()));
        let fast = StationSettings::Serial { pace: Some(Pace::FAST), modules: Some(3) };
        let written = "marklin-serial:tcp://127.0.0.1:2400?pace=fast&speed=50&modules=3";
        assert_eq!(serial(written), ("tcp://127.0.0.1:2400".into(), 50.0, fast));
        assert_eq!(serial("marklin-serial:tcp://[::1]:2400"), ("tcp://::1:2400".into(), 1.0, plain));
    }

    #[test]
    fn what_is_wrong_is_answered_with_what_would_be_right() {
        let cases = [
            ("/dev/ttyUSB0", "marklin-serial:/dev/ttyUSB0"),
            ("sim:", "sim:track-a"),
            ("sim:track-a?seed", "write seed=…"),
            ("sim:track-a?seed=x", "write seed=7"),
            ("sim:track-a?speed=0", "speed=20"),
            ("sim:track-a?speed=-3", "speed=20"),
            ("sim:track-a?speed=NaN", "speed=20"),
            ("sim:track-a?trains=24,,58", "24,58"),
            ("sim:track-a?trains=81", "1 to 80"),
            ("sim:track-a?trains=24,24", "its own address"),
            ("sim:track-a?law=newton", "there are"),
            ("sim:track-a?faults=all", "faults=some"),
            ("sim:track-a?sped=20", "seed, speed, trains, steps, law, faults, world, station and quirks"),
            ("sim:track-a?world=mars", "there are usual, "),
            ("sim:track-a?station=intellibox", "marklin, dcc-ex, z21, marklin-can, loconet and jmri"),
            ("sim:track-a?quirks=none", "wrong-xor"),
            ("marklin-serial:", "marklin-serial:/dev/ttyUSB0"),
            ("marklin-serial:tcp://host", "tcp://host:port"),
            ("marklin-serial:tcp://host:99999", "tcp://host:port"),
            ("marklin-serial:tcp://:80", "tcp://host:port"),
            ("marklin-serial:/dev/ttyS0?modules=32", "1 to 31"),
            ("marklin-serial:/dev/ttyS0?cts=maybe", "cts=no"),
            ("marklin-serial:/dev/ttyS0?pace=slow", "pace=careful"),
            ("marklin-serial:/dev/ttyS0?baud=9600", "pace, cts, modules and speed"),
            ("dcc-ex:", "dcc-ex:/dev/ttyACM0"),
            ("dcc-ex:tcp://host", "tcp://127.0.0.1:2560"),
            ("dcc-ex:/dev/ttyACM0?turnouts=all", "turnouts=defined"),
            ("dcc-ex:/dev/ttyACM0?reset=maybe", "reset=no"),
            ("dcc-ex:/dev/ttyACM0?first-sensor=-1", "first-sensor=100"),
            ("dcc-ex:/dev/ttyACM0?modules=5", "turnouts, first-sensor, reset and speed"),
            ("z21:", "z21:192.168.0.111"),
            ("z21:host:many", "z21:HOST:21105"),
            ("z21:/dev/ttyUSB0", "z21:HOST:21105"),
            ("z21:host?steps=27", "14, 28 or 126"),
            ("z21:host?feedback=s88", "feedback=r-bus"),
            ("z21:host?straight=left", "straight=second"),
            ("z21:host?sensor-delay=0", "between 1 and 2000 ms"),
            ("z21:host?modules=5", "steps, feedback, first-sensor"),
            ("marklin-can:", "marklin-can:192.168.0.5"),
            ("marklin-can:tcp://host", "tcp://127.0.0.1:15731"),
            ("marklin-can:host:many", "marklin-can:192.168.0.5"),
            ("marklin-can:cs3?locos=sx", "locos=mfx"),
            ("marklin-can:cs3?turnouts=servo", "turnouts=dcc"),
            ("marklin-can:cs3?scan=5", "between 10 and 1000 ms"),
            ("marklin-can:cs3?modules=32", "1 to 31"),
            ("marklin-can:tcp://cs3:15731?receive=1", "marklin-can:HOST?receive=1"),
            ("marklin-can:cs3?pace=fast", "locos, turnouts, first-contact"),
            ("loconet:", "loconet:192.168.0.20"),
            ("loconet:/dev/ttyUSB0", "LbServer"),
            ("loconet:host:many", "HOST:1234"),
            ("loconet:host?straight=left", "straight=thrown"),
            ("loconet:host?sensor-delay=1", "between 3 and 2000 ms"),
            ("loconet:host?modules=5", "first-sensor, first-turnout"),
            ("jmri:", "jmri:192.168.0.20"),
            ("jmri:/dev/ttyUSB0", "web server"),
            ("jmri:host:many", "HOST:12080"),
            ("jmri:host?system=LocoNet", "system=L"),
            ("jmri:host?straight=left", "straight=thrown"),
            ("jmri:host?sensor-delay=1", "between 3 and 2000 ms"),
            ("jmri:host?modules=5", "system, first-sensor"),
        ];
        for (text, right) in cases {
            assert!(refused(text).contains(right), "{text}: {}", refused(text));
        }
    }
}
