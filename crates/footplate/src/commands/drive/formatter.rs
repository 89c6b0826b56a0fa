//! Formats the notices of driver, watchdog and dispatcher as one line of text each.

use footplate_core::control::{
    Driver, Finished, Notice, Order, Outcome, PlannedArrival, PlannedStop, Refusal,
};
use footplate_core::track::Landmark;
use footplate_core::tracking::{DueSensor, PassedSensor};
use footplate_core::{HALF_95, Length, SensorId, Timestamp, TrainId};

use super::instruction::Instruction;

/// Formats notices with the names of the layout and with times since the session began.
pub(in crate::commands) struct NoticeFormatter<'d> {
    pub(in crate::commands) driver: &'d Driver,
    pub(in crate::commands) began: Timestamp,
}

/// The first word of an instruction.
pub(super) const fn verb(instruction: &Instruction) -> &'static str {
    match instruction {
        Instruction::Order(Order::Speed { .. }) => "speed",
        Instruction::Order(Order::Reverse { .. }) => "reverse",
        Instruction::Order(Order::Turnout { .. }) | Instruction::Straighten => "turnout",
        Instruction::Order(Order::Stop(_)) => "stop",
        Instruction::Go(..) => "go",
        Instruction::Order(Order::Move { .. }) => "move",
        Instruction::Order(Order::Hold { .. }) => "hold",
        Instruction::Order(Order::Follow { .. }) => "follow",
        Instruction::Order(Order::Arrive { .. }) => "arrive",
        Instruction::Find(_) => "find",
        Instruction::Place(..) => "place",
        Instruction::Length(..) => "length",
        Instruction::Function(..) => "function",
        Instruction::Halt => "halt",
        Instruction::PowerOn => "power",
        Instruction::Where(_) => "where",
        Instruction::Wait(_) => "wait",
        Instruction::ListSchedules | Instruction::RunSchedule(_) | Instruction::EndSchedule(_) => "schedule",
        Instruction::Help => "help",
        Instruction::Quit => "quit",
    }
}

