//! Draws a picture through one backend for SVG and for pixels.

use std::ops::Range;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::register_font;

use super::picture::{Ink, Layer, Panel, Picture, Shape};

/// Width and height of a picture, in pixels.
pub(super) const SIZE: (u32, u32) = (1600, 1000);
/// Margins in pixels: above the panels, above each panel for its legend, and beside it for its numbers.
const HEAD: u32 = 96;
const LEGEND: u32 = 40;
const LEFT: u32 = 100;
/// The length of a line in the legend, and the opacity of a band.
const SWATCH: i32 = 40;
const FAINT: f64 = 0.18;
/// Half the width of a point and of the caps of its error bar, in pixels.
const DOT: u32 = 6;
/// The name and sizes of the font.
const FONT: &str = "sans-serif";
const TITLE: u32 = 34;
const WORDS: u32 = 22;
const NUMBERS: u32 = 20;

const TEXT: RGBColor = RGBColor(0x1b, 0x24, 0x30);
const QUIET: RGBColor = RGBColor(0x52, 0x60, 0x70);
const GRID: RGBColor = RGBColor(0xd5, 0xda, 0xe1);

const fn colour(ink: Ink) -> RGBColor {
    match ink {
        Ink::First => RGBColor(0x1f, 0x66, 0xc1),
        Ink::Second => RGBColor(0xc2, 0x57, 0x0c),
        Ink::Third => RGBColor(0x6b, 0x3f, 0xa0),
        Ink::Plain => TEXT,
    }
}

type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Draws a picture onto an area; `scale` pixels for each of [`SIZE`].
pub(super) fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    picture: &Picture,
    scale: u32,
) -> Drawn<B> {
    static LETTERS: Once = Once::new();
    // The font is part of the program, so that pictures are the same on all machines.
    LETTERS.call_once(|| {
        let _ = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
    area.fill(&WHITE)?;
    let (head, body) = area.split_vertically(HEAD * scale);
    let at = |y: u32| (i32::try_from(24 * scale).unwrap_or(0), i32::try_from(y * scale).unwrap_or(0));
    head.draw(&Text::new(picture.title.as_str(), at(20), (FONT, TITLE * scale).into_font().color(&TEXT)))?;
    head.draw(&Text::new(
        picture.subtitle.as_str(),
        at(64),
        (FONT, NUMBERS * scale).into_font().color(&QUIET),
    ))?;
    let parts: Vec<u32> = picture.panels.iter().map(|panel| panel.height.unwrap_or(1)).collect();
    let all = parts.iter().sum::<u32>().max(1);
    let high = body.dim_in_pixel().1;
    let mut rest = body;
    let mut parts = parts.iter();
    for together in picture.panels.split_inclusive(|panel| !panel.x.is_empty()) {
        let points = together.iter().flat_map(|panel| &panel.layers).flat_map(|layer| layer.shape.extent());
        let x = range(points.map(|(x, _)| x), false, 0.015);
        for (panel, part) in together.iter().zip(&mut parts) {
            let (own, below) = rest.split_vertically(high * part / all);
            draw_panel(&own, panel, &x, scale)?;
            rest = below;
        }
    }
    Ok(())
}

/// The range of all values, with a margin.
fn range(values: impl Iterator<Item = f64>, with_zero: bool, room: f64) -> Range<f64> {
    let known = values.filter(|value| value.is_finite());
    let (mut low, mut high) = known
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        (low, high) = (0.0, 1.0);
    }
    if with_zero {
        (low, high) = (low.min(0.0), high.max(0.0));
    }
    let span = if high > low { high - low } else { 1.0 };
    let below = if with_zero && low == 0.0 { 0.0 } else { room * span };
    low - below..high + room * span
}

/// A number with enough decimals to show a hundredth of the axis, without trailing zeros, and with a true minus.
fn number(value: f64, shown: &Range<f64>) -> String {
    let hundredth = (shown.end - shown.start) / 100.0;
    let decimals = (-libm::log10(hundredth)).ceil().clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "\u{2212}") }
}

