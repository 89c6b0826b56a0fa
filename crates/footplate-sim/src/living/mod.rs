//! Trains on a whole layout that go where the turnouts lead them, behind the bytes of a command station.
//!
//! ```text
//! station  cts             the virtual 6051: bytes in, bytes out, at the pace of its line
//! board                    the virtual DCC-EX board: requests in, replies and sensors out, with its delays
//! speed_reports            what decoders report of the speed of their trains
//! z21                      the virtual Z21: datagrams of many clients in and out, over a network with faults
//! central_station          the virtual Central Station: frames of Märklin's CAN bus over datagrams, a stream or an adapter
//! jmri                     JMRI and the hardware behind it: lines of JSON in and out
//! loconet                  a command station on LocoNet behind a server: lines in and out, at the pace of its bus
//! network  delivery        datagrams through a network; the portions of a stream
//! due_queue                what is due later
//! decoder                  decoders of locomotives: the step nearest to a command
//! world  start  hands      several trains, a millisecond at a time; their start; operator intervention
//! live_train  drive  incident  one train; its motor; collisions, derailments and overruns
//! body  points  s88        the track under a train; turnouts; sensors, and what modules remember of them
//! detectors                the delays of the detectors of blocks
//! rails  switches         the rails; the faults of the world
//! truth  past_truth        the truth now and before, for scorers only
//! ```

mod board;
mod body;
mod central_station;
mod cts;
mod decoder;
mod delivery;
mod detectors;
mod drive;
mod due_queue;
mod hands;
mod incident;
mod jmri;
mod live_train;
mod loconet;
mod network;
mod past_truth;
mod points;
mod rails;
mod s88;
mod speed_reports;
mod start;
mod station;
mod switches;
mod truth;
mod world;
mod z21;

pub use board::{BoardSwitches, VirtualBoard};
pub use central_station::{CanSwitches, CanTransport, VirtualCentralStation};
pub use cts::CtsSwitch;
pub use delivery::Delivery;
pub use hands::HandError;
pub use incident::{Incident, IncidentKind};
pub use jmri::{JmriSwitches, VirtualJmri};
pub use live_train::End;
pub use loconet::{LocoNetSwitches, VirtualLocoNet};
pub use past_truth::{PassTruth, RestTruth};
pub use speed_reports::SpeedReports;
pub use station::{CoilAlarm, FromStation, StationSwitches, VirtualStation};
pub use switches::LivingSwitches;
pub use truth::{TrainTruth, Truth};
pub use world::LivingLayout;
pub use z21::{VirtualZ21, Z21Switches};
