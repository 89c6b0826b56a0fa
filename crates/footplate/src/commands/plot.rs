//! The pictures of `--plot`, drawn alike as SVG and PNG.

mod drawing;
mod file;
mod picture;

pub(super) use file::PictureFile;
pub(super) use picture::{Ink, Layer, Panel, Picture, SHOWN, Shape, shares};
