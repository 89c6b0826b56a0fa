//! How it is drawn: the track, a card a train, what was said, and the prompt.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke, Points};
use ratatui::widgets::{Block, Paragraph, Wrap};

use super::prompt::Prompt;
use super::seen::{Seen, Train};

/// Colours of trains, in their order.
const COLOURS: [Color; 6] =
    [Color::LightBlue, Color::LightRed, Color::LightMagenta, Color::LightGreen, Color::Yellow, Color::Cyan];
/// Narrower than this there is no room for the track beside the trains.
const WIDE: u16 = 90;
/// Lower than this there is no room for the track at all.
const HIGH: u16 = 20;
/// A card of a train is so wide ...
const CARD: u16 = 46;
/// ... and so many lines high.
const CARD_LINES: u16 = 5;

pub(super) fn draw(frame: &mut Frame<'_>, seen: &Seen, prompt: &Prompt) {
    let area = frame.area();
    let cards = CARD_LINES * u16::try_from(seen.picture.trains.len()).unwrap_or(u16::MAX).max(1) + 1;
    let upper = if area.height >= HIGH { (area.height / 2).max(cards.min(area.height / 2)) } else { cards };
    let [head, upper, said, line] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(upper),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(area);
    head_line(frame, head, seen);
    if area.width >= WIDE && area.height >= HIGH {
        let [track, trains] =
            Layout::horizontal([Constraint::Min(20), Constraint::Length(CARD)]).areas(upper);
        draw_track(frame, track, seen);
        draw_trains(frame, trains, seen);
    } else {
        draw_trains(frame, upper, seen);
    }
    draw_said(frame, said, seen);
    draw_prompt(frame, line, prompt);
}

fn head_line(frame: &mut Frame<'_>, area: Rect, seen: &Seen) {
    let line = Line::from(vec![
        Span::from("Footplate ").bold(),
        Span::from(seen.layout.clone()),
        Span::from(format!("  {:.1} s", seen.picture.t_s)).dim(),
        Span::from("   space on an empty line: emergency stop").light_red(),
    ]);
    frame.render_widget(line, area);
}

fn draw_track(frame: &mut Frame<'_>, area: Rect, seen: &Seen) {
    let ends = || seen.rails.values().flat_map(|rail| [rail.from, rail.to]);
    let bounds = |axis: usize| {
        let least = ends().map(|end| end[axis]).fold(f64::INFINITY, f64::min);
        let most = ends().map(|end| end[axis]).fold(f64::NEG_INFINITY, f64::max);
        if least < most { [least, most] } else { [least, least + 1.0] }
    };
    // Screens count downwards, canvases upwards.
    let [top, foot] = bounds(1);
    let up = |y: f64| top + foot - y;
    let stroke = |context: &mut Context<'_>, [one, other]: [[f64; 2]; 2], color: Color| {
        context.draw(&Stroke { x1: one[0], y1: up(one[1]), x2: other[0], y2: up(other[1]), color });
    };
    let canvas = Canvas::default()
        .block(Block::bordered().title("track").dim())
        .marker(Marker::Braille)
        .x_bounds(bounds(0))
        .y_bounds([top, foot])
        .paint(|context| {
            for rail in seen.rails.values() {
                stroke(context, [rail.from, rail.to], Color::DarkGray);
            }
            let contacts: Vec<(f64, f64)> = seen.contacts.iter().map(|(x, y)| (*x, up(*y))).collect();
            context.draw(&Points { coords: &contacts, color: Color::Gray });
            context.layer();
            for (train, color) in seen.picture.trains.iter().zip(COLOURS.iter().cycle()) {
                for ends in train.body.iter().filter_map(|span| seen.ends(*span)) {
                    stroke(context, ends, *color);
                }
                if let Some([_, [x, y]]) = train.body.last().and_then(|span| seen.ends(*span)) {
                    context.print(x, up(y), Line::from(train.train.to_string()).fg(*color).bold());
                }
            }
        });
    frame.render_widget(canvas, area);
}

