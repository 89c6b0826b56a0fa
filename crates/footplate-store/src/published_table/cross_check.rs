//! Compares a calibration with published measurements of trains of the same number.
//!
//! Two teams measured the same locomotive years apart, on other track, with other wear. The spread between teams is
//! estimated from the teams themselves: over all pairs of teams that measured the same step, the median of |ln(a/b)| is
//! 0.6745 √2 s for a spread s of one team. The median is robust against misprints in published figures. Our calibration
//! counts as one more team, so that a difference should have σ² = 2 s² + u² + u'², with the relative uncertainties u
//! and u' of both figures.

use std::collections::BTreeMap;

use footplate_core::{Approach, SpeedStep, TrainId};

use super::read::{CountedFrom, PublishedFigure, PublishedQuantity};
use crate::findings::{Findings, TrainFindings};
use crate::motion_file::MotionStepForm;

/// The upper quartile of the standard normal distribution: half of all values lie within it.
const QUARTILE: f64 = 0.674_489_750_196_081_7;
/// The largest difference in σ that counts as agreement: 95 of 100 by chance alone.
const AGREES_WITHIN: f64 = 2.0;
/// The uncertainty of a stopping distance whose origin is not stated, one standard deviation (s): up to two polls of 70
/// ms pass between the report of a sensor and the command that it triggers.
const NOT_STATED_S: f64 = 0.07;

/// A published figure beside ours.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedFigure {
    /// The quantity.
    pub quantity: PublishedQuantity,
    /// The train.
    pub train: TrainId,
    /// The throttle step.
    pub step: SpeedStep,
    /// The side from which the team reached the step.
    pub approach: Approach,
    /// The team.
    pub team: String,
    /// The year or term of publication.
    pub term: String,
    /// The mean of the team's figures, in mm/s or mm.
    pub theirs: f64,
    /// The number of figures in that mean.
    pub readings: usize,
    /// Our value and its standard deviation.
    pub ours: [f64; 2],
    /// The standard deviation of the difference, relative to the figures.
    pub sigma: f64,
}

impl CheckedFigure {
    /// Our value minus theirs, in percent of theirs.
    pub fn difference_percent(&self) -> f64 {
        100.0 * (self.ours[0] / self.theirs - 1.0)
    }

    /// The difference in standard deviations.
    pub fn sigmas(&self) -> f64 {
        libm::log(self.ours[0] / self.theirs) / self.sigma
    }

    /// Whether chance explains the difference.
    pub fn agrees(&self) -> bool {
        self.sigmas().abs() <= AGREES_WITHIN
    }
}

/// The comparison with one team.
#[derive(Debug, Clone, PartialEq)]
pub struct TeamSummary {
    /// The team.
    pub team: String,
    /// Figures with a counterpart in our calibration.
    pub compared: usize,
    /// Figures that agree.
    pub agree: usize,
    /// The median difference, in percent of theirs.
    pub median_percent: f64,
}

/// The comparison with all published figures.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossCheck {
    /// Speeds, by train, step and team.
    pub speeds: Vec<CheckedFigure>,
    /// Stopping distances.
    pub stops: Vec<CheckedFigure>,
    /// The spread of one team's speeds, one standard deviation (%); `None` if no two teams measured the same step.
    pub speed_spread_percent: Option<f64>,
    /// The same for stopping distances.
    pub stop_spread_percent: Option<f64>,
    /// The number of published figures, and of those without a counterpart in our calibration.
    pub without_counterpart: [usize; 2],
    /// Published figures with a counterpart that cannot be judged: no two teams measured the same step of a train, so that the
    /// spread of that kind of figure is unknown.
    pub spread_unknown: usize,
}

/// Why there is nothing to compare.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NothingToCompare {
    /// No two teams measured the same step of a train.
    #[error(
        "no two teams measured the same step of a train, so that the spread between teams is unknown; give the \
         tables of more teams"
    )]
    OneTeam,
    /// Our calibration has none of the trains or steps.
    #[error("none of the {figures} published figures is of a train and step that the recordings show")]
    NoCounterpart {
        /// The number of published figures.
        figures: usize,
    },
}

