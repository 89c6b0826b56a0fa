//! What the terminal view shows, collected from the board.

use std::collections::{BTreeMap, VecDeque};

use serde::Deserialize;

use crate::dashboard::{Board, LayoutPicture};

/// Messages kept for scrolling.
const LINES_KEPT: usize = 1_000;

/// Everything that is drawn.
pub(super) struct TerminalModel {
    pub(super) layout: String,
    /// Drawn edges by their number.
    pub(super) rails: BTreeMap<u16, Rail>,
    pub(super) sensors: Vec<Sensor>,
    pub(super) picture: Picture,
    /// The last detection of each train.
    pub(super) passed: BTreeMap<u16, Passed>,
    pub(super) lines: VecDeque<String>,
    /// How many messages the view is scrolled back by.
    pub(super) back: usize,
    /// The number of the next happening to read.
    next: u64,
}

/// A drawn sensor.
pub(super) struct Sensor {
    pub(super) name: String,
    pub(super) x: f64,
    pub(super) y: f64,
}

/// A drawn edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rail {
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
    pub(super) length_mm: f64,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Picture {
    pub(super) t_s: f64,
    pub(super) trains: Vec<Train>,
    /// The active alarms, the most severe first.
    pub(super) alarms: Vec<ActiveAlarm>,
}

#[derive(Debug, Deserialize)]
pub(super) struct ActiveAlarm {
    pub(super) grade: String,
    pub(super) text: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Train {
    pub(super) train: u16,
    pub(super) step: u8,
    pub(super) speed_mm_per_s: f64,
    pub(super) speed_half_mm_per_s: f64,
    pub(super) at: Option<String>,
    pub(super) half_mm: Option<f64>,
    pub(super) at_rest: bool,
    pub(super) body: Vec<Span>,
    pub(super) doing: Option<String>,
    pub(super) promise_mm: Option<[f64; 3]>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Span {
    edge: u16,
    from_mm: f64,
    to_mm: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Passed {
    train: u16,
    #[serde(rename = "contact")]
    pub(super) sensor: String,
    pub(super) late_ms: Option<f64>,
    pub(super) short_mm: Option<f64>,
    pub(super) next: Option<Due>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Due {
    #[serde(rename = "contact")]
    pub(super) sensor: String,
    pub(super) t_s: f64,
    pub(super) half_ms: f64,
}

#[derive(Deserialize)]
struct Line {
    text: String,
}

#[derive(Deserialize)]
struct Alarm {
    text: String,
    /// Whether a line of text says the same.
    is_said: bool,
}

#[derive(Deserialize)]
struct Drawn {
    name: String,
    nodes: Vec<Node>,
    edges: Vec<Edge>,
}

#[derive(Deserialize)]
struct Node {
    id: u16,
    name: String,
    kind: String,
    point: Option<[f64; 2]>,
}

#[derive(Deserialize)]
struct Edge {
    id: u16,
    from: u16,
    to: u16,
    length_mm: f64,
}

impl TerminalModel {
    /// # Errors
    /// The layout picture has another shape than browsers expect: a bug.
    pub(super) fn of(layout: &LayoutPicture) -> anyhow::Result<Self> {
        let Drawn { name, nodes, edges } = serde_json::from_value(serde_json::to_value(layout)?)?;
        let points: BTreeMap<u16, [f64; 2]> =
            nodes.iter().filter_map(|node| Some((node.id, node.point?))).collect();
        let rail = |edge: &Edge| {
            let (from, to) = (*points.get(&edge.from)?, *points.get(&edge.to)?);
            Some((edge.id, Rail { from, to, length_mm: edge.length_mm }))
        };
        let sensors = nodes.iter().filter(|node| node.kind == "contact");
        let sensor = |node: &Node| node.point.map(|[x, y]| Sensor { name: node.name.clone(), x, y });
        Ok(Self {
            layout: name,
            rails: edges.iter().filter_map(rail).collect(),
            sensors: sensors.filter_map(sensor).collect(),
            picture: Picture::default(),
            passed: BTreeMap::new(),
            lines: VecDeque::new(),
            back: 0,
            next: 0,
        })
    }

    /// Reads the news of the board.
    pub(super) fn look(&mut self, board: &Board) {
        // There is no picture before the first one is painted.
        if let Ok(picture) = serde_json::from_str(&board.pictures().borrow()) {
            self.picture = picture;
        }
        let (happened, _) = board.events_from(self.next);
        for happening in happened {
            self.next = happening.number + 1;
            match happening.kind {
                "line" => {
                    if let Ok(Line { text }) = serde_json::from_str(&happening.json) {
                        text.lines().for_each(|line| self.say(line.to_owned()));
                    }
                }
                "alarm" => {
                    if let Ok(Alarm { text, is_said: false }) = serde_json::from_str(&happening.json) {
                        self.say(format!("! {text}"));
                    }
                }
                "passed" => {
                    if let Ok(passed) = serde_json::from_str::<Passed>(&happening.json) {
                        self.passed.insert(passed.train, passed);
                    }
                }
                _ => {}
            }
        }
    }

    /// Appends a message.
    pub(super) fn say(&mut self, line: String) {
        self.lines.push_back(line);
        if self.lines.len() > LINES_KEPT {
            self.lines.pop_front();
        }
        // A view that is scrolled back keeps showing the same messages.
        if self.back > 0 {
            self.scroll(0);
            self.back = (self.back + 1).min(self.lines.len());
        }
    }

    /// Scrolls back by pages; negative towards the newest message.
    pub(super) fn scroll(&mut self, pages: isize) {
        const PAGE: isize = 5;
        self.back = self.back.saturating_add_signed(pages * PAGE).min(self.lines.len().saturating_sub(1));
    }

    /// The ends of a part of an edge, as drawn.
    pub(super) fn ends(&self, span: Span) -> Option<[[f64; 2]; 2]> {
        let rail = self.rails.get(&span.edge)?;
        let at = |mm: f64| {
            let part = if rail.length_mm > 0.0 { (mm / rail.length_mm).clamp(0.0, 1.0) } else { 0.0 };
            [0, 1].map(|axis| rail.from[axis] + part * (rail.to[axis] - rail.from[axis]))
        };
        Some([at(span.from_mm), at(span.to_mm)])
    }
}
