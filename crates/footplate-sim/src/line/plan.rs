//! What the driver of a scenario does, stage by stage.

/// What the driver asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Handle {
    /// This effort: −1 full brake, 0 nothing, 1 full traction.
    At(f64),
    /// Whatever keeps this speed (m/s).
    Keep(f64),
}

/// When a stage is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Until {
    /// At a time since the first sample (s).
    Time(f64),
    /// After a time in this stage (s).
    For(f64),
    /// When the train is at least so fast (m/s), in either direction.
    Faster(f64),
    /// When it is at most so fast (m/s), in either direction.
    Slower(f64),
}

/// A stage of a journey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stage {
    /// What the driver asks for.
    pub(crate) handle: Handle,
    /// Until when.
    pub(crate) until: Until,
    /// Whether traction drives backwards.
    pub(crate) backwards: bool,
}

impl Stage {
    /// A stage that runs forward.
    pub(crate) const fn new(handle: Handle, until: Until) -> Self {
        Self { handle, until, backwards: false }
    }

    /// The same, backwards.
    pub(crate) const fn backwards(self) -> Self {
        Self { backwards: true, ..self }
    }
}

/// Effort for each m/s that is missing, and for each m that has been lost: a patient driver.
const PER_M_PER_S: f64 = 0.35;
const PER_M: f64 = 0.03;
/// How much the second may add up to.
const LARGEST_TRIM: f64 = 0.6;

/// A driver in one of the stages; stays in the last.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    stages: Vec<Stage>,
    at: usize,
    /// When the stage began (s); before its first step, not yet.
    begun: Option<f64>,
    trim: f64,
}

impl Plan {
    /// A plan whose first stage begins with its first step.
    pub(crate) fn new(stages: Vec<Stage>) -> Self {
        Self { stages, at: 0, begun: None, trim: 0.0 }
    }

    /// The effort asked for after `dt` more seconds, and whether traction drives backwards.
    pub(crate) fn step(&mut self, dt: f64, time: f64, speed: f64) -> (f64, bool) {
        self.begun.get_or_insert(time);
        while self.at + 1 < self.stages.len() && self.is_over(time, speed.abs()) {
            self.at += 1;
            self.begun = Some(time);
            self.trim = 0.0;
        }
        let Some(stage) = self.stages.get(self.at) else { return (0.0, false) };
        let effort = match stage.handle {
            Handle::At(effort) => effort,
            Handle::Keep(wanted) => {
                let missing = wanted - if stage.backwards { -speed } else { speed };
                let effort = PER_M_PER_S * missing + self.trim;
                // No adding up while the handle is at its end.
                if effort.abs() < 1.0 {
                    self.trim = (self.trim + PER_M * missing * dt).clamp(-LARGEST_TRIM, LARGEST_TRIM);
                }
                effort.clamp(-1.0, 1.0)
            }
        };
        (effort, stage.backwards)
    }

    fn is_over(&self, time: f64, speed: f64) -> bool {
        match self.stages[self.at].until {
            Until::Time(until) => time >= until,
            Until::For(span) => self.begun.is_some_and(|begun| time - begun >= span),
            Until::Faster(until) => speed >= until,
            Until::Slower(until) => speed <= until,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_follow_each_other_and_the_last_one_stays() {
        let stages = vec![
            Stage::new(Handle::At(1.0), Until::Faster(10.0)),
            Stage::new(Handle::At(0.0), Until::For(5.0)),
            Stage::new(Handle::At(-0.5), Until::Slower(0.0)).backwards(),
        ];
        let mut plan = Plan::new(stages);
        assert_eq!(plan.step(0.1, 1.0, 4.0), (1.0, false));
        assert_eq!(plan.step(0.1, 8.0, 10.1), (0.0, false));
        assert_eq!(plan.step(0.1, 12.9, 10.0), (0.0, false));
        assert_eq!(plan.step(0.1, 13.0, 10.0), (-0.5, true));
        assert_eq!(plan.step(0.1, 99.0, 0.0), (-0.5, true));
    }

    #[test]
    fn a_speed_is_kept_against_a_steady_pull() {
        // 1 m/s² at full effort, 0.1 m/s² lost.
        let mut plan = Plan::new(vec![Stage::new(Handle::Keep(20.0), Until::Time(1e9))]);
        let mut speed = 18.0;
        for step in 0..20_000 {
            let (effort, _) = plan.step(0.01, 0.01 * f64::from(step), speed);
            speed += 0.01 * (effort - 0.1);
        }
        assert!((speed - 20.0).abs() < 0.01, "{speed}");
    }
}
