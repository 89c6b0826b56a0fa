//! Operator intervention: trains are placed, lifted, pushed and exchanged, turnouts thrown by hand.

use footplate_core::track::{Leg, Position};
use footplate_core::{Length, TrainId, TurnoutId};

use crate::living::body::{Body, Coming, Met};
use crate::living::live_train::{End, LiveTrain};
use crate::living::world::LivingLayout;
use crate::train::Train;

/// Why an intervention is impossible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum HandError {
    /// There is no such train.
    #[error("there is no train {0}; name one that the layout was made with")]
    NoTrain(TrainId),
    /// The train would reach beyond the end of the track.
    #[error("the track ends under the train there; put it further from the end")]
    NoTrack,
    /// Another train is there.
    #[error("train {0} is there already; put this one elsewhere or lift the other first")]
    Occupied(TrainId),
}

impl LivingLayout<'_> {
    /// Puts a train on the rails, at rest, with the leading end of its shoe at a place in true lengths. It faces in the
    /// direction of the place's edge, with the given end in front. A wrecked train is repaired. The station repeats its
    /// last command, so the train may start at once.
    ///
    /// # Errors
    /// [`HandError`] when there is no such train or no room for it; the train stays where it was.
    pub fn place(&mut self, train: TrainId, at: Position, leads: End) -> Result<(), HandError> {
        let place =
            self.trains.iter().position(|found| found.id == train).ok_or(HandError::NoTrain(train))?;
        let was = self.trains[place].leads;
        self.trains[place].leads = leads;
        let lengths = self.trains[place].lengths();
        let lies = |turnout| self.points.lies(turnout);
        let sensed = self.trains[place].sensed();
        let body = Body::put(&self.rails, &lies, at.edge, at.offset.as_mm(), lengths, sensed);
        let beside = body.as_ref().and_then(|body| {
            let others = self.trains.iter().filter(|other| other.id != train);
            let mut bodies = others.filter_map(|other| Some((other.id, other.body.as_ref()?)));
            bodies.find(|(_, other)| body.touches(&self.rails, other)).map(|(id, _)| id)
        });
        if body.is_none() || beside.is_some() {
            self.trains[place].leads = was;
            return Err(beside.map_or(HandError::NoTrack, HandError::Occupied));
        }
        self.take_up(place);
        self.trains[place].is_wrecked = false;
        let now = self.now();
        for detector in body.iter().flat_map(|body| body.blocks(&self.rails)) {
            self.s88.occupy(detector, now);
        }
        self.trains[place].body = body;
        if let Some((draws, shoe_mm)) = self.trains[place].shoe_scatter(self.scatters)
            && let Some(body) = &mut self.trains[place].body
        {
            body.scatter(&self.rails, draws, shoe_mm);
        }
        self.trains[place].put_down_at = self.trains[place].odometer;
        self.find_near();
        self.repeat_command(place, self.now());
        Ok(())
    }

    /// Takes a train off the rails.
    pub fn lift(&mut self, train: TrainId) {
        if let Some(place) = self.trains.iter().position(|found| found.id == train) {
            self.take_up(place);
            self.find_near();
        }
    }

    /// Pushes a train in its direction of travel; the sensors that its shoe reaches close at once.
    pub fn push(&mut self, train: TrainId, by: Length) {
        let now = self.now();
        let Some(place) = self.trains.iter().position(|found| found.id == train) else { return };
        let lies = |turnout| self.points.lies(turnout);
        let pushed = &mut self.trains[place];
        let Some(body) = &mut pushed.body else { return };
        // At most the length of a room.
        body.lead += by.as_mm().clamp(0.0, 10_000.0);
        while let Some(met) = body.meet(&self.rails, &lies) {
            match met {
                Met::Touches(Coming { sensor, .. }) => {
                    if self.s88.close(sensor.what, now, train, pushed.odometer) {
                        body.hold(sensor);
                    }
                }
                Met::Leaves(sensor) => self.s88.leave(sensor.what, now),
                Met::Vacates(end) => self.s88.vacate(end.what, now),
                Met::OtherEdges | Met::Dirt => {}
                Met::End | Met::IllegalPair(_) => break,
            }
        }
        self.find_near();
    }

    /// Sets how dirty the wheels of a train are: its speed over its speed with clean wheels.
    pub fn dirty_wheels(&mut self, train: TrainId, speed: f64) {
        if let Some(found) = self.trains.iter_mut().find(|found| found.id == train) {
            found.wheels = speed.clamp(0.0, 2.0);
        }
    }

    /// Exchanges the engine of a train for another one under the same address.
    ///
    /// # Errors
    /// [`HandError`] when there is no such train or no room for the other engine.
    pub fn swap(&mut self, train: TrainId, other: Train, warmth: f64) -> Result<(), HandError> {
        let now = self.truth().train(train).ok_or(HandError::NoTrain(train))?;
        self.lift(train);
        self.add(train, other, warmth);
        now.position.map_or(Ok(()), |position| self.place(train, position, now.leads))
    }

    /// Throws a turnout by hand, even under a train.
    pub fn lay(&mut self, turnout: TurnoutId, leg: Leg) {
        if self.points.lies(turnout).is_some() {
            self.points.lay(turnout, leg);
        }
    }

    /// Lays every turnout that a train stands across for that train; returns those that lay otherwise.
    pub fn lay_under_trains(&mut self) -> Vec<TurnoutId> {
        let bodies = self.trains.iter().filter_map(|train| train.body.as_ref());
        let needed: Vec<_> = bodies.flat_map(|body| body.straddled(&self.rails)).collect();
        let wrong = needed.into_iter().filter(|(turnout, leg)| self.points.lies(*turnout) != Some(*leg));
        let wrong: Vec<_> = wrong.collect();
        wrong.iter().for_each(|(turnout, leg)| self.points.lay(*turnout, *leg));
        wrong.into_iter().map(|(turnout, _)| turnout).collect()
    }

    /// Replaces burnt coils; returns their turnouts.
    pub fn replace_coils(&mut self) -> Vec<TurnoutId> {
        self.points.replace_coils()
    }

    fn take_up(&mut self, place: usize) {
        let now = self.now();
        let train: &mut LiveTrain = &mut self.trains[place];
        train.stand(now, &mut self.rests);
        if let Some(mut body) = train.body.take() {
            for detector in body.blocks(&self.rails) {
                self.s88.vacate(detector, now);
            }
            for sensor in body.let_go() {
                self.s88.leave(sensor, now);
            }
        }
        train.sleeps = true;
    }
}