fn draw_trains(frame: &mut Frame<'_>, area: Rect, seen: &Seen) {
    let mut text = Text::default();
    for (train, color) in seen.picture.trains.iter().zip(COLOURS.iter().cycle()) {
        text.extend(card(train, seen, *color));
    }
    frame.render_widget(Paragraph::new(text).block(Block::bordered().title("trains").dim()), area);
}

/// The lines of a train.
fn card(train: &Train, seen: &Seen, color: Color) -> Vec<Line<'static>> {
    let plain = Style::new().not_dim();
    let place = match (&train.at, train.half_mm) {
        (Some(at), Some(half)) => format!("{at} ± {half:.0} mm"),
        _ => "position unknown".to_owned(),
    };
    let moves = match train.at {
        Some(_) if train.at_rest => "at rest".to_owned(),
        Some(_) => format!("{:.0} ± {:.0} mm/s", train.speed_mm_per_s, train.speed_half_mm_per_s),
        None => String::new(),
    };
    let passed = seen.passed.get(&train.train);
    let next = passed.and_then(|passed| passed.next.as_ref()).filter(|_| !train.at_rest).map_or_else(
        || "–".to_owned(),
        |next| {
            let left = (next.t_s - seen.picture.t_s).max(0.0);
            format!("{} in {left:.1} s ± {:.0} ms", next.contact, next.half_ms)
        },
    );
    let last = passed.map_or_else(
        || "–".to_owned(),
        |passed| match (passed.late_ms, passed.short_mm) {
            (Some(late), Some(short)) => format!("{} {late:+.0} ms, {:+.1} mm", passed.contact, -short),
            _ => format!("{}, found", passed.contact),
        },
    );
    let busy = train.doing.clone().map_or_else(String::new, |doing| {
        train.promise_mm.map_or_else(
            || doing.clone(),
            |[_, low, high]| format!("{doing}: rests {low:+.0} … {high:+.0} mm"),
        )
    });
    let row = |name: &'static str, value: String| {
        Line::from(vec![Span::from(format!("    {name:<5} ")).dim(), Span::styled(value, plain)])
    };
    vec![
        Line::from(vec![
            Span::from(format!("{:>3} ", train.train)).fg(color).bold().not_dim(),
            Span::styled(place, plain.bold()),
        ]),
        row("runs", format!("step {:<3} {moves}", train.step)),
        row("next", next),
        row("last", last),
        row("does", busy),
    ]
}

fn draw_said(frame: &mut Frame<'_>, area: Rect, seen: &Seen) {
    let room = usize::from(area.height.saturating_sub(2));
    let end = seen.lines.len() - seen.back.min(seen.lines.len());
    let shown = seen.lines.range(end.saturating_sub(room)..end);
    let lines: Vec<Line<'_>> = shown
        .map(|line| {
            let style = if line.starts_with('!') {
                Style::new().light_red().not_dim()
            } else if line.starts_with('>') {
                Style::new().dim()
            } else {
                Style::new().not_dim()
            };
            Line::styled(line.as_str(), style)
        })
        .collect();
    let title = if seen.back > 0 { "messages (page down for the newest)" } else { "said" };
    let said = Paragraph::new(lines).wrap(Wrap { trim: false }).block(Block::bordered().title(title).dim());
    frame.render_widget(said, area);
}

fn draw_prompt(frame: &mut Frame<'_>, area: Rect, prompt: &Prompt) {
    let text = prompt.text();
    let written = if text.is_empty() {
        Span::from("a command, such as `speed 24 8`; `help` lists them, `quit` ends").dim()
    } else {
        Span::from(text)
    };
    frame.render_widget(Line::from(vec![Span::from("> ").bold(), written]), area);
    let cursor = u16::try_from(prompt.cursor()).unwrap_or(u16::MAX);
    frame.set_cursor_position((
        area.x.saturating_add(2).saturating_add(cursor).min(area.right().saturating_sub(1)),
        area.y,
    ));
}
