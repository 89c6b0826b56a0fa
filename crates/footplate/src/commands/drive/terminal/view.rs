//! Draws the terminal view: track, one card per train, messages and prompt.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke, Points};
use ratatui::widgets::{Block, Paragraph, Wrap};

use super::prompt::Prompt;
use super::view_model::{Sensor, TerminalModel, Train};

/// Colours of trains, in their order.
const TRAIN_COLOURS: [Color; 6] =
    [Color::LightBlue, Color::LightRed, Color::LightMagenta, Color::LightGreen, Color::Yellow, Color::Cyan];
/// The least width, in characters, that shows the track beside the trains.
const TRACK_FROM_WIDTH: u16 = 90;
/// The least height, in lines, that shows the track.
const TRACK_FROM_HEIGHT: u16 = 20;
/// The width of a train's card, in characters.
const CARD: u16 = 46;
/// The most alarms that are shown above the track.
const ALARM_LINES: usize = 3;
/// The height of a train's card, in lines.
const CARD_LINES: u16 = 5;

pub(super) fn draw(frame: &mut Frame<'_>, model: &TerminalModel, prompt: &Prompt) {
    let area = frame.area();
    let cards = CARD_LINES * u16::try_from(model.picture.trains.len()).unwrap_or(u16::MAX).max(1) + 1;
    let upper = if area.height >= TRACK_FROM_HEIGHT {
        (area.height / 2).max(cards.min(area.height / 2))
    } else {
        cards
    };
    let shown = model.picture.alarms.len().min(ALARM_LINES);
    let [head, alarms, upper, messages, line] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(u16::try_from(shown).unwrap_or_default()),
        Constraint::Length(upper),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(area);
    head_line(frame, head, model);
    draw_alarms(frame, alarms, model);
    if area.width >= TRACK_FROM_WIDTH && area.height >= TRACK_FROM_HEIGHT {
        let [track, trains] =
            Layout::horizontal([Constraint::Min(20), Constraint::Length(CARD)]).areas(upper);
        draw_track(frame, track, model);
        draw_trains(frame, trains, model);
    } else {
        draw_trains(frame, upper, model);
        let needs = format!("track: from {TRACK_FROM_WIDTH} \u{d7} {TRACK_FROM_HEIGHT} characters");
        draw_note(frame, upper, &needs);
    }
    draw_messages(frame, messages, model);
    draw_prompt(frame, line, prompt);
}

/// A note in the upper right corner of a bordered area.
fn draw_note(frame: &mut Frame<'_>, area: Rect, note: &str) {
    let width = u16::try_from(note.chars().count()).unwrap_or(u16::MAX);
    if area.height > 0 && area.width > width.saturating_add(12) {
        let at = Rect { x: area.right() - width - 2, width, height: 1, ..area };
        frame.render_widget(Line::from(note).dim(), at);
    }
}

fn head_line(frame: &mut Frame<'_>, area: Rect, model: &TerminalModel) {
    let line = Line::from(vec![
        Span::from("Footplate ").bold(),
        Span::from(model.layout.clone()),
        Span::from(format!("  {:.1} s", model.picture.t_s)).dim(),
        Span::from("   space on an empty line: emergency stop").light_red(),
    ]);
    frame.render_widget(line, area);
}

/// The active alarms, a line each; the last line counts those that have no room.
fn draw_alarms(frame: &mut Frame<'_>, area: Rect, model: &TerminalModel) {
    let alarms = &model.picture.alarms;
    let beyond = alarms.len().saturating_sub(ALARM_LINES);
    let lines: Vec<Line<'_>> = alarms
        .iter()
        .take(ALARM_LINES)
        .enumerate()
        .map(|(nth, alarm)| {
            let more = if beyond > 0 && nth + 1 == ALARM_LINES {
                format!("  (and {beyond} more)")
            } else {
                String::new()
            };
            let color = if alarm.grade == "danger" { Color::LightRed } else { Color::LightYellow };
            Line::from(format!("! {}{more}", alarm.text)).fg(color).bold()
        })
        .collect();
    frame.render_widget(Paragraph::new(lines), area);
}

