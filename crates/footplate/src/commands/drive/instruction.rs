//! What a line says, once it has been understood.

use footplate_core::control::{Journey, Order, TrainLengths};
use footplate_core::track::Landmark;
use footplate_core::{SensorId, TimeSpan, TrainId};

/// One line of a script or of the prompt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Instruction {
    /// Something for the driver.
    Order(Order),
    /// A train goes to a place by whatever way is free.
    Go(TrainId, Journey),
    /// All turnouts straight, one after the other.
    Straighten,
    /// A person put a train there, or sees that it stands there.
    Place(TrainId, Landmark),
    /// A person has measured a train.
    Length(TrainId, TrainLengths),
    /// All trains stand, and the power goes off the track, at once.
    Halt,
    /// The power comes back.
    PowerOn,
    /// Where is a train, or all of them?
    Where(Option<TrainId>),
    /// Go on with the next line later.
    Wait(Until),
    /// What can be said?
    Help,
    /// Stop all trains and end.
    Quit,
}

/// What is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Until {
    /// Time goes by.
    Passed(TimeSpan),
    /// A train has nothing to do and stands.
    AtRest(TrainId),
    /// A train passes a contact.
    At(TrainId, SensorId),
    /// Somebody knows where a train is.
    Located(TrainId),
}

/// What can be said, for `help`.
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
place 24 at C13+120mm             train 24 is there: you put it there, or you see it there
length 24 pickup 45mm overhang 110mm   length of train 24: its pickup, and from there to its further end
halt                              emergency stop: stop all trains, switch the track power off
power on                          switch the track power on
where [24]                        position and speed of the train, with intervals
wait 2s                           go on after 2 seconds (also 500ms)
wait 24 at rest                   go on when train 24 has finished its command and is at rest
wait 24 at C13                    go on when train 24 passes sensor C13
wait 24 located                   go on when the position of train 24 is known
help                              show this list
quit                              stop all trains and end
# comment";
