//! An address becomes a link, and what the session over it has to know.

use footplate_core::track::Layout;
use footplate_core::{Ratio, TimeSpan};
use footplate_sim::living::{LivingLayout, LivingSwitches, StationSwitches};
use footplate_wire::marklin_serial::{INPUTS_PER_MODULE, Interface, Pace, Settings};
use footplate_wire::{BlockReports, Session, dcc_ex, jmri, loconet, marklin_can, z21};

use super::address::{Address, SimulatedAddress, Speed};
use super::station_address::{StationAddress, StationSettings};
use super::station_kind::StationKind;
use super::{Cable, CableLink, Link, Lost, SimulatedLink, SimulatedStation};
#[cfg(unix)]
use crate::guardian::WardConnection;

/// How late a byte may come because this computer, an adapter or a network was busy; FTDI's adapters hand over every
/// 16 ms unless set otherwise.
const JITTER: TimeSpan = TimeSpan::from_ms(40);

/// Opens a line. `layout` is the layout that is simulated, if one is.
///
/// # Errors
/// When a simulated layout has no circuit for a train, or a port cannot be opened.
pub(crate) fn open<'l>(
    address: &Address,
    layout: &'l Layout,
    default_speed: Speed,
) -> anyhow::Result<Box<dyn Link + 'l>> {
    Ok(match address {
        Address::Simulated(simulated) => Box::new(open_simulated(simulated, layout, default_speed)?),
        Address::Station(station) => open_cable(station.cable.clone())?,
    })
}

/// Opens a line outside this process, or has this program's guardian open it.
pub(crate) fn open_cable(cable: Cable) -> Result<Box<dyn Link>, Lost> {
    #[cfg(unix)]
    if let Some(link) = WardConnection::open(&cable)? {
        return Ok(Box::new(link));
    }
    Ok(Box::new(CableLink::open(cable)?))
}

/// The station of an address on its layout, in this process.
///
/// # Errors
/// When the layout has no circuit for a train.
pub(crate) fn open_simulated<'l>(
    address: &SimulatedAddress,
    layout: &'l Layout,
    default_speed: Speed,
) -> anyhow::Result<SimulatedLink<'l>> {
    let station = station(address, layout)?;
    Ok(SimulatedLink::new(station, address.speed.unwrap_or(default_speed)))
}

/// The virtual station of an address.
///
/// # Errors
/// When the layout has no circuit for a train.
pub(crate) fn station<'l>(
    address: &SimulatedAddress,
    layout: &'l Layout,
) -> anyhow::Result<SimulatedStation<'l>> {
    let mut switches = if address.faults { LivingSwitches::well_kept() } else { LivingSwitches::faultless() };
    switches.law = address.law;
    switches.physics = address.physics;
    switches.decoder = address.decoder;
    if !address.faults {
        switches.turnout_failure = Ratio::ZERO;
    }
    let SimulatedAddress { station, seed, trains, quirks, .. } = address;
    let world = LivingLayout::draw(layout, *seed, trains, &switches)?;
    let marklin = StationSwitches::draw(*seed, switches.physics);
    Ok(SimulatedStation::new(*station, world, *seed, marklin, *quirks))
}

/// The highest number under which the station reports a sensor of a layout.
fn highest_input(layout: &Layout) -> u16 {
    layout.sensors().map(|(sensor, _)| layout.input(sensor).0).max().unwrap_or_default()
}

/// How many modules the sensors of a layout are on.
pub(crate) fn module_count(layout: &Layout) -> u8 {
    modules_up_to(highest_input(layout))
}

/// How many modules there are up to that of an input.
fn modules_up_to(highest: u16) -> u8 {
    u8::try_from(highest / INPUTS_PER_MODULE + 1).unwrap_or(u8::MAX)
}

/// The session over an open line with the station of its kind, and what makes its reports those of the layout's blocks.
pub(crate) struct OpenSession {
    /// The session.
    pub(crate) session: Box<dyn Session>,
    /// What the detectors of blocks report; `None` for a layout without blocks.
    pub(crate) blocks: Option<BlockReports>,
}

