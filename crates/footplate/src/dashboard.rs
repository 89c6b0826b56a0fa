//! The dashboard: what the running system looks like, live in a browser, and what is asked of it from there.
//!
//! ```text
//! painter          makes all of it of what a driver knows
//! picture  spans   what there is to see now; which rails a stretch of way covers
//! history          what was in the last minutes; `way_travelled` makes one number of places along a way
//! model_picture    how a train moves, step by step
//! alarm            what is not as it should be, in sentences that pages have in both languages
//! board            where the control loop leaves all that, and finds what was asked; it never waits for anybody
//! guard  token     who may ask: hosts, origins, a token beyond loopback
//! connections      which connections are kept, so that an emergency stop always gets through
//! server  stream   HTTP on a thread of its own; what one watcher is sent
//! shadow           where the train of a calibration is
//! showing          what machines do that take no orders: calibrations, a demonstration
//! routes           what can be asked for
//! assets           the pages, inside the program
//! ```

mod alarm;
mod assets;
mod board;
mod calibration_picture;
mod connections;
mod guard;
mod history;
mod model_picture;
mod painter;
mod picture;
mod routes;
mod server;
mod shadow;
mod showing;
mod spans;
mod stream;
mod token;
mod way_travelled;

pub(crate) use alarm::Alarm;
pub(crate) use board::{Answer, Board, Request};
pub(crate) use painter::{Painter, TrainPassed};
pub(crate) use picture::LayoutPicture;
pub(crate) use picture::TrainTask;
pub(crate) use routes::Routes;
pub(crate) use server::{Dashboard, ServedAt};
pub(crate) use shadow::Shadow;
pub(crate) use showing::Showing;
pub(crate) use token::Token;
