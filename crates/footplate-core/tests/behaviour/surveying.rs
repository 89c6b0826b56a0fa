//! Trains survey a layout of which one length is known: lengths and their uncertainty follow from ratios of times.
//!
//! A train that takes `t₁` over the known length `l₁` and `t₂` over another says `l₂ = l₁ t₂ / t₁`. So the relative variances of
//! all three add up: `(σ₂/l₂)² = (σ₁/l₁)² + p₁/l₁² + p₂/l₂²`, with `p` what a train measures a section wrong, however often it runs
//! over it. Curves and sensors are the same for all trains, which is half of `p`; the other half falls with their number.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use std::sync::OnceLock;

use footplate_core::model::MotionFit;
use footplate_core::model::survey::{SectionIndex, TrackSurvey};
use footplate_core::track::{Hop, Layout, Leg, StretchLength, Survey};
use footplate_core::{Command, Length, SpeedStep, TimeSpan, TrainId, TurnoutId};

use crate::toy_railway::{ToyRailway, layout, step};

/// Of the length that was measured: D1 to A1, 900 mm.
const TAPE_MM: f64 = 2.0;
/// The known length, and what trains run over: A1 to B1, B1 to D1, and over both curves A1 to C1, C1 to D1.
const TRUE_MM: [(&str, &str, f64); 5] =
    [("D1", "A1", 900.0), ("A1", "B1", 700.0), ("B1", "D1", 700.0), ("A1", "C1", 720.0), ("C1", "D1", 650.0)];

/// The layout of the toy railway, with one known length.
fn bare() -> Layout {
    let lengths: Vec<StretchLength> = layout()
        .edges()
        .step_by(2)
        .map(|(_, edge)| match edge.known {
            StretchLength::Measured(length) if length == Length::from_mm(900.0) && edge.to.0 < 4 => {
                edge.known
            }
            _ => StretchLength::Unknown,
        })
        .collect();
    layout().surveyed(&lengths, Survey::taped(Length::from_mm(TAPE_MM), "one tape".into())).unwrap()
}

/// A train that ran some laps at four speeds over either leg; its wheels make all lengths longer by a factor.
fn runs(on: &Layout, train: u16, wheels: f64, legs: &[Leg]) -> MotionFit {
    let mut world = ToyRailway::new(train, "D1", 300.0);
    world.trains[0].wheels = 1.0 / wheels;
    let id = TrainId(train);
    let mut fit = MotionFit::new(id, step(14));
    for leg in legs {
        for turnout in [1, 2].map(TurnoutId) {
            world.turnouts.set(turnout, *leg);
        }
        for speed in [6, 8, 10, 12] {
            for (step, seconds) in [(step(speed), 30.0), (SpeedStep::STAND, 6.0)] {
                world.command(Command::Speed { train: id, step });
                let end = world.now + TimeSpan::from_s(seconds);
                while world.now < end {
                    for event in world.tick() {
                        fit.take(on, &world.turnouts, &event);
                    }
                }
            }
        }
    }
    fit.refit(&SectionIndex::of(on));
    fit
}

const BOTH: [Leg; 2] = [Leg::Straight, Leg::Curved];

fn two_trains() -> &'static [MotionFit; 2] {
    static TRAINS: OnceLock<[MotionFit; 2]> = OnceLock::new();
    TRAINS.get_or_init(|| [runs(&bare(), 24, 1.0, &BOTH), runs(&bare(), 25, 1.03, &BOTH)])
}

fn square(mm: f64) -> f64 {
    mm * mm
}

/// What trains measure a section wrong, however often they run over it (mm²): 2 % of it, and 5 mm at either sensor.
fn own_variance(mm: f64) -> f64 {
    square(0.02 * mm) + 2.0 * square(5.0)
}

fn hop<'l>(on: &'l Layout, from: &str, to: &str) -> Hop<'l> {
    on.hops().find(|hop| on.node_name(hop.from) == from && on.node_name(hop.to) == to).unwrap()
}

/// The surveyed distance between two sensors and its standard deviation (mm).
fn distance(on: &Layout, survey: &TrackSurvey, from: &str, to: &str) -> Option<[f64; 2]> {
    let section = SectionIndex::of(on).section(hop(on, from, to).id).unwrap();
    survey.distance(section).map(|known| known.map(Length::as_mm))
}

