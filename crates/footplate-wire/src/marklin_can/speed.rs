//! The speeds of the bus, 0 to 1000, and the throttle steps of the program.

use footplate_core::{DecoderSteps, SpeedStep};

/// The highest speed on the bus.
pub const HIGHEST_SPEED: u16 = 1000;

/// The speed of a step of `n`: the greatest whole number not above step × 1000 / n, so that it is the same step of the decoder whether
/// the station rounds to the nearest step or up. `None` beyond the highest step.
pub fn speed_of(step: SpeedStep, decoder: DecoderSteps) -> Option<u16> {
    let share = u32::from(step.get()) * u32::from(HIGHEST_SPEED) / u32::from(decoder.highest().get());
    u16::try_from(share).ok().filter(|speed| *speed <= HIGHEST_SPEED)
}

/// The step that is nearest to a speed: what a station answers may be rounded to the steps of a decoder. None but 0 stands.
pub fn step_of(speed: u16, decoder: DecoderSteps) -> SpeedStep {
    let speed = u32::from(speed.min(HIGHEST_SPEED));
    let (steps, whole) = (u32::from(decoder.highest().get()), u32::from(HIGHEST_SPEED));
    let nearest = ((speed * steps + whole / 2) / whole).max(u32::from(speed > 0));
    u8::try_from(nearest).ok().and_then(SpeedStep::new).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_read_back_from_its_speed_and_from_the_ones_beside_it() {
        for decoder in DecoderSteps::EVERY {
            let highest = decoder.highest().get();
            for step in (0..=highest).filter_map(SpeedStep::new) {
                let speed = speed_of(step, decoder).unwrap_or_default();
                assert_eq!(step_of(speed, decoder), step);
                assert_eq!(step_of(speed + u16::from(speed > 0), decoder), step);
                // A station that rounds up: the least step whose share of 1000 is not below the speed.
                let up = (u32::from(speed) * u32::from(highest)).div_ceil(1000);
                assert_eq!(up, u32::from(step.get()));
            }
            let beyond = SpeedStep::new(highest + 1);
            assert_eq!(beyond.and_then(|step| speed_of(step, decoder)), None);
            assert_eq!(step_of(0, decoder), SpeedStep::STAND);
            assert_eq!(step_of(1, decoder).get(), 1);
        }
    }
}