/// One team's measurements of one step: the key of the grouping.
type Key<'a> = (PublishedQuantity, TrainId, SpeedStep, Approach, &'a str, &'a str);

impl CrossCheck {
    /// Compares a calibration with published figures.
    ///
    /// # Errors
    /// [`NothingToCompare`].
    pub fn of(report: &Findings, figures: &[PublishedFigure]) -> Result<Self, NothingToCompare> {
        let mut teams: BTreeMap<Key<'_>, Vec<f64>> = BTreeMap::new();
        for figure in figures {
            let PublishedFigure { quantity, train, step, approach, ref team, ref term, value } = *figure;
            teams.entry((quantity, train, step, approach, team, term)).or_default().push(value);
        }
        let of_speeds = |quantity| quantity == PublishedQuantity::Speed;
        let speed_spread = spread(&teams, of_speeds);
        let stop_spread = spread(&teams, |quantity| !of_speeds(quantity));
        if speed_spread.or(stop_spread).is_none() {
            return Err(NothingToCompare::OneTeam);
        }
        let mut check = Self {
            speeds: Vec::new(),
            stops: Vec::new(),
            speed_spread_percent: speed_spread.map(|spread| 100.0 * spread),
            stop_spread_percent: stop_spread.map(|spread| 100.0 * spread),
            without_counterpart: [teams.len(), 0],
            spread_unknown: 0,
        };
        for (key, values) in &teams {
            let (kind, between) = match key.0 {
                PublishedQuantity::Speed => (&mut check.speeds, speed_spread),
                PublishedQuantity::Stop(_) => (&mut check.stops, stop_spread),
            };
            match checked(report, key, values, between.unwrap_or_default()) {
                Some(figure) if between.is_some() => kind.push(figure),
                Some(_) => check.spread_unknown += 1,
                None => check.without_counterpart[1] += 1,
            }
        }
        for kind in [&mut check.speeds, &mut check.stops] {
            kind.sort_by(|one, other| {
                (one.train, one.step, &one.team, one.approach as u8).cmp(&(
                    other.train,
                    other.step,
                    &other.team,
                    other.approach as u8,
                ))
            });
        }
        if check.speeds.is_empty() && check.stops.is_empty() {
            let is_judged = |figure: &&PublishedFigure| {
                if of_speeds(figure.quantity) { speed_spread.is_some() } else { stop_spread.is_some() }
            };
            let judged = figures.iter().filter(is_judged).count();
            return Err(NothingToCompare::NoCounterpart { figures: judged });
        }
        Ok(check)
    }

    /// The summary of each team, in the order of their names.
    pub fn by_team(figures: &[CheckedFigure]) -> Vec<TeamSummary> {
        let mut teams: BTreeMap<&str, Vec<&CheckedFigure>> = BTreeMap::new();
        for figure in figures {
            teams.entry(&figure.team).or_default().push(figure);
        }
        let summary = |(team, figures): (&str, Vec<&CheckedFigure>)| TeamSummary {
            team: team.to_owned(),
            compared: figures.len(),
            agree: figures.iter().filter(|figure| figure.agrees()).count(),
            median_percent: median(figures.iter().map(|figure| figure.difference_percent()).collect())
                .unwrap_or_default(),
        };
        teams.into_iter().map(summary).collect()
    }
}

/// One figure per team.
type Found<'a> = Vec<(&'a str, f64)>;