#[test]
fn lengths_follow_from_one_that_is_known_and_are_as_uncertain_as_ratios_of_times() {
    let bare = bare();
    let sections = SectionIndex::of(&bare);
    let [one, other] = two_trains();
    for (trains, common) in [(vec![one], 1.0), (vec![one, other], 0.75)] {
        let survey = TrackSurvey::of(&bare, &sections, &trains).unwrap();
        let [(_, _, known), others @ ..] = TRUE_MM;
        let of_known = square(TAPE_MM) + common * own_variance(known);
        for (from, to, mm) in others {
            let [length, deviation] = distance(&bare, &survey, from, to).unwrap();
            let expected = (square(mm / known) * of_known + common * own_variance(mm)).sqrt();
            // Sensors close where the layout has them, so that polls alone are left: millimetres.
            assert!((length - mm).abs() < 4.0, "{from} {to}: {length} mm");
            assert!((deviation / expected - 1.0).abs() < 0.02, "{from} {to}: {deviation}, not {expected} mm");
        }
        let [length, deviation] = distance(&bare, &survey, "D1", "A1").unwrap();
        assert!((length - known).abs() < 0.1 && (deviation - TAPE_MM).abs() < 0.01, "{length} {deviation}");
        // Their sum: the tape and its section count for all, the others each by itself.
        let sum: f64 = TRUE_MM.iter().map(|(.., mm)| mm).sum();
        let own: f64 = others.iter().map(|(.., mm)| common * own_variance(*mm)).sum();
        let variance = square(sum / known * TAPE_MM)
            + square((sum - known) / known) * common * own_variance(known)
            + own;
        let scale = variance.sqrt() / sum;
        assert!((survey.scale() / scale - 1.0).abs() < 0.02, "{}, not {scale}", survey.scale());
        assert_eq!(distance(&bare, &survey, "E1", "F1"), None, "no train ran there");
    }
    assert!(TrackSurvey::of(&bare, &sections, &[]).is_none());
}

#[test]
fn a_survey_is_written_into_the_layout_and_counts_in_the_next_one() {
    let bare = bare();
    let [one, _] = two_trains();
    let survey = TrackSurvey::of(&bare, &SectionIndex::of(&bare), &[one]).unwrap();
    let surveyed = survey.applied_to(&bare, &SectionIndex::of(&bare)).unwrap();
    let sections = SectionIndex::of(&surveyed);
    for (from, to, mm) in TRUE_MM {
        // The layout knows the distance as the survey does: by itself, and with all that lengths have in common.
        let hop = hop(&surveyed, from, to);
        let [length, deviation] = distance(&bare, &survey, from, to).unwrap();
        assert!((hop.length.as_mm() - length).abs() < 0.1, "{from} {to}: {:?}, not {length} mm", hop.length);
        let own = 1e6 * sections.survey_variance(sections.section(hop.id).unwrap());
        let by_itself = square(deviation) - square(survey.scale() * mm);
        assert!(
            (own - by_itself.max(1.0)).abs() < 0.02 * by_itself.max(50.0),
            "{from} {to}: {own}, not {by_itself}"
        );
    }
    assert!((surveyed.survey().scale - survey.scale()).abs() < 1e-12);
    // Of edges where no train ran, nothing is known.
    let unknown = surveyed.edges().filter(|(_, edge)| edge.known == StretchLength::Unknown).count();
    assert_eq!(unknown, 2 * 3, "to E1, to F1, and beyond it");
    // Given a second train that runs over one leg only,
    let second = runs(&surveyed, 25, 1.03, &[Leg::Curved]);
    let again = TrackSurvey::of(&surveyed, &sections, &[&second]).unwrap();
    let alone = TrackSurvey::of(&bare, &SectionIndex::of(&bare), &[&second]).unwrap();
    for (from, to, mm) in [("A1", "C1", 720.0), ("C1", "D1", 650.0)] {
        // then what was known and what it says count each by its variance, the tape's share of both aside.
        let [length, deviation] = distance(&surveyed, &again, from, to).unwrap();
        assert!((length - mm).abs() < 4.0, "{from} {to}: {length} mm");
        let known = square(distance(&bare, &survey, from, to).unwrap()[1]) - square(survey.scale() * mm);
        let says = square(distance(&bare, &alone, from, to).unwrap()[1]);
        let both = (known * says / (known + says)).sqrt();
        assert!((deviation / both - 1.0).abs() < 0.1, "{from} {to}: {deviation}, not {both} mm");
    }
    assert_eq!(distance(&surveyed, &again, "A1", "B1"), None, "it did not run there");
}