impl NoticeFormatter<'_> {
    pub(super) fn sensor(&self, sensor: SensorId) -> &str {
        self.driver.layout().sensor_name(sensor)
    }

    fn at(&self, time: Timestamp) -> String {
        format!("{:9.3} s", (time - self.began).as_s())
    }

    /// A place as sensor and offset, rounded to a millimetre.
    pub(super) fn place(&self, at: Landmark) -> String {
        let name = self.driver.layout().node_name(at.node);
        let mm = at.offset.as_mm().round();
        if mm == 0.0 { name.to_owned() } else { format!("{name}{mm:+}mm") }
    }

    /// Position and speed of a train, with 95 % intervals.
    pub(super) fn whereabouts(&self, train: TrainId, now: Timestamp) -> String {
        let Some(located) = self.driver.locate(train, now) else {
            return format!("train {train}: position unknown; run it over a sensor first");
        };
        let place = self.driver.landmark(train, located.at).map_or_else(|| "?".into(), |at| self.place(at));
        let half = HALF_95 * located.uncertainty.as_mm();
        let moves = if located.at_rest {
            "at rest".to_owned()
        } else {
            let (speed, half_speed) =
                (located.speed.as_mm_per_s(), HALF_95 * located.speed_uncertainty.as_mm_per_s());
            format!("{speed:.0} \u{b1} {half_speed:.0} mm/s at step {}", located.step)
        };
        format!("train {train}: {place} \u{b1} {half:.0} mm (95 %), {moves}")
    }

    /// Position and speed of all trains in one short line, for the line above the prompt.
    pub(super) fn status(&self, now: Timestamp) -> String {
        let train = |train: TrainId| {
            let Some(located) = self.driver.locate(train, now) else { return format!("{train} ?") };
            let place =
                self.driver.landmark(train, located.at).map_or_else(|| "?".into(), |at| self.place(at));
            let (speed, half) = (located.speed.as_mm_per_s(), HALF_95 * located.uncertainty.as_mm());
            format!("{train} {place} \u{b1}{half:.0} mm {speed:.0} mm/s")
        };
        self.driver.trains().map(train).collect::<Vec<_>>().join(", ")
    }

    /// A notice as one line; `None` if another notice or the result of the order already says it.
    pub(in crate::commands) fn line(&self, notice: &Notice) -> Option<String> {
        Some(match notice {
            Notice::Passed { train, passed, next } => self.passed(*train, passed, next.as_ref()),
            Notice::Planned(plan) => self.planned(plan),
            Notice::Overshoots { train, by, .. } => {
                format!(
                    "train {train} comes to rest about {:.0} mm beyond the target: it was closer than \
                     estimated",
                    by.as_mm()
                )
            }
            Notice::Paced(line) => format!(
                "{}  train {} holds {:.0} mm/s from here on",
                self.at(line.time),
                line.train,
                line.speed.as_mm_per_s()
            ),
            Notice::Arrives(plan) => self.arrives(plan),
            Notice::HeldBack { train, leader, .. } => {
                format!(
                    "train {train} is held back: it would come too close to train {leader}, or the \
                     position of that train is unknown"
                )
            }
            Notice::SpeedLimited { train, step, zone, limit } => format!(
                "train {train} runs at step {step}: zone {zone} allows {:.0} mm/s",
                limit.as_mm_per_s()
            ),
            Notice::Done(finished) => self.done(finished)?,
            Notice::TurnoutThrown { turnout, curved, .. } => {
                format!("turnout {turnout} set {}", leg(*curved))
            }
            Notice::TurnoutMismatch { turnout, curved, train } => {
                format!("turnout {turnout} is {}: train {train} took that leg", leg(*curved))
            }
            Notice::Overdue { train, sensor, by } => format!(
                "train {train} should have passed {} {:.1} s ago: a missed detection, or the train has \
                 stopped",
                self.sensor(*sensor),
                by.as_s()
            ),
            Notice::SpeedReportsIgnored { train } => format!(
                "the speeds that the decoder of train {train} reports contradict the sensors: they are ignored from now on; check its \
                 RailCom settings"
            ),
            Notice::TrackEnds { train, end } => {
                let end = self.driver.layout().node_name(*end);
                format!("train {train} stopped: the track ends at {end}")
            }
            Notice::AuthorityEnds { train } => {
                format!("train {train} stopped: the track ahead is not reserved for it")
            }
            Notice::Lost { train } => {
                format!(
                    "position of train {train} lost, train stopped: check the train, then run it \
                         over a sensor"
                )
            }
            Notice::Ambiguous { sensor, time, likeliest, or } => {
                let or = or.map_or_else(|| "by no train at all".into(), |other| format!("by train {other}"));
                format!(
                    "{}  {} was reported by train {likeliest} or {or}: the next reports decide",
                    self.at(*time),
                    self.sensor(*sensor)
                )
            }
            Notice::EitherDirection { train, sensor, time } => format!(
                "{}  {} was reported by train {train}: the next sensor shows its direction",
                self.at(*time),
                self.sensor(*sensor)
            ),
            Notice::SensorStuck { sensor } => format!(
                "{} reports repeatedly where no train can be: it is ignored until it behaves",
                self.sensor(*sensor)
            ),
            Notice::SensorRestored { sensor } => {
                format!("{} has behaved for a while and is used again", self.sensor(*sensor))
            }
            Notice::Unexplained { sensor, time } => format!(
                "{}  {} reported, but no train can have been there",
                self.at(*time),
                self.sensor(*sensor)
            ),
            Notice::UnauthorisedMovement { from, to, stopped } => format!(
                "something moves from {} to {} that Footplate does not drive; stopped: {}; check the track, then \
                 enter `power on`, or `place` the train that it is",
                self.sensor(*from),
                self.sensor(*to),
                trains(stopped)
            ),
            Notice::Unconfirmed { command } => format!("not confirmed as sent: {command}"),
            // The result of the order says both.
            Notice::Replaced { .. } | Notice::GivenUp { .. } => return None,
            Notice::RouteSet { train, takes, turns } => {
                let turns = match turns {
                    0 => String::new(),
                    1 => ", reversing once".to_owned(),
                    more => format!(", reversing {more} times"),
                };
                format!("route set for train {train}: about {:.0} s{turns}", takes.as_s())
            }
            Notice::Waits { train, on } => {
                format!("train {train} waits for track that is reserved for {}", trains(on))
            }
            Notice::Deadlocked { train } => format!(
                "train {train} is in a deadlock: no train can make room for another; move one by hand, then \
                 enter `place` with its new position"
            ),
            Notice::Deadlock { train, moves } if moves.is_empty() => {
                format!(
                    "train {train} is in a deadlock that no train can resolve from its place: one \
                         is sent elsewhere"
                )
            }
            Notice::Deadlock { train, moves } => {
                let mut others: Vec<TrainId> = Vec::new();
                for mover in moves.iter().filter(|mover| **mover != *train) {
                    if !others.contains(mover) {
                        others.push(*mover);
                    }
                }
                match others.as_slice() {
                    [] => format!("train {train} is in a deadlock: it moves elsewhere first"),
                    [_] => format!("train {train} is in a deadlock: {} makes room", trains(&others)),
                    _ => format!("train {train} is in a deadlock: {} make room", trains(&others)),
                }
            }
            Notice::StepsAside { train, makes_room_for, to } if train == makes_room_for => format!(
                "train {train} moves to {} first, so that the next search for a path begins from other places",
                self.place(*to)
            ),
            Notice::StepsAside { train, makes_room_for, to } => {
                format!("train {train} moves to {} to make room for train {makes_room_for}", self.place(*to))
            }
            // The refusal of the order has said that already.
            Notice::Withdrawn { why: Some(Refusal::Unreachable { .. }), .. } => return None,
            Notice::Withdrawn { train, why } => {
                let why = why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
                format!("train {train} does not start yet{why}; Footplate tries again")
            }
            Notice::Arrived { train, took, .. } => {
                format!("train {train} has arrived after {:.1} s", took.as_s())
            }
            Notice::Diverged { train, stopped } if stopped.is_empty() => {
                format!("train {train} left its reserved route: stopped")
            }
            Notice::Diverged { train, stopped } => format!(
                "train {train} left its reserved route: stopped, with the trains it could meet: {}",
                trains(stopped)
            ),
            Notice::ReservedAsUnknown { train } => {
                format!("no train is sent onto track where train {train} may be")
            }
            other => return supervised(other),
        })
    }

    fn passed(&self, train: TrainId, passed: &PassedSensor, next: Option<&DueSensor>) -> String {
        let middle = passed.window.middle();
        let mut line = format!("{}  train {train} at {}", self.at(middle), self.sensor(passed.sensor));
        match (passed.late, passed.short) {
            (Some([late, _]), short) => {
                let by = if late.as_ms() < 0.0 { "early" } else { "late" };
                line += &format!(", {:.0} ms {by}", late.as_ms().abs());
                if let Some(short) = short {
                    line += &format!(" ({:.1} mm)", short.as_mm().abs());
                }
                line += &format!(", predicted {:.3} s", (middle - late - self.began).as_s());
            }
            (None, _) => line += ", found",
        }
        if passed.missed > 0 {
            line += &format!(", {} missed before", passed.missed);
        }
        if let Some(next) = next {
            let (time, half) = ((next.time - self.began).as_s(), 1_960.0 * next.uncertainty.as_s());
            line += &format!("; next {} at {time:.3} s \u{b1} {half:.0} ms", self.sensor(next.sensor));
        }
        line
    }

    fn planned(&self, plan: &PlannedStop) -> String {
        let mut line = format!("{}  train {} will be commanded to stop", self.at(plan.leaves), plan.train);
        if let (Some(sensor), Some(after)) = (plan.trigger, plan.after_trigger) {
            line += &format!(", {:.3} s after {}", after.as_s(), self.sensor(sensor));
        }
        let promise = plan.promise;
        line + &format!("; rests at {:+.0} mm to {:+.0} mm (95 %)", promise.low.as_mm(), promise.high.as_mm())
    }

    fn arrives(&self, plan: &PlannedArrival) -> String {
        let mut line = format!("{}  train {} will be at rest there", self.at(plan.by), plan.train);
        if let Some((at, step)) = plan.starts {
            line += &format!("; starts at step {step} at {:.1} s", (at - self.began).as_s());
        }
        if let Some(profile) = plan.profile {
            let how = if profile.has_least_jerk() { "with minimum jerk" } else { "through a steady speed" };
            let (from, to) = (profile.at(profile.begins()).1, profile.at(profile.ends()).1);
            line += &format!(
                ", {how} from {:.0} to {:.0} mm/s, and stops from step {}",
                from.as_mm_per_s(),
                to.as_mm_per_s(),
                profile.last_step()
            );
        }
        line
    }

    fn done(&self, finished: &Finished) -> Option<String> {
        let achieved = finished.achieved?;
        let mut line = format!(
            "{}  train {} at {} \u{b1} {:.0} mm",
            self.at(finished.time),
            finished.train,
            self.place(achieved.at),
            HALF_95 * achieved.uncertainty.as_mm()
        );
        if let Some(error) = achieved.error {
            line += &format!(", {:+.1} mm from the target", error.as_mm());
        }
        if let Some(promise) = finished.promise {
            line +=
                &format!(" (predicted {:+.0} mm to {:+.0} mm)", promise.low.as_mm(), promise.high.as_mm());
        }
        if let Some(sensor) = finished.unseen {
            line += &format!("; {} should have reported it and did not", self.sensor(sensor));
        }
        Some(line)
    }
}

