//! The instructions that a script or an operator can give.

use footplate_core::control::{Journey, Order, TrainLengths};
use footplate_core::track::Landmark;
use footplate_core::{FunctionNumber, SensorId, SpeedStep, TimeSpan, TrainId};
use footplate_store::Schedule;

/// One line of a script or of the prompt.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Instruction {
    /// An order of the driver.
    Order(Order),
    /// Send a train to a place; the dispatcher chooses the route.
    Go(TrainId, Journey),
    /// Have a train creep to the next sensor and stop there, so that its position is known.
    Find(TrainId),
    /// Throw all turnouts straight, one after the other.
    Straighten,
    /// The operator says where a train at rest is.
    Place(TrainId, Landmark),
    /// The operator states the lengths of a train.
    Length(TrainId, TrainLengths),
    /// Switch a function of a train on or off.
    Function(TrainId, FunctionNumber, bool),
    /// Stop all trains and switch the track power off, at once.
    Halt,
    /// Switch the track power on.
    PowerOn,
    /// Print the position of one train, or of all.
    Where(Option<TrainId>),
    /// Continue with the next line when a condition is met.
    Wait(Until),
    /// Print the saved schedules, and how far those have come that run.
    ListSchedules,
    /// Begin a saved schedule.
    RunSchedule(Schedule),
    /// End the schedule of this name.
    EndSchedule(String),
    /// Print the list of instructions.
    Help,
    /// Stop all trains and end the session.
    Quit,
}

impl Instruction {
    /// The train that it drives or locates, if it does.
    pub(super) fn driven(&self) -> Option<TrainId> {
        match self {
            Self::Order(order) => order.train(),
            Self::Go(train, _) | Self::Find(train) | Self::Place(train, _) => Some(*train),
            _ => None,
        }
    }

    /// The train that it drives, locates or waits for.
    pub(super) fn concerned(&self) -> Option<TrainId> {
        match self {
            Self::Wait(until) => until.train(),
            _ => self.driven(),
        }
    }

    /// Whether it only stops a train.
    pub(super) const fn is_plain_stop(&self) -> bool {
        matches!(self, Self::Order(Order::Speed { step: SpeedStep::STAND, .. }))
    }

    /// Whether it is carried out at once, without further instructions.
    pub(super) const fn is_at_once(&self) -> bool {
        !matches!(self, Self::Go(..) | Self::Find(_) | Self::Place(..) | Self::Straighten | Self::Wait(_))
    }
}

/// The condition of a `wait`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Until {
    /// A time has passed.
    Passed(TimeSpan),
    /// A train has finished its orders and is at rest.
    AtRest(TrainId),
    /// A sensor detects a train.
    At(TrainId, SensorId),
    /// The position of a train is known.
    Located(TrainId),
}

impl Until {
    /// The train that it waits for.
    pub(super) const fn train(&self) -> Option<TrainId> {
        match self {
            Self::Passed(_) => None,
            Self::AtRest(train) | Self::At(train, _) | Self::Located(train) => Some(*train),
        }
    }
}

/// The text of `help`.
pub(super) const HELP: &str = "\
speed 24 8                        run train 24 at step 8; step 0 stops it
reverse 24 [at step 8]            stop, then reverse [and run at step 8]
turnout 11 curved                 throw turnout 11 (curved or straight)
turnout all straight              throw all turnouts straight, so that their positions are known
stop 24 at C13+120mm              stop with the pickup 120 mm past sensor C13
     [at step 8]                  ... from step 8
     [not-beyond 0.1%]            ... with at most 1 stop in 1000 beyond it
     [next round]                 ... after passing it once
go 24 to D5+40mm                  take the fastest free route; turnouts and reversals are included
     [not-beyond 0.1%]            ... with at most 1 stop in 1000 beyond it
     [facing]                     ... and arrive in the direction of that sensor
move 24 37mm                      from standstill, move on by 37 mm
hold 24 250mm/s                   run at a mean speed, also between throttle steps
follow 58 behind 24 by 1.5s       keep 1.5 s behind train 24, sensor by sensor (or by 150mm)
arrive 24 at D5+40mm in 12s       come to rest there in 12 s
find 24                           creep to the next sensor and stop there: then its position is known
place 24 at C13+120mm             train 24 is there: you put it there, or you see it there
length 24 pickup 45mm overhang 110mm   length of train 24: its pickup, and from there to its further end
light 24 on                       switch the light of train 24 on (or off); the same as function 24 0 on
function 24 2 on                  switch function F2 of train 24 on (or off)
halt                              emergency stop: stop all trains, switch the track power off
power on                          switch the track power on
where [24]                        position and speed of the train, with intervals
wait 2s                           go on after 2 seconds (also 500ms)
wait 24 at rest                   go on when train 24 has finished its command and is at rest
wait 24 at C13                    go on when train 24 passes sensor C13
wait 24 located                   go on when the position of train 24 is known
schedule list                     the saved schedules, and how far those have come that run
schedule run Evening              begin the saved schedule `Evening`; it runs beside the prompt
schedule end Evening              end it; its trains finish the commands that they have
help                              show this list
quit                              stop all trains and end
# comment";
