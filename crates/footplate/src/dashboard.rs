//! The dashboard: the live state of the running program in a browser, and commands from there.
//!
//! ```text
//! painter          composes pictures and events from the state of a driver
//! picture  spans   the current state; the parts of edges that a length of track covers
//! history          the last minutes of a train; `travelled_distance` makes one growing number of its positions
//! model_picture    the motion model of a train, step by step
//! alarm            alarms, as sentences that the pages have in both languages; their causes, and what resolves them
//! alarm_list       the active alarms, one for each cause
//! board            the exchange between control loop and watchers; the loop never waits for them
//! guard  token     access control: hosts, origins, and a token for other machines
//! connections      the limit on connections, such that an emergency stop always gets through
//! timed_body       the time that the body of a request may take
//! server  stream   HTTP on a thread of its own; the event stream of one watcher
//! read_only        calibrations and demonstrations, which take no commands
//! routes           the paths of the interface
//! assets           the pages, inside the program
//! ```

mod alarm;
mod alarm_list;
mod assets;
mod board;
mod calibration_picture;
mod connections;
mod crossing_picture;
mod guard;
mod history;
mod model_picture;
mod painter;
mod picture;
mod read_only;
mod routes;
mod server;
mod spans;
mod stream;
mod timed_body;
mod token;
mod travelled_distance;

pub(crate) use alarm::Alarm;
pub(crate) use board::{Answer, Board, LateRefusal, PendingRequest, Request, Unfulfilled};
pub(crate) use painter::{Painter, TrainPassed};
pub(crate) use picture::{LayoutPicture, SchedulePicture, SessionState, TrainTask};
pub(crate) use read_only::{CalibrationFollower, ReadOnlyDashboard};
pub(crate) use routes::Routes;
pub(crate) use server::{Dashboard, ServedAt, ServedPages, answered, answering, driving_routes};
pub(crate) use token::Token;
