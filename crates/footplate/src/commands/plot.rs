//! The pictures of `--plot`, drawn alike as SVG and PNG.

mod drawing;
mod file;
mod picture;
mod shares;

pub(super) use file::PictureFile;
pub(super) use picture::{Ink, Layer, Panel, Picture, Shape};
pub(super) use shares::{SHOWN, shares};