/// The relative spread of one team; see the head of this file.
fn spread(teams: &BTreeMap<Key<'_>, Vec<f64>>, of: impl Fn(PublishedQuantity) -> bool) -> Option<f64> {
    let mut by_step: BTreeMap<(TrainId, SpeedStep, Approach), Found<'_>> = BTreeMap::new();
    for ((_, train, step, approach, team, _), values) in teams.iter().filter(|(key, _)| of(key.0)) {
        by_step.entry((*train, *step, *approach)).or_default().push((team, mean(values)));
    }
    let mut ratios = Vec::new();
    for found in by_step.values() {
        for (place, (team, value)) in found.iter().enumerate() {
            let others = found.iter().skip(place + 1).filter(|(other, _)| other != team);
            ratios.extend(others.map(|(_, other)| libm::log(value / other).abs()));
        }
    }
    // Two teams that copied one figure would have no spread, and every difference would be significant: ignore it.
    median(ratios).map(|ratio| ratio / (QUARTILE * std::f64::consts::SQRT_2)).filter(|spread| *spread > 0.0)
}

fn checked(report: &Findings, key: &Key<'_>, values: &[f64], between: f64) -> Option<CheckedFigure> {
    let (quantity, train, step, approach, team, term) = *key;
    let form = report.trains.iter().find(|form| form.train == train)?;
    let (ours, definition) = match quantity {
        PublishedQuantity::Speed => {
            let own = our_step(form, step, approach, MotionStepForm::is_measured)?;
            ([own.speed.value, own.speed.uncertainty], 0.0)
        }
        PublishedQuantity::Stop(counted) => {
            let own = our_step(form, step, approach, |own| own.stop.measurements > 0)?;
            let origin_uncertainty =
                if counted == CountedFrom::NotStated { NOT_STATED_S * own.speed.value } else { 0.0 };
            ([own.stop.value, own.stop.uncertainty], origin_uncertainty)
        }
    };
    let theirs = mean(values);
    let squares: f64 = values.iter().map(|value| (value - theirs).powi(2)).sum();
    let count = values.len() as f64;
    // The variance of their mean, if they published several figures.
    let their_variance = if values.len() > 1 { squares / (count - 1.0) / count } else { 0.0 };
    let [value, uncertainty] = ours;
    let variance = 2.0 * between * between
        + (uncertainty * uncertainty + definition * definition) / (value * value)
        + their_variance / (theirs * theirs);
    (value > 0.0).then(|| CheckedFigure {
        quantity,
        train,
        step,
        approach,
        team: team.to_owned(),
        term: term.to_owned(),
        theirs,
        readings: values.len(),
        ours,
        sigma: variance.sqrt(),
    })
}

