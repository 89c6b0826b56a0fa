//! Writes a picture to a file, as SVG or PNG by its extension.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, anyhow};
use footplate_store::write_whole;
use plotters::prelude::{BitMapBackend, IntoDrawingArea, SVGBackend};

use super::drawing::{SIZE, draw};
use super::picture::Picture;

/// PNGs are drawn at this multiple of their size and averaged, which smooths lines.
const FINER: u32 = 2;
/// Red, green and blue.
const COLOURS: usize = 3;

/// A picture file to write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::commands) struct PictureFile {
    path: PathBuf,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Svg,
    Png,
}

impl FromStr for PictureFile {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let path = PathBuf::from(name);
        let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
        let form = match ending.as_deref() {
            Some("svg") => Form::Svg,
            Some("png") => Form::Png,
            _ => return Err(format!("`{name}` should end with .svg or .png")),
        };
        Ok(Self { path, form })
    }
}

impl PictureFile {
    pub(in crate::commands) fn path(&self) -> &Path {
        &self.path
    }

    /// Draws the picture and replaces the file in one step.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(in crate::commands) fn write(&self, picture: &Picture) -> anyhow::Result<()> {
        let bytes = match self.form {
            Form::Svg => svg(picture)?.into_bytes(),
            Form::Png => png(picture)?,
        };
        write_whole(&self.path, &bytes).with_context(|| format!("writing {}", self.path.display()))
    }
}

fn svg(picture: &Picture) -> anyhow::Result<String> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    let drawn = draw(&area, picture, 1).and_then(|()| area.present());
    drawn.map_err(|error| anyhow!("drawing `{}`: {error}", picture.title))?;
    drop(area);
    Ok(text)
}

fn png(picture: &Picture) -> anyhow::Result<Vec<u8>> {
    let (width, height) = SIZE;
    let (wide, high) = (FINER * width, FINER * height);
    let mut fine = vec![0; wide as usize * high as usize * COLOURS];
    {
        let area = BitMapBackend::with_buffer(&mut fine, (wide, high)).into_drawing_area();
        let drawn = draw(&area, picture, FINER).and_then(|()| area.present());
        drawn.map_err(|error| anyhow!("drawing `{}`: {error}", picture.title))?;
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&smaller(&fine, wide as usize))?;
    Ok(bytes)
}

/// Averages blocks of pixels down to the final size.
fn smaller(fine: &[u8], wide: usize) -> Vec<u8> {
    let finer = FINER as usize;
    let line = wide * COLOURS;
    let mut pixels = Vec::with_capacity(fine.len() / (finer * finer));
    for lines in fine.chunks_exact(finer * line) {
        for left in (0..line).step_by(finer * COLOURS) {
            for colour in 0..COLOURS {
                let drawn = (0..finer).flat_map(|down| {
                    (0..finer).map(move |right| down * line + left + right * COLOURS + colour)
                });
                let sum: u32 = drawn.filter_map(|at| lines.get(at)).map(|value| u32::from(*value)).sum();
                pixels.push(u8::try_from((sum + FINER) / (FINER * FINER)).unwrap_or(u8::MAX));
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::super::picture::{Ink, Layer, Panel, Shape};
    use super::*;

    fn picture() -> Picture {
        let points = (0..50).map(|at| (f64::from(at), f64::from(at % 7))).collect();
        let layers = vec![Layer::new("speed <of> \"74\"", Ink::First, Shape::Line(points))];
        let panel = Panel { x: "time (s)".into(), y: "speed (m/s)".into(), layers, ..Panel::default() };
        Picture { title: "Train & track".into(), subtitle: String::new(), panels: vec![panel] }
    }

    #[test]
    fn the_extension_selects_the_format() {
        assert_eq!("a/b.SVG".parse::<PictureFile>().unwrap().form, Form::Svg);
        assert_eq!("b.png".parse::<PictureFile>().unwrap().form, Form::Png);
        assert!("b.gif".parse::<PictureFile>().unwrap_err().contains("end with .svg or .png"));
        assert!("svg".parse::<PictureFile>().is_err());
    }

    #[test]
    fn names_of_others_stay_text_in_a_picture_and_the_same_is_drawn_twice() {
        let text = svg(&picture()).unwrap();
        assert!(text.contains("Train &amp; track") && text.contains("speed &lt;of&gt;"), "{text}");
        assert_eq!(text, svg(&picture()).unwrap());
        assert_eq!(png(&picture()).unwrap(), png(&picture()).unwrap());
    }

    #[test]
    fn pixels_have_the_sides_of_the_picture_and_are_not_all_of_one_colour() {
        let bytes = png(&picture()).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let drawn = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((drawn.width, drawn.height), SIZE);
        let mut colours: Vec<[u8; 3]> =
            pixels.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() > 20, "{} colours", colours.len());
        assert!(colours.contains(&[0x1f, 0x66, 0xc1]), "the line's own colour");
    }
}