/// The legend: names of all layers in one row above the panel.
fn draw_legend<B: DrawingBackend>(area: &DrawingArea<B, Shift>, layers: &[Layer], scale: u32) -> Drawn<B> {
    let style = (FONT, NUMBERS * scale).into_font().color(&TEXT);
    let unit = pixels(scale);
    let (mut left, middle) = (pixels(LEFT * scale) + 12 * unit, 20 * unit);
    for Layer { label, ink, shape } in layers {
        let ink = colour(*ink);
        let line = ink.stroke_width(3 * scale);
        let ends = [(left, middle), (left + SWATCH * unit, middle)];
        match shape {
            Shape::Band(_) => {
                let corners = [(left, middle - 9 * unit), (left + SWATCH * unit, middle + 9 * unit)];
                area.draw(&Rectangle::new(corners, ink.mix(FAINT).filled()))?;
            }
            Shape::Line(_) => area.draw(&PathElement::new(ends, line))?,
            Shape::Dashed(_) => {
                area.draw(&DashedPathElement::new(ends, 10 * scale, 6 * scale, line))?;
            }
            Shape::Points(_) => {
                let middle = (left + SWATCH * unit / 2, middle);
                area.draw(&Circle::new(middle, pixels(DOT * scale), ink.filled()))?;
            }
        }
        left += (SWATCH + 10) * unit;
        area.draw(&Text::new(label.as_str(), (left, middle - 8 * unit), style.clone()))?;
        left += pixels(area.estimate_text_size(label, &style)?.0) + 36 * unit;
    }
    Ok(())
}

/// Pixels as a coordinate.
fn pixels(count: u32) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
    x: &Range<f64>,
    scale: u32,
) -> Drawn<B> {
    let (legend, area) = area.split_vertically(LEGEND * scale);
    draw_legend(&legend, &panel.layers, scale)?;
    let points = panel.layers.iter().flat_map(|layer| layer.shape.extent());
    let y = range(points.map(|(_, y)| y), panel.from_zero, 0.06);
    let letters = |height: u32, colour: &RGBColor| (FONT, height * scale).into_font().color(colour);
    let mut chart = ChartBuilder::on(&area)
        .margin(10 * scale)
        .margin_right(30 * scale)
        .x_label_area_size(if panel.x.is_empty() { 34 } else { 64 } * scale)
        .y_label_area_size(LEFT * scale)
        .build_cartesian_2d(x.clone(), y.clone())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(scale))
        .axis_style(QUIET.stroke_width(scale))
        .x_desc(panel.x.as_str())
        .y_desc(panel.y.as_str())
        .axis_desc_style(letters(WORDS, &TEXT))
        .label_style(letters(NUMBERS, &QUIET))
        .x_label_formatter(&|value| number(*value, x))
        .y_label_formatter(&|value| number(*value, &y))
        .set_all_tick_mark_size(6 * scale)
        .draw()?;
    if y.start < 0.0 && y.end > 0.0 {
        let zero_line = [(x.start, 0.0), (x.end, 0.0)];
        chart.draw_series([PathElement::new(zero_line, QUIET.stroke_width(scale))])?;
    }
    for Layer { ink, shape, .. } in &panel.layers {
        let ink = colour(*ink);
        let line = ink.stroke_width(3 * scale);
        match shape {
            Shape::Band(points) => {
                let upper = points.iter().map(|(x, _, high)| (*x, *high));
                let lower = points.iter().rev().map(|(x, low, _)| (*x, *low));
                let around: Vec<(f64, f64)> = upper.chain(lower).filter(|(_, y)| y.is_finite()).collect();
                chart.draw_series([Polygon::new(around, ink.mix(FAINT).filled())])?;
            }
            Shape::Line(points) => {
                let pieces = points.split(|(_, y)| !y.is_finite()).filter(|piece| !piece.is_empty());
                chart.draw_series(pieces.map(|piece| PathElement::new(piece.to_vec(), line)))?;
            }
            Shape::Dashed(points) => {
                let known = points.iter().copied().filter(|(_, y)| y.is_finite());
                chart.draw_series(DashedLineSeries::new(known, 14 * scale, 9 * scale, line))?;
            }
            Shape::Points(points) => {
                let known = points.iter().filter(|(_, y, half)| y.is_finite() && half.is_finite());
                let style = ink.filled().stroke_width(2 * scale);
                chart.draw_series(known.map(|(x, y, half)| {
                    ErrorBar::new_vertical(*x, y - half, *y, y + half, style, 2 * DOT * scale)
                }))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_decimals_that_an_axis_needs() {
        assert_eq!(number(-2.5, &(-10.0..10.0)), "\u{2212}2.5");
        assert_eq!(number(250.0, &(0.0..600.0)), "250");
        assert_eq!(number(0.0, &(-0.01..0.01)), "0");
        assert_eq!(number(0.004, &(0.0..0.01)), "0.004");
    }

    #[test]
    fn an_axis_contains_all_values_and_zero_where_asked() {
        let speeds = [f64::NAN, 3.0, 7.0];
        let shown = range(speeds.into_iter(), true, 0.05);
        assert!(shown.start == 0.0 && shown.end > 7.0, "{shown:?}");
        let shown = range(speeds.into_iter(), false, 0.05);
        assert!(shown.start < 3.0 && shown.start > 2.5, "{shown:?}");
        let nothing = range([].into_iter(), false, 0.05);
        assert!(nothing.start < nothing.end);
    }
}
