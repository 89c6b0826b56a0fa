//! A simulator for trains, track and sensors with random but reproducible parameters, whose truth only scorers see.
//!
//! It is the reference for every claim that Footplate makes about accuracy, and shares no formula with the estimators:
//! decoders and motors are integrated a millisecond at a time, sensors close at their true places, and polls read them
//! when the line allows. A run returns what a program would have recorded as [`Event`](footplate_core::Event)s, and the
//! truth as a [`RunTruth`] beside them.
//!
//! One seed is one world, on every machine and in every release: see [`World::run`].
//!
//! ```text
//! recording scenario  named experiments of an hour, as an operator would record them
//! run  truth          one script in a world: its events and their truth
//! host  script        the polling program and the operator with the tape
//! rolling  load       a train on rails       poller  sensors  gates
//! motor  law  train  speed_table             path  railway  circuit  track
//! physics_range  traits  other_law           worlds outside the estimators' assumptions
//! electric                                   a second train model with other equations
//! draws
//! ```
//!
//! Full-size trains on full-size lines are a separate world, in [`mod@line`]. Several trains on a whole layout, behind
//! the bytes of a command station, are in [`mod@living`].

mod circuit;
mod draws;
mod electric;
mod gates;
mod host;
mod law;
pub mod line;
pub mod living;
mod load;
mod motor;
mod other_law;
mod path;
mod physics_range;
mod poller;
mod railway;
mod recording;
mod rolling;
mod run;
mod scenario;
mod script;
mod sensors;
mod speed_table;
mod track;
mod train;
mod traits;
mod truth;

pub use circuit::{Circuit, CircuitError};
pub use electric::ElectricEngine;
pub use gates::GatePass;
pub use law::{Law, LawFamily};
pub use living::{
    BoardSwitches, CanSwitches, CanTransport, CoilAlarm, CtsSwitch, Delivery, End, FromStation, HandError,
    Incident, IncidentKind, JmriSwitches, LivingLayout, LivingSwitches, LocoNetSwitches, PassTruth,
    RestTruth, SpeedReports, StationSwitches, TrainTruth, Truth, VirtualBoard, VirtualCentralStation,
    VirtualJmri, VirtualLocoNet, VirtualStation, VirtualZ21, Z21Switches,
};
pub use other_law::OtherLaw;
pub use physics_range::PhysicsRange;
pub use poller::Link;
pub use railway::Railway;
pub use recording::SimulatedRecording;
pub use run::{Conditions, SimulatedRun, World};
pub use scenario::Scenario;
pub use script::{Order, Script, Start, What, When};
pub use sensors::{Cause, Faults};
pub use speed_table::{Shape, SpeedTable};
pub use track::TrueTrack;
pub use train::{StopScatter, Train};
pub use traits::{SessionSpread, StickyStarts, Traits};
pub use truth::{CommandTruth, Motion, ReportTruth, RunTruth, StopTruth};
