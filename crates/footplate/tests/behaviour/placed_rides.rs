//! Wheel scale and distance by places of stated accuracy, on simulated rides whose diameters are off; an eighth of the places
//! is wrong by up to 18 m. Nothing was chosen by these seeds.

use footplate_core::Length;
use footplate_sim::line::{LineConditions, LineRun, LineScenario};
use footplate_store::odometry::{OdometryRun, Preset, RunContext, simulated_rows, simulated_vehicle};

/// A ride ends here (m); a place comes after so many metres.
const RIDE_M: f64 = 5000.0;
const BETWEEN_PLACES_M: f64 = 250.0;
/// Standard deviation of a place (m), the part of them that is wrong, and by how much (m).
const PLACE_DEVIATION_M: f64 = 2.0;
const WRONG: f64 = 0.12;
const WRONG_BY_M: [f64; 2] = [5.0, 18.0];
const RIDES: u64 = 100;

/// Even numbers between 0 and 1 (splitmix64).
struct Even(u64);

impl Even {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Box and Muller, 1958.
    fn normal(&mut self) -> f64 {
        let (one, other) = (1.0 - self.next(), self.next());
        (-2.0 * libm::log(one)).sqrt() * libm::cos(2.0 * std::f64::consts::PI * other)
    }
}

/// The true scales of the part of a ride that is used: the path of each tread over the path that its pulses say.
fn true_scales(run: &LineRun, rows: usize, pitches: [f64; 2]) -> [f64; 2] {
    let t = run.vehicle.period.as_s();
    [0, 1].map(|wheel| {
        let speed = |at: usize| run.truth[at].wheel_speeds[wheel].as_m_per_s();
        let turned: f64 = (1..rows).map(|at| 0.5 * t * (speed(at - 1) + speed(at))).sum();
        let pulses: i64 = run.samples[1..rows].iter().filter_map(|sample| sample.wheels[wheel].pulses).sum();
        turned / (pulses as f64 * pitches[wheel])
    })
}

#[test]
fn wheel_scales_are_known_after_one_ride() {
    let scenario = LineScenario::by_name("N6").unwrap();
    let (mut errors, mut squared, mut within_95) = (Vec::new(), 0.0, 0);
    let (mut ends, mut inside, mut periods, mut guaranteed) = (Vec::new(), 0_u64, 0_u64, 0_u64);
    let (mut marks, mut wrong_marks) = (0, 0);
    for seed in 3000..3000 + RIDES {
        let conditions =
            LineConditions { teeth: [80, 100, 200][seed as usize % 3], ..LineConditions::default() };
        let run = scenario.run(seed, conditions);
        let vehicle = simulated_vehicle(&run.vehicle).unwrap().vehicle;
        let mut odometry = OdometryRun::new(&RunContext::new(vehicle, Preset::Recommended, false)).unwrap();
        let mut even = Even(seed);
        let (mut next_place, mut rows) = (BETWEEN_PLACES_M, 0);
        let mut end = None;
        for (mut period, truth) in simulated_rows(&run) {
            let distance = truth.distance.unwrap().as_m();
            if distance > RIDE_M {
                break;
            }
            rows += 1;
            (period.balise, period.balise_deviation) = (None, None);
            if distance >= next_place {
                next_place += BETWEEN_PLACES_M;
                let is_wrong = even.next() < WRONG;
                let size = WRONG_BY_M[0] + (WRONG_BY_M[1] - WRONG_BY_M[0]) * even.next();
                let sign = if even.next() < 0.5 { -1.0 } else { 1.0 };
                let error = if is_wrong { sign * size } else { PLACE_DEVIATION_M * even.normal() };
                period.balise = Some(Length::from_m(distance + error));
                period.balise_deviation = Some(Length::from_m(PLACE_DEVIATION_M));
                (marks, wrong_marks) = (marks + 1, wrong_marks + usize::from(is_wrong));
            }
            let estimate = odometry.step(&period, Default::default);
            let holds =
                |low: Length, high: Length| u64::from(low.as_m() <= distance && distance <= high.as_m());
            periods += 1;
            inside += holds(estimate.confidence.distance_low, estimate.confidence.distance_high);
            guaranteed += holds(estimate.guaranteed.distance_low, estimate.guaranteed.distance_high);
            end = Some((estimate.distance.as_m() - distance).abs());
        }
        assert!(next_place >= RIDE_M, "seed {seed}: the ride is shorter than {RIDE_M} m");
        ends.extend(end);
        let pitches = vehicle.wheelsets.map(|wheelset| wheelset.pulse_pitch().as_m());
        for (known, truth) in odometry.wheel_scales().into_iter().zip(true_scales(&run, rows, pitches)) {
            let known = known.unwrap();
            let error = known.value - truth;
            errors.push(error.abs());
            squared += (error / known.deviation).powi(2);
            within_95 += u64::from(error.abs() <= 1.96 * known.deviation);
        }
    }
    let count = errors.len() as f64;
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
    errors.sort_by(f64::total_cmp);
    ends.sort_by(f64::total_cmp);
    let at = |values: &[f64], part: f64| values[((values.len() - 1) as f64 * part) as usize];
    eprintln!(
        "{RIDES} rides of 5 km, {marks} places of ±{PLACE_DEVIATION_M} m, {wrong_marks} wrong: scale off by {:.4} % rms, {:.4} % in \
         95 of 100, {:.4} % at most; mean square {:.2} in deviations, {:.1} % within the 95 % interval; distance at the end off by \
         {:.2} m in the median, {:.2} m at most; within its 99.99 % interval {:.3} % of periods, guaranteed {:.3} %",
        100.0 * rms,
        100.0 * at(&errors, 0.95),
        100.0 * at(&errors, 1.0),
        squared / count,
        100.0 * within_95 as f64 / count,
        at(&ends, 0.5),
        at(&ends, 1.0),
        100.0 * inside as f64 / periods as f64,
        100.0 * guaranteed as f64 / periods as f64,
    );
    // 0.05 % was asked: the rms is, 95 of 100 are within 0.06 %.
    assert!(rms <= 4e-4 && at(&errors, 0.95) <= 7e-4, "{rms}");
    assert!(within_95 as f64 >= 0.93 * count, "{within_95} of {count}");
    assert!((0.3..1.5).contains(&(squared / count)), "the deviation is not true: {}", squared / count);
    assert!(inside as f64 >= 0.9998 * periods as f64 && guaranteed == periods);
    assert!(at(&ends, 1.0) < 10.0, "no distance is lost");
}
