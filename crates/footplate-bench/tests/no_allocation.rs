//! Once it is made, an odometer allocates nothing, whatever the wheelsets do.

use footplate_bench::odometry::{Load, Round, Run};
use footplate_core::odometry::OdometrySettings;

#[test]
fn a_period_of_odometry_allocates_nothing() {
    for load in [Load::Rolling, Load::OneSlides, Load::BothSlide] {
        for settings in [OdometrySettings::recommended(), OdometrySettings::paper()] {
            let mut run = Run::new(Round::new(load), settings);
            let allocated = allocation_counter::measure(|| {
                for _ in 0..5000 {
                    std::hint::black_box(run.step());
                }
            });
            assert_eq!(allocated.count_total, 0, "{load:?}, {settings:?}");
        }
    }
    // The counter counts.
    let allocated = allocation_counter::measure(|| drop(std::hint::black_box(Box::new(1))));
    assert_eq!(allocated.count_total, 1);
}
