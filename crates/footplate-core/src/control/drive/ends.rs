//! Where a run and a movement authority end, as they were before a detection that is found to be another train's, or spurious.
//!
//! Both are measured from the last sensor that a train has passed. Measured from one that it has not reached, a place behind that
//! sensor is a lap further on a circuit, and remains so when the detection is revised.

use crate::tracking::PathPoint;

use super::driven_train::DrivenTrain;
use super::order::OrderId;
use super::task::{Destination, Goal};

/// The target of an order, and the end of an authority with the number of that authority.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ends {
    target: Option<(OrderId, PathPoint)>,
    authority: (u32, Option<PathPoint>),
}

impl DrivenTrain {
    /// Where its run and its authority end now.
    pub(super) fn ends(&self) -> Ends {
        let target = self.task.and_then(|task| match task.goal {
            Goal::RestAt(Destination { at: Some(at), .. }) => Some((task.order, at)),
            _ => None,
        });
        Ends { target, authority: (self.authorities_given, self.end_of_authority) }
    }

    /// Measures the ends of its run and its authority as before, unless another order or authority was given since.
    pub(super) fn restore_ends(&mut self, ends: Ends) {
        if let (Some(task), Some((order, before))) = (&mut self.task, ends.target)
            && task.order == order
            && let Goal::RestAt(Destination { at: Some(at), .. }) = &mut task.goal
        {
            *at = before;
        }
        let (number, end) = ends.authority;
        if self.authorities_given == number {
            self.end_of_authority = end;
        }
    }
}
