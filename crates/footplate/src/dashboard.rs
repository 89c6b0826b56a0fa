//! The dashboard: what the running system looks like, live in a browser, and what is asked of it from there.
//!
//! ```text
//! picture  spans   what there is to see now; which rails a stretch of way covers
//! board            where the control loop leaves pictures and lines, and finds what was asked; it never waits for anybody
//! guard            who may ask: hosts, origins, a token beyond loopback
//! server  stream   HTTP on a thread of its own; what one watcher is sent
//! assets           the pages, inside the program
//! ```

mod assets;
mod board;
mod guard;
mod picture;
mod server;
mod spans;
mod stream;

pub(crate) use board::{Answer, Board};
pub(crate) use picture::{Painter, Picture, TrainTask};
pub(crate) use server::{Dashboard, ServedAt};
