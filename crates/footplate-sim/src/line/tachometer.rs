//! A toothed wheel and its sensors: where the edges really are, and when they come.
//!
//! ```text
//! phase = M angle / 2 pi + phase0 + 0.02 sin(angle + at) + error of the tooth       (in pitches)
//! ```

use core::f64::consts::TAU;

use crate::draws::Draws;

/// The wheel sits so far from its centre that the pitch wanders once a turn by this part of a pitch.
const ECCENTRICITY: f64 = 0.02;
/// Spread of the teeth (parts of a pitch, one standard deviation), and how far the worst is off (deviations).
const TOOTH_SPREAD: f64 = 0.005;
const WORST_TOOTH: f64 = 3.0;
/// Jitter of the time stamps: drawn from these (s, one standard deviation).
const JITTER_S: (f64, f64) = (5e-6, 20e-6);
/// While the train stands, an edge within this part of a pitch can toggle ...
const SHAKEN: f64 = 0.03;
/// ... so often (1/s).
const TOGGLES_PER_S: f64 = 0.5;
/// Slower than this it stands (m/s of the tread, roughly: pitches are 10 to 40 mm).
const STANDING_PITCHES_PER_S: f64 = 0.01;

/// What one tachometer saw in a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Edges {
    /// Teeth that went by forward.
    pub(crate) forward: i64,
    /// Teeth that went by backward.
    pub(crate) backward: i64,
    /// When the last one came, with jitter (s).
    pub(crate) last: Option<f64>,
    /// How fast teeth went by at the end (1/s, backward negative).
    pub(crate) rate: f64,
}

/// The tachometer of one wheelset.
#[derive(Debug, Clone)]
pub(crate) struct Tachometer {
    errors: Vec<f64>,
    phase0: f64,
    eccentric_at: f64,
    jitter: f64,
    missing: Option<i64>,
    angle: f64,
    edge: i64,
    seen: Edges,
    /// 1 or −1 while shaking has taken the wheel over an edge, forward or backward.
    toggled: i64,
    draws: Draws,
}

impl Tachometer {
    /// A tachometer with so many teeth on a wheelset that stands at an angle (rad).
    pub(crate) fn draw(teeth: u32, angle: f64, draws: &mut Draws) -> Self {
        let mut draws = draws.split();
        let errors = (0..teeth.max(1)).map(|_| draws.normal_within(0.0, TOOTH_SPREAD, WORST_TOOTH)).collect();
        let mut drawn = Self {
            errors,
            phase0: draws.uniform(0.0..1.0),
            eccentric_at: draws.uniform(0.0..TAU),
            jitter: draws.uniform(JITTER_S.0..JITTER_S.1),
            missing: None,
            angle,
            edge: 0,
            seen: Edges::default(),
            toggled: 0,
            draws,
        };
        drawn.edge = drawn.edge_below(drawn.phase(angle));
        drawn
    }

    /// The same with a tooth broken off.
    pub(crate) fn without_a_tooth(mut self) -> Self {
        self.missing = Some(self.draws.below(self.errors.len()) as i64);
        self
    }

    fn phase(&self, angle: f64) -> f64 {
        angle * (self.errors.len() as f64 / TAU)
            + self.phase0
            + ECCENTRICITY * libm::sin(angle + self.eccentric_at)
    }

    fn tooth(&self, edge: i64) -> i64 {
        edge.rem_euclid(self.errors.len() as i64)
    }

    /// Where an edge is (pitches).
    fn place(&self, edge: i64) -> f64 {
        edge as f64 + self.errors[self.tooth(edge) as usize]
    }

    /// The last edge at or below a phase.
    fn edge_below(&self, phase: f64) -> i64 {
        let near = phase.floor() as i64;
        if phase < self.place(near) {
            near - 1
        } else if phase >= self.place(near + 1) {
            near + 1
        } else {
            near
        }
    }

    /// How many of the edges after one up to another have a tooth.
    fn teeth_between(&self, low: i64, high: i64) -> i64 {
        let all = high - low;
        let Some(missing) = self.missing else { return all };
        let teeth = self.errors.len() as i64;
        let turns = |edge: i64| (edge - missing).div_euclid(teeth);
        all - (turns(high) - turns(low))
    }

    /// Follows the wheel, which turned evenly to an angle (rad) from `from` to `to` (s).
    pub(crate) fn follow(&mut self, angle: f64, from: f64, to: f64) {
        let (start, end) = (self.phase(self.angle), self.phase(angle));
        self.angle = angle;
        self.seen.rate = (end - start) / (to - from);
        let edge = self.edge_below(end);
        if edge == self.edge {
            return;
        }
        // What was shaken over an edge comes back before it really goes.
        match core::mem::take(&mut self.toggled) {
            1 => self.seen.backward += 1,
            -1 => self.seen.forward += 1,
            _ => {}
        }
        let crossed = if edge > self.edge {
            self.seen.forward += self.teeth_between(self.edge, edge);
            edge
        } else {
            self.seen.backward += self.teeth_between(edge, self.edge);
            edge + 1
        };
        self.edge = edge;
        if self.missing != Some(self.tooth(crossed)) {
            let part = ((self.place(crossed) - start) / (end - start)).clamp(0.0, 1.0);
            self.seen.last = Some(from + part * (to - from));
        }
    }

