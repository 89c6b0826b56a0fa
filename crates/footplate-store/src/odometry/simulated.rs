//! Simulated runs as odometers and recordings know them: what is assumed of the train, what was read, and the truth.

use footplate_core::odometry::wheels::{
    Axle, BrakeCommand, Count, Direction, Period, SlideProtection, Vehicle, VehicleError, WheelReading,
    Wheelset,
};
use footplate_sim::line::{
    LineBrake, LineRun, LineSample, LineSlideProtection, LineTruth, LineVehicle, LineWheelset, Turned,
    WheelSample,
};

use crate::tachometer::{Truth, WrittenColumns};
use crate::vehicle_file::VehicleFile;

/// What is assumed of a simulated train.
///
/// # Errors
/// The first value that no railway has.
pub fn simulated_vehicle(assumed: &LineVehicle) -> Result<VehicleFile, VehicleError> {
    let wheelset = |wheelset: LineWheelset| Wheelset {
        teeth: wheelset.teeth,
        diameter: wheelset.diameter,
        diameter_tolerance: wheelset.diameter_tolerance,
        axle: if wheelset.is_powered { Axle::Powered } else { Axle::Trailing },
    };
    let limits = [assumed.max_traction, assumed.max_brake];
    let wheelsets = assumed.wheelsets.map(wheelset);
    let mut vehicle = Vehicle::new(assumed.period, assumed.max_speed, limits, wheelsets)?;
    let LineBrake { full, tolerance, gradient, resistance, build_up, release } = assumed.brake_command;
    let release = release.unwrap_or(vehicle.brake_command.release);
    vehicle.brake_command = BrakeCommand { full, tolerance, gradient, resistance, build_up, release };
    vehicle.slide_protection = assumed
        .slide_protection
        .map(|LineSlideProtection { creepage, longest }| SlideProtection { creepage, longest });
    vehicle.independent = assumed.independent;
    vehicle.check()?;
    Ok(VehicleFile { name: assumed.name.clone(), vehicle })
}

/// Which columns a recording of a simulated run has: all but those that would be empty.
#[must_use]
pub fn simulated_columns(run: &LineRun) -> WrittenColumns {
    WrittenColumns {
        counters: has_counters_only(run),
        directions: true,
        edges: true,
        effort: run.samples.iter().any(|sample| sample.effort.is_some()),
        acceleration: run.samples.iter().any(|sample| sample.acceleration.is_some()),
        balise: run.samples.iter().any(|sample| sample.balise.is_some()),
        balise_deviation: run.samples.iter().any(|sample| sample.balise_deviation.is_some()),
        run_id: false,
        truth: true,
        true_wheels: true,
    }
}

/// The rows of a simulated run. Wheelsets are read by their pulses; by their counters where there is nothing else.
pub fn simulated_rows(run: &LineRun) -> impl Iterator<Item = (Period, Truth)> {
    let by_counter = has_counters_only(run);
    run.samples
        .iter()
        .zip(&run.truth)
        .map(move |(sample, truth)| (period(sample, by_counter), as_known(truth)))
}

fn has_counters_only(run: &LineRun) -> [bool; 2] {
    [0, 1].map(|wheel: usize| {
        let mut of_wheel = run.samples.iter().map(|sample| sample.wheels[wheel]);
        of_wheel.all(|read| read.pulses.is_none())
            && run.samples.iter().any(|sample| sample.wheels[wheel].counter.is_some())
    })
}

fn period(sample: &LineSample, by_counter: [bool; 2]) -> Period {
    let [first, second] = sample.wheels;
    Period {
        time: sample.time,
        wheels: [reading(first, by_counter[0]), reading(second, by_counter[1])],
        effort: sample.effort,
        acceleration: sample.acceleration,
        balise: sample.balise,
        balise_deviation: sample.balise_deviation,
    }
}

fn reading(wheel: WheelSample, by_counter: bool) -> WheelReading {
    let count = if by_counter {
        wheel.counter.map_or(Count::Missing, Count::Counter)
    } else {
        wheel.pulses.map_or(Count::Missing, Count::Pulses)
    };
    let direction = match wheel.turned {
        Some(Turned::Forward) => Direction::Forward,
        Some(Turned::Backward) => Direction::Backward,
        None => Direction::Unknown,
    };
    WheelReading { count, direction, last_edge: wheel.last_edge }
}

fn as_known(truth: &LineTruth) -> Truth {
    Truth { speed: Some(truth.speed), distance: Some(truth.distance), wheels: truth.wheel_speeds.map(Some) }
}

#[cfg(test)]
mod tests {
    use footplate_sim::line::{LineConditions, LineScenario};

    use super::*;

    fn run(name: &str) -> LineRun {
        LineScenario::by_name(name).unwrap().run(3, LineConditions::default())
    }

    #[test]
    fn pulses_are_read_where_there_are_any_and_counters_where_there_is_nothing_else() {
        let (pulses, counters) = (run("S6"), run("F8"));
        assert_eq!(simulated_columns(&pulses).counters, [false; 2]);
        assert_eq!(simulated_columns(&counters).counters, [true; 2]);
        let counted = |run: &LineRun| simulated_rows(run).nth(100).unwrap().0.wheels[0].count;
        assert_eq!(counted(&pulses), Count::Pulses(pulses.samples[100].wheels[0].pulses.unwrap()));
        assert_eq!(counted(&counters), Count::Counter(counters.samples[100].wheels[0].counter.unwrap()));
    }

    #[test]
    fn what_a_simulated_train_claims_is_what_an_odometer_believes() {
        let assumed = run("S5").vehicle;
        let VehicleFile { name, vehicle } = simulated_vehicle(&assumed).unwrap();
        assert_eq!((name.as_str(), vehicle.independent), ("S5", false));
        assert_eq!(vehicle.wheelsets.map(|wheelset| wheelset.axle), [Axle::Powered, Axle::Trailing]);
        assert_eq!(vehicle.brake_command.resistance, assumed.brake_command.resistance);
        assert_eq!(vehicle.max_brake, assumed.max_brake);
        assert!(simulated_vehicle(&run("S8").vehicle).unwrap().vehicle.independent);
    }
}
