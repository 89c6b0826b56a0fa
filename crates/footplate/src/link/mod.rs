//! Bytes to and from a command station: over a cable, over a network, or into a simulated one.
//!
//! ```text
//! address     what a person writes: `sim:track-a?seed=7`, `marklin-serial:/dev/ttyUSB0`
//! station_address  place   a station outside this process, with its settings; where its line ends
//! board_address  can_address  jmri_address  loconet_address  serial_address  z21_address   what each kind of station adds
//! parameters  what follows the `?` of an address
//! named_train  station_kind   a train by its address; which addresses and decoders a station commands, and how long its link takes
//! line        what every link can do, and what is heard of it
//! news        what of that a watchdog wants to know
//! discovery   serial ports, and stations that answer a call to the network
//! open  measured  an address becomes a link; what the doctor measured of its line
//! simulated_station  a simulated layout behind either kind of station
//! simulated   a virtual station in this process, as fast as it goes or paced
//! served      a virtual station for other programs, at a network port or a pseudo-terminal
//! tapped      any of them, with every byte noted
//! rhythm      what bytes tell of how often sensors are asked for
//! observed    any of them, with its times counted while it is used
//! cable       a line outside this process, read by a thread, with the clock of this computer; cable_end  our end of it
//! stream  datagrams  web_socket   how it is opened: a serial port or a connection; a station behind UDP; JMRI
//! ```

mod address;
mod board_address;
mod cable;
mod cable_end;
mod can_address;
mod datagrams;
mod discovery;
mod jmri_address;
mod line;
mod loconet_address;
mod measured;
mod named_train;
mod observed;
mod open;
mod parameters;
mod place;
mod rhythm;
mod serial_address;
mod served;
mod simulated;
mod simulated_station;
mod station_address;
mod station_kind;
mod stream;
mod tapped;
mod web_socket;
mod z21_address;

pub(crate) use address::{Address, Quirks, SimulatedAddress, Speed, law_named, quirks};
pub(crate) use cable::{Cable, CableLink};
pub(crate) use cable_end::Arrival;
pub(crate) use discovery::find_stations;
pub(crate) use line::{Bequest, Guardian, Heard, Link, Lost, PERSON_MS};
pub(crate) use measured::MeasuredLine;
pub(crate) use named_train::{NamedTrain, decoder_of, trains};
pub(crate) use observed::{LineTallies, ObservedLink, SharedTallies};
pub(crate) use open::{
    OpenSession, module_count, open, open_cable, open_session, open_session_to_stop, open_simulated, station,
};
pub(crate) use rhythm::{PowerCommand, Rhythm};
pub(crate) use served::{Incoming, Server, listen_for_datagrams, listen_on, open_pseudo_terminal};
pub(crate) use simulated::SimulatedLink;
pub(crate) use simulated_station::{FromSimulated, SimulatedStation};
pub(crate) use station_kind::StationKind;
pub(crate) use tapped::{Passed, TappedLink};
pub(crate) use web_socket::listen_for_sockets;