    /// What was seen since it was read last; `period` seconds ago, at `time` now.
    pub(crate) fn read(&mut self, period: f64, time: f64) -> Edges {
        let mut seen = core::mem::take(&mut self.seen);
        if seen.rate.abs() < STANDING_PITCHES_PER_S {
            self.shake(&mut seen, period, time);
        }
        let jitter = self.draws.normal(0.0, self.jitter);
        seen.last = seen.last.map(|last| (last + jitter).min(time));
        seen
    }

    /// A compressor or a fan shakes the wheel that stands, and with it an edge that is close by.
    fn shake(&mut self, seen: &mut Edges, period: f64, time: f64) {
        let phase = self.phase(self.angle);
        let above = phase - self.place(self.edge) < SHAKEN;
        let below = self.place(self.edge + 1) - phase < SHAKEN;
        if !(above || below || self.toggled != 0) || !self.draws.chance(TOGGLES_PER_S * period) {
            return;
        }
        // Away over the edge, and back the next time.
        let turned = match self.toggled {
            0 if below => 1,
            0 => -1,
            away => -away,
        };
        if turned > 0 {
            seen.forward += 1;
        } else {
            seen.backward += 1;
        }
        self.toggled += turned;
        seen.last = Some(time - self.draws.uniform(0.0..period));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    fn tachometer(teeth: u32) -> Tachometer {
        Tachometer::draw(teeth, 0.0, &mut Draws::new(5, Purpose::Motion))
    }

    #[test]
    fn every_turn_has_as_many_pulses_as_teeth_and_one_less_without_a_tooth() {
        for teeth in [80, 100, 200] {
            for (mut sensor, per_turn) in
                [(tachometer(teeth), teeth), (tachometer(teeth).without_a_tooth(), teeth - 1)]
            {
                let mut pulses = 0;
                let mut time = 0.0;
                for step in 1..=3000 {
                    // Twelve turns forward.
                    sensor.follow(TAU * 12.0 * f64::from(step) / 3000.0, time, time + 0.005);
                    time += 0.005;
                    if step % 10 == 0 {
                        let edges = sensor.read(0.05, time);
                        pulses += edges.forward;
                        assert_eq!(edges.backward, 0);
                    }
                }
                assert_eq!(pulses, 12 * i64::from(per_turn));
            }
        }
    }

    #[test]
    fn time_stamps_are_where_the_edges_are() {
        let mut sensor = tachometer(100);
        let (mut time, mut last, mut gaps) = (0.0, None, Vec::new());
        // 200 pulses a second, read every pulse or so.
        for step in 1..=4000 {
            sensor.follow(TAU * 2.0 * f64::from(step) * 0.005, time, time + 0.005);
            time += 0.005;
            let edges = sensor.read(0.005, time);
            if let (Some(last), Some(now), 1) = (last, edges.last, edges.forward) {
                gaps.push(now - last);
            }
            last = edges.last;
        }
        let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        assert!((mean - 0.005).abs() < 2e-5, "{mean}");
        let worst = gaps.iter().map(|gap| (gap - 0.005).abs()).fold(0.0, f64::max);
        // Two teeth of at most 1.5 % each, a little eccentricity, and jitter of at most 20 us five times over.
        assert!(worst < 0.005 * (0.03 + 0.0013) + 1.5e-4, "{worst}");
        assert!(worst > 0.005 * 0.008, "teeth differ");
    }

    #[test]
    fn backward_pulses_are_distinguished_from_forward_ones() {
        let mut sensor = tachometer(80);
        sensor.follow(TAU, 0.0, 1.0);
        sensor.follow(0.0, 1.0, 2.0);
        let edges = sensor.read(2.0, 2.0);
        assert_eq!((edges.forward, edges.backward), (80, 80));
    }

    #[test]
    fn a_wheel_that_stands_near_an_edge_chatters_there_and_back() {
        let (mut chattering, mut seen) = (0, 0);
        for seed in 0..400 {
            let mut sensor = Tachometer::draw(80, 0.0, &mut Draws::new(seed, Purpose::Motion));
            let (mut net, mut total) = (0, 0);
            for step in 0..200 {
                let time = 0.05 * f64::from(step);
                sensor.follow(0.0, time, time + 0.05);
                let edges = sensor.read(0.05, time + 0.05);
                net += edges.forward - edges.backward;
                total += edges.forward + edges.backward;
                assert!(net.abs() <= 1);
            }
            chattering += usize::from(total > 0);
            seen += total;
        }
        // 6 of 100 stand within 3 % of a pitch of an edge, and toggle every other second for 10 s.
        assert!((10..=40).contains(&chattering), "{chattering}");
        assert!((3.5..7.0).contains(&(seen as f64 / chattering as f64)));
    }
}