/// Our value of a step reached from the same side; of either side if theirs is not stated.
fn our_step(
    form: &TrainFindings,
    step: SpeedStep,
    theirs: Approach,
    is_measured: impl Fn(&MotionStepForm) -> bool,
) -> Option<&MotionStepForm> {
    let sides: &[Approach] = match theirs {
        Approach::Below => &[Approach::Below],
        Approach::Above => &[Approach::Above],
        Approach::Unknown => &[Approach::Below, Approach::Above],
    };
    let at = |side: &Approach| form.steps.iter().find(|own| own.step == step && own.approach == *side);
    sides.iter().filter_map(at).find(|own| is_measured(own))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    let lower = *values.get((values.len() - 1) / 2)?;
    Some(f64::midpoint(lower, upper))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;

    fn speed(step: u8, value: f64, team: &str) -> PublishedFigure {
        PublishedFigure {
            quantity: PublishedQuantity::Speed,
            train: TrainId(24),
            step: SpeedStep::new(step).unwrap(),
            approach: Approach::Unknown,
            value,
            team: team.to_owned(),
            term: String::new(),
        }
    }

    fn ours(step: u8, value: f64, uncertainty: f64) -> Findings {
        let step = MotionStepForm {
            step: SpeedStep::new(step).unwrap(),
            approach: Approach::Below,
            speed: Quantity::new("mm/s", value, uncertainty, 9),
            stop: Quantity::new("mm", 500.0, 5.0, 0),
            stop_scatter_mm: 3.0,
            stop_s: 2.0,
        };
        let train = TrainFindings {
            train: TrainId(24),
            highest_step: SpeedStep::new(14).unwrap(),
            runs: 1,
            silent_runs: 0,
            contacts: 9,
            steps: vec![step],
            run_deviation_percent: 1.0,
            contact_scatter_mm: 5.0,
            sections: Vec::new(),
            laws: Vec::new(),
            stops: Vec::new(),
            suspicious: Vec::new(),
        };
        Findings {
            model_version: "1".into(),
            layout: "line".into(),
            polling: Vec::new(),
            trains: vec![train],
        }
    }

    #[test]
    fn a_difference_is_judged_by_how_far_teams_differ() {
        // Given two teams that differ by 10 % wherever both measured,
        let figures =
            [speed(8, 200.0, "a"), speed(8, 220.0, "b"), speed(9, 300.0, "a"), speed(9, 330.0, "b")];
        let check = CrossCheck::of(&ours(8, 210.0, 2.1), &figures).unwrap();
        // then one team has a spread of ln 1.1 / (0.6745 √2), and our uncertainty is another 1 %.
        let spread = 1.1_f64.ln() / (0.674_49 * 2.0_f64.sqrt());
        assert!((check.speed_spread_percent.unwrap() - 100.0 * spread).abs() < 1e-3);
        let [first, second] = check.speeds.as_slice() else { panic!("{check:?}") };
        let sigma = (2.0 * spread * spread + 0.01 * 0.01_f64).sqrt();
        assert!((first.sigma - sigma).abs() < 1e-5 && (first.difference_percent() - 5.0).abs() < 1e-9);
        assert!(first.agrees() && second.agrees() && second.sigmas() < 0.0);
        assert_eq!(check.without_counterpart, [4, 2]);
    }

    #[test]
    fn a_misprint_is_a_difference() {
        // Given five teams within a few percent, and one that wrote a digit too many,
        let figures = [("a", 200.0), ("b", 210.0), ("c", 2000.0), ("d", 205.0), ("e", 208.0), ("f", 203.0)]
            .map(|(team, value)| speed(8, value, team));
        let check = CrossCheck::of(&ours(8, 206.0, 2.0), &figures).unwrap();
        let differing: Vec<&str> = check
            .speeds
            .iter()
            .filter(|figure| !figure.agrees())
            .map(|figure| figure.team.as_str())
            .collect();
        assert_eq!(differing, ["c"]);
        let teams = CrossCheck::by_team(&check.speeds);
        assert_eq!(teams.iter().map(|team| team.agree).collect::<Vec<_>>(), [1, 1, 0, 1, 1, 1]);
    }

    #[test]
    fn figures_of_a_kind_that_one_team_measured_are_not_called_missing() {
        // Given speeds of two teams, a stop of one at a step that the recordings show, and one at a step that they do not,
        let stop = |step| PublishedFigure {
            quantity: PublishedQuantity::Stop(CountedFrom::Command),
            ..speed(step, 480.0, "a")
        };
        let figures = [speed(8, 200.0, "a"), speed(8, 220.0, "b"), stop(8), stop(9)];
        let mut shown = ours(8, 210.0, 2.1);
        shown.trains[0].steps[0].stop = Quantity::new("mm", 500.0, 5.0, 3);
        let check = CrossCheck::of(&shown, &figures).unwrap();
        // then the first cannot be judged, and only the second is one that the recordings do not show.
        assert_eq!((check.without_counterpart, check.spread_unknown), ([4, 1], 1));
        assert!(check.stops.is_empty());
    }

    #[test]
    fn one_team_or_foreign_trains_give_nothing_to_compare() {
        let one = [speed(8, 200.0, "a"), speed(9, 300.0, "a")];
        assert_eq!(CrossCheck::of(&ours(8, 1.0, 0.1), &one), Err(NothingToCompare::OneTeam));
        let two = [speed(8, 200.0, "a"), speed(8, 220.0, "b")];
        let nothing = CrossCheck::of(&ours(9, 1.0, 0.1), &two);
        assert_eq!(nothing, Err(NothingToCompare::NoCounterpart { figures: 2 }));
    }
}
