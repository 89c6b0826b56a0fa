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
speed 24 8                        run train 24 at step 8; step 0 brings it to rest
reverse 24 [at step 8]            come to rest, turn around [and run at step 8]
turnout 11 curved                 throw turnout 11 (curved or straight)
turnout all straight              so that it is known how all of them lie
stop 24 at C13+120mm              come to rest with the pickup 120 mm past contact C13
     [at step 8]                  ... from step 8
     [not-beyond 0.1%]            ... beyond it in one stop of a thousand at most
     [next round]                 ... after passing it once
go 24 to D5+40mm                  by the soonest way that is free, turnouts and reversals included
     [not-beyond 0.1%]            ... beyond it in one stop of a thousand at most
     [facing]                     ... and facing as that contact does
move 24 37mm                      from rest, move on by 37 mm
hold 24 250mm/s                   run at a mean speed, whatever steps that takes
follow 58 behind 24 by 1.5s       keep 1.5 s behind train 24, contact by contact (or by 150mm)
arrive 24 at D5+40mm in 12s       come to rest there, 12 s from now
place 24 at C13+120mm             train 24 was put there by hand, or stands there as you see
length 24 pickup 45mm overhang 110mm   how long train 24 is: its pickup, and from there to its further end
halt                              all trains stand and the power goes off, at once
power on                          give power to the track again
where [24]                        where the train is, how sure, and how fast
wait 2s                           go on after 2 seconds (also 500ms)
wait 24 at rest                   go on when train 24 has done what it was told and stands
wait 24 at C13                    go on when train 24 passes contact C13
wait 24 located                   go on when a contact has said where train 24 is
help                              this
quit                              stop all trains and end
# what follows is a remark";