impl<S: Session> From<S> for OpenSession {
    fn from(session: S) -> Self {
        Self { session: Box::new(session), blocks: None }
    }
}

/// The session over an open line.
///
/// # Errors
/// When no bus has as many sensor modules as the layout needs.
pub(crate) fn open_session(
    address: &Address,
    link: &dyn Link,
    layout: &Layout,
) -> anyhow::Result<OpenSession> {
    let mut opened = session_with(address, link, highest_input(layout))?;
    opened.blocks = BlockReports::of(layout, opened.session.as_mut());
    Ok(opened)
}

/// The session over an open line that only stops trains: no layout is needed for that.
///
/// # Errors
/// The address asks for more sensor modules than a bus has.
pub(crate) fn open_session_to_stop(address: &Address, link: &dyn Link) -> anyhow::Result<OpenSession> {
    session_with(address, link, 0)
}

/// The session of an address whose station reports sensors up to this number.
fn session_with(address: &Address, link: &dyn Link, highest: u16) -> anyhow::Result<OpenSession> {
    let (now, modules) = (link.now(), modules_up_to(highest));
    Ok(match address {
        Address::Simulated(simulated) => match simulated.station {
            StationKind::Marklin => Interface::new(now, Settings::with_cts(modules))?.into(),
            StationKind::DccEx => dcc_ex::Client::new(now, dcc_ex::Settings::default()).into(),
            StationKind::Z21 => {
                let feedback = simulated.quirks.z21.feedback;
                let settings = z21::Settings { feedback, ..z21::Settings::default() };
                z21::Client::new(now, z21_settings(settings, highest)).into()
            }
            StationKind::MarklinCan => {
                let scan = simulated.quirks.can.scan;
                let settings = marklin_can::Settings { modules, scan, ..marklin_can::Settings::default() };
                marklin_can::Client::new(now, settings).into()
            }
            StationKind::LocoNet => loconet::Client::new(now, loconet::Settings::default()).into(),
            StationKind::Jmri => {
                jmri::Client::new(now, jmri_settings(jmri::Settings::default(), highest)).into()
            }
        },
        Address::Station(StationAddress { cable, settings }) => match settings {
            StationSettings::Serial { pace, modules: counted } => {
                let by_line = if link.cts().is_some() { Pace::Cts } else { Pace::CAREFUL };
                let mut settings = Settings::timed(counted.unwrap_or(modules), pace.unwrap_or(by_line));
                settings.reply_allowance += TimeSpan::from_s(JITTER.as_s() * cable.speed().max(1.0));
                Interface::new(now, settings)?.into()
            }
            StationSettings::Board(settings) => dcc_ex::Client::new(now, *settings).into(),
            StationSettings::Z21(settings) => z21::Client::new(now, z21_settings(*settings, highest)).into(),
            StationSettings::Can { settings, modules } => {
                // The modules that the layout's sensors are on.
                let last = highest.saturating_add(settings.first_input.max(1));
                let needed = u8::try_from(last.div_ceil(INPUTS_PER_MODULE)).unwrap_or(u8::MAX);
                let modules = modules.unwrap_or(needed);
                marklin_can::Client::new(now, marklin_can::Settings { modules, ..*settings }).into()
            }
            StationSettings::LocoNet(settings) => loconet::Client::new(now, *settings).into(),
            StationSettings::Jmri(settings) => {
                jmri::Client::new(now, jmri_settings(settings.clone(), highest)).into()
            }
        },
    })
}

/// Settings that know how many sensors the layout has.
fn z21_settings(settings: z21::Settings, highest: u16) -> z21::Settings {
    z21::Settings { last_sensor: highest.saturating_add(settings.first_sensor), ..settings }
}

/// Settings that know how many sensors the layout has.
fn jmri_settings(settings: jmri::Settings, highest: u16) -> jmri::Settings {
    jmri::Settings { last_sensor: highest.saturating_add(settings.first_sensor), ..settings }
}