/// A notice of the watchdog as one line; `None` for other notices.
fn supervised(notice: &Notice) -> Option<String> {
    Some(match notice {
        Notice::Danger { train, why, stopped, .. } if stopped.is_empty() => {
            format!("train {train} stopped: {why}")
        }
        Notice::Danger { train, why, stopped, .. } => format!(
            "train {train} stopped: {why}; also stopped, because they could meet it: {}",
            trains(stopped)
        ),
        Notice::PowerOff { train } => format!("track power off: train {train} may not have stopped"),
        Notice::TrackClear => "the track is clear; trains may run again".to_owned(),
        Notice::Noise => "sensors report at random: trains stop until none has for 3 s; check the line and the sensor modules".to_owned(),
        Notice::NoiseOver => "sensors no longer report at random".to_owned(),
        Notice::PowerOn => "track power on; all trains are commanded to stop".to_owned(),
        Notice::AsksToCreep { train } => format!("train {train} is waiting for clearance to creep"),
        Notice::Creeps { train, step } => {
            format!("train {train} creeps at step {step} until two sensors confirm its position")
        }
        Notice::Located { train } => format!("train {train} is located again"),
        Notice::SpeedMeasured { train, step, ratio, deviation } => format!(
            "train {train} runs at {:.1} % (± {:.1} %) of its calibrated speed at step {step}",
            100.0 * ratio,
            100.0 * HALF_95 * deviation
        ),
        Notice::StopChecked { train, beyond, deviation } => format!(
            "train {train} came to rest {:.0} mm beyond the prediction (± {:.0} mm)",
            beyond.as_mm(),
            HALF_95 * deviation.as_mm()
        ),
        Notice::Recovered { train, outcome, took } => {
            let found = match outcome {
                // Its speeds were found to be the same.
                Outcome::Rescaled { ratio } if (ratio - 1.0).abs() < f64::EPSILON => {
                    "it runs as fast as before, and its stops have changed".to_owned()
                }
                Outcome::Rescaled { ratio } => {
                    format!("it runs at {:.0} % of its calibrated speeds", 100.0 * ratio)
                }
                Outcome::LearntAnew => "it is another engine, and was calibrated anew".to_owned(),
                _ => "its model is unchanged".to_owned(),
            };
            format!("recovery took {:.0} s; train {train} is back in service: {found}", took.as_s())
        }
        Notice::Resumed { train, .. } => format!("train {train} resumes its command"),
        Notice::Cancelled { train, .. } => {
            format!("the command of train {train} was cancelled; send it again")
        }
        Notice::NeedsOperator { train, while_it } => format!(
            "position of train {train} lost: recovery failed {while_it}; check the train, then enter \
             `place {train} at ...`, or run it over a sensor if no other train is near"
        ),
        _ => return None,
    })
}

/// Warns that the stops of a train missed their intervals too often; `by` is the standard deviation that was added.
pub(super) fn promises_broken(train: TrainId, by: Length) -> String {
    format!(
        "stops of train {train} miss their intervals: the intervals are ±{:.0} mm wider from now on; if \
         its load, the train or the track has changed, calibrate it again with `footplate calibrate \
         --link ... --train {train} --afresh`",
        HALF_95 * by.as_mm()
    )
}

/// Lists trains as in a sentence: `train 24, train 58`.
pub(super) fn trains(trains: &[TrainId]) -> String {
    let trains: Vec<String> = trains.iter().map(|train| format!("train {train}")).collect();
    if trains.is_empty() { "no train that can move".to_owned() } else { trains.join(", ") }
}

const fn leg(curved: bool) -> &'static str {
    if curved { "curved" } else { "straight" }
}
