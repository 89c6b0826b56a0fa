//! What lies on the rail, metre by metre, and what is left of it for each wheelset of a train.

use super::creep_force::Film;
use crate::draws::Draws;

/// Places of the texture (m apart): finer than its shortest correlation length.
const SPACING_M: f64 = 2.0;
/// How far the texture goes, relative, one standard deviation.
const TEXTURE: f64 = 0.15;
/// Beyond so many standard deviations the texture is cut off, so that no rail is without any friction.
const LARGEST_DEVIATION: f64 = 2.5;
/// How far behind the place where distance is 0 the rail begins (m): longer than any train.
const BEHIND_M: f64 = 600.0;

/// A rail with its base condition, what lies on it in places, and a texture that every wheelset meets alike.
#[derive(Debug, Clone)]
pub(crate) struct Rail {
    base: Film,
    patches: Vec<Patch>,
    texture: Texture,
}

/// A film that lies on the rail from one place to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// Where it begins (m).
    pub(crate) from: f64,
    /// Where it ends (m).
    pub(crate) to: f64,
    /// Over which length it comes up from the base condition (m); 0 for an edge.
    pub(crate) onset: f64,
    /// What it is.
    pub(crate) film: Film,
    /// By how much the friction grows with each wheelset that has run over it; 1 for a film that stays.
    pub(crate) cleaning: f64,
}

impl Rail {
    /// A rail without patches. The correlation length of its texture is drawn from 5 to 30 m.
    pub(crate) fn draw(base: Film, draws: &mut Draws) -> Self {
        Self { base, patches: Vec::new(), texture: Texture::draw(draws) }
    }

    /// Puts a film on top of all that lies there.
    pub(crate) fn lay(&mut self, patch: Patch) {
        self.patches.push(patch);
    }

    /// Lengthens the texture so that it reaches a place.
    pub(crate) fn reach(&mut self, place: f64) {
        self.texture.reach(place);
    }

    /// What a wheelset meets at a place, after so many others of the train.
    pub(crate) fn at(&self, place: f64, wheelsets_before: u32) -> Film {
        let mut film = self.base;
        for patch in &self.patches {
            if patch.from <= place && place < patch.to {
                film = patch.over(film, place, wheelsets_before);
            }
        }
        film.with_friction(film.friction * self.texture.at(place))
    }
}

impl Patch {
    fn over(&self, base: Film, place: f64, wheelsets_before: u32) -> Film {
        let lowest = self.film.friction;
        let cleaned = (0..wheelsets_before).fold(lowest, |friction, _| friction * self.cleaning);
        let most = base.friction - lowest;
        let gone = if most > 0.0 { ((cleaned - lowest) / most).clamp(0.0, 1.0) } else { 0.0 };
        let come = if self.onset > 0.0 { ((place - self.from) / self.onset).min(1.0) } else { 1.0 };
        base.towards(self.film, (1.0 - gone) * come)
    }
}

/// A factor around 1 that wanders along the rail: an Ornstein–Uhlenbeck process of the place.
#[derive(Debug, Clone)]
struct Texture {
    factors: Vec<f64>,
    kept: f64,
    deviation: f64,
    draws: Draws,
}

impl Texture {
    fn draw(draws: &mut Draws) -> Self {
        let kept = libm::exp(-SPACING_M / draws.uniform(5.0..30.0));
        let mut texture =
            Self { factors: Vec::new(), kept, deviation: draws.normal(0.0, 1.0), draws: draws.split() };
        texture.reach(0.0);
        texture
    }

    fn reach(&mut self, place: f64) {
        let needed = ((place + BEHIND_M) / SPACING_M).max(0.0) as usize + 2;
        let fresh = libm::sqrt(1.0 - self.kept * self.kept);
        while self.factors.len() < needed {
            self.deviation = self.kept * self.deviation + fresh * self.draws.normal(0.0, 1.0);
            let bounded = self.deviation.clamp(-LARGEST_DEVIATION, LARGEST_DEVIATION);
            self.factors.push(1.0 + TEXTURE * bounded);
        }
    }

    /// The factor at a place; beyond what was reached, that of the end.
    fn at(&self, place: f64) -> f64 {
        let along = ((place + BEHIND_M) / SPACING_M).clamp(0.0, (self.factors.len() - 2) as f64);
        let before = along as usize;
        let (here, next) = (self.factors[before], self.factors[before + 1]);
        here + (along - before as f64) * (next - here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    fn rail(seed: u64) -> Rail {
        Rail::draw(Film::DRY, &mut Draws::new(seed, Purpose::Track))
    }

    #[test]
    fn the_texture_has_the_spread_asked_for_and_no_more() {
        let mut rail = rail(3);
        rail.reach(200_000.0);
        let parts: Vec<f64> =
            (0..100_000).map(|at| rail.at(2.0 * f64::from(at), 0).friction / Film::DRY.friction).collect();
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        let variance =
            parts.iter().map(|part| (part - mean) * (part - mean)).sum::<f64>() / parts.len() as f64;
        // 200 km are at least 3300 correlation lengths of 60 m (twice the longest): 4 standard errors.
        assert!((mean - 1.0).abs() < 4.0 * 0.15 / 57.0, "{mean}");
        assert!((libm::sqrt(variance) - 0.15).abs() < 4.0 * 0.15 / 80.0, "{variance}");
        assert!(parts.iter().all(|part| (0.62..=1.38).contains(part)));
    }

    #[test]
    fn each_wheelset_finds_less_of_a_film_than_the_one_in_front() {
        let mut rail = rail(4);
        let plain = rail.at(50.0, 0);
        rail.lay(Patch { from: 10.0, to: 100.0, onset: 0.0, film: Film::LOW, cleaning: 1.1 });
        let texture = plain.friction / Film::DRY.friction;
        let friction = |before| rail.at(50.0, before).friction / texture;
        assert!((friction(0) - 0.06).abs() < 1e-12);
        assert!((friction(1) - 0.066).abs() < 1e-12);
        assert!((friction(10) - 0.06 * 1.1_f64.powi(10)).abs() < 1e-12);
        assert!((friction(40) - 0.55).abs() < 1e-12, "nothing is cleaner than clean");
        assert_eq!(rail.at(9.0, 0).fall, Film::DRY.fall);
    }

    #[test]
    fn a_film_can_come_up_gradually() {
        let mut rail = rail(5);
        rail.lay(Patch { from: 0.0, to: 1000.0, onset: 400.0, film: Film::LOW, cleaning: 1.0 });
        let kept: Vec<f64> = [1.0, 100.0, 200.0, 400.0, 900.0].map(|at| rail.at(at, 0).fall).into();
        assert!((kept[2] - 0.4).abs() < 1e-12, "halfway between 0.6 and 0.2");
        assert!(kept.windows(2).all(|pair| pair[0] >= pair[1]));
        assert!((kept[4] - 0.2).abs() < 1e-12);
    }
}