fn draw_track(frame: &mut Frame<'_>, area: Rect, model: &TerminalModel) {
    let ends = || model.rails.values().flat_map(|rail| [rail.from, rail.to]);
    let bounds = |axis: usize| {
        let least = ends().map(|end| end[axis]).fold(f64::INFINITY, f64::min);
        let most = ends().map(|end| end[axis]).fold(f64::NEG_INFINITY, f64::max);
        if least < most { [least, most] } else { [least, least + 1.0] }
    };
    // The canvas counts upwards, pictures downwards.
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
            for rail in model.rails.values() {
                stroke(context, [rail.from, rail.to], Color::DarkGray);
            }
            let sensors: Vec<(f64, f64)> =
                model.sensors.iter().map(|sensor| (sensor.x, up(sensor.y))).collect();
            context.draw(&Points { coords: &sensors, color: Color::Gray });
            for sensor in readable(&model.sensors, bounds(0), [top, foot], area) {
                context.print(sensor.x, up(sensor.y), Line::from(sensor.name.clone()).dim());
            }
            context.layer();
            for (train, color) in model.picture.trains.iter().zip(TRAIN_COLOURS.iter().cycle()) {
                for ends in train.body.iter().filter_map(|span| model.ends(*span)) {
                    stroke(context, ends, *color);
                }
                if let Some([_, [x, y]]) = train.body.last().and_then(|span| model.ends(*span)) {
                    context.print(x, up(y), Line::from(train.train.to_string()).fg(*color).bold());
                }
            }
        });
    frame.render_widget(canvas, area);
}

/// The sensors whose names have room: a name that would cover another is left out.
fn readable(
    sensors: &[Sensor],
    [left, right]: [f64; 2],
    [top, foot]: [f64; 2],
    area: Rect,
) -> impl Iterator<Item = &Sensor> {
    let mut taken: Vec<(i64, i64, i64)> = Vec::new();
    let cell = |value: f64, from: f64, to: f64, cells: u16| {
        ((value - from) / (to - from).max(1.0) * f64::from(cells.saturating_sub(3))) as i64
    };
    sensors.iter().filter(move |sensor| {
        let (x, y) = (cell(sensor.x, left, right, area.width), cell(sensor.y, top, foot, area.height));
        let end = x + i64::try_from(sensor.name.len()).unwrap_or(i64::MAX - x);
        let is_free = taken.iter().all(|(from, to, row)| *row != y || end < *from || *to < x);
        if is_free {
            taken.push((x, end, y));
        }
        is_free
    })
}

fn draw_trains(frame: &mut Frame<'_>, area: Rect, model: &TerminalModel) {
    let mut text = Text::default();
    for (train, color) in model.picture.trains.iter().zip(TRAIN_COLOURS.iter().cycle()) {
        text.extend(card(train, model, *color));
    }
    frame.render_widget(Paragraph::new(text).block(Block::bordered().title("trains").dim()), area);
}

/// The card of a train.
fn card(train: &Train, model: &TerminalModel, color: Color) -> Vec<Line<'static>> {
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
    let passed = model.passed.get(&train.train);
    let next = passed.and_then(|passed| passed.next.as_ref()).filter(|_| !train.at_rest).map_or_else(
        || "–".to_owned(),
        |next| {
            let left = (next.t_s - model.picture.t_s).max(0.0);
            format!("{} in {left:.1} s ± {:.0} ms", next.sensor, next.half_ms)
        },
    );
    let last = passed.map_or_else(
        || "–".to_owned(),
        |passed| match (passed.late_ms, passed.short_mm) {
            (Some(late), Some(short)) => format!("{} {late:+.0} ms, {:+.1} mm", passed.sensor, -short),
            _ => format!("{}, found", passed.sensor),
        },
    );
    let idle = || if train.step == 0 { "nothing: at rest".to_owned() } else { "runs on".to_owned() };
    let busy = train.doing.clone().map_or_else(idle, |doing| {
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

fn draw_messages(frame: &mut Frame<'_>, area: Rect, model: &TerminalModel) {
    let room = usize::from(area.height.saturating_sub(2));
    let end = model.lines.len() - model.back.min(model.lines.len());
    let shown = model.lines.range(end.saturating_sub(room)..end);
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
    let title = if model.back > 0 { "messages (page down for the newest)" } else { "messages" };
    let paragraph =
        Paragraph::new(lines).wrap(Wrap { trim: false }).block(Block::bordered().title(title).dim());
    frame.render_widget(paragraph, area);
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
