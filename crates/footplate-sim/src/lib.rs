//! A seeded world of trains, track and sensors, whose truth only scorers see.
//!
//! The referee of every claim that Footplate makes about accuracy. It shares no formula with the estimator:
//! decoders and motors are processes run forward a millisecond at a time, contacts close where the rails
//! really put them, and polls read them when the line lets them. What a program would have recorded comes out
//! as [`Event`](footplate_core::Event)s; what really happened as a [`RunTruth`] beside them.
//!
//! One seed is one world, on every machine and in every release: see [`World::run`].
//!
//! ```text
//! recording scenario  what a person would record in an hour, by name
//! run  truth          a script happens in a world: events and what is behind them
//! host  script        the program that polls and the person with the tape
//! rolling  load       a train on rails       poller  contacts  gates
//! motor  law  train  speed_table             path  railway  circuit  track
//! physics_range  traits  other_law           worlds that no estimator is built on
//! electric                                   a second train model, by other equations
//! draws
//! ```
//!
//! Full-size trains on full-size lines are a world of their own, in [`mod@line`]. Several trains on a whole layout,
//! behind the bytes of a command station, are in [`mod@living`].

mod circuit;
mod contacts;
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
mod speed_table;
mod track;
mod train;
mod traits;
mod truth;

pub use circuit::{Circuit, CircuitError};
pub use contacts::{Cause, Faults};
pub use electric::ElectricEngine;
pub use gates::GatePass;
pub use law::{Law, LawFamily};
pub use living::{
    BoardSwitches, CanSwitches, CanTransport, CoilAlarm, CtsSwitch, Delivery, End, FromStation, HandError,
    LivingLayout, LivingSwitches, LocoNetSwitches, Mishap, MishapKind, PassTruth, RestTruth, StationSwitches,
    TrainTruth, Truth, VirtualBoard, VirtualCentralStation, VirtualLocoNet, VirtualStation, VirtualZ21,
    Z21Switches,
};
pub use other_law::OtherLaw;
pub use physics_range::PhysicsRange;
pub use poller::Link;
pub use railway::Railway;
pub use recording::SimulatedRecording;
pub use run::{Conditions, SimulatedRun, World};
pub use scenario::Scenario;
pub use script::{Order, Script, Start, What, When};
pub use speed_table::{Shape, SpeedTable};
pub use track::TrueTrack;
pub use train::{StopScatter, Train};
pub use traits::{SessionSpread, StickyStarts, Traits};
pub use truth::{CommandTruth, Motion, ReportTruth, RunTruth, StopTruth};
