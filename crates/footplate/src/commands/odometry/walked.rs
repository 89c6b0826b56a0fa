//! What all recordings of one call come to, and whether that is good enough.

use footplate_store::odometry::{OdometryScore, Preset, RunScores};

use super::recording::WalkedRecording;
use crate::commands::web_page::Language;
use crate::counted::counted;

/// Least share of periods whose true speed has to lie within the interval (per cent): that it holds is promised for
/// all but one period in ten thousand.
pub(in crate::commands) const SPEED_INSIDE_PCT: f64 = 99.99;

/// Share of periods in which claims may be contradicted before they do not hold: rows that were read late.
const CONTRADICTED: f64 = 1e-3;
/// Share of periods after a gap beyond which a recording is not what it says: losses are rarer, another unit of time is not.
const GAPS: f64 = 0.5;
/// What is said without a vehicle file.
pub(super) const fn no_vehicle(language: Language) -> &'static str {
    match language {
        Language::English => {
            "no vehicle file: teeth, diameters and limits are those of a built-in example, so every speed and distance is \
             wrong by the ratio of the pulse pitches and no bound is guaranteed; describe the train with --vehicle FILE \
             (docs/formats/vehicle.md)"
        }
        Language::German => {
            "keine Fahrzeugdatei: Zähne, Durchmesser und Grenzen sind die eines eingebauten Beispiels; alle \
             Geschwindigkeiten und Wege sind daher im Verhältnis der Wege je Impuls falsch, und keine Grenze ist \
             garantiert; der Zug wird mit --vehicle DATEI beschrieben (docs/formats/vehicle.md)"
        }
    }
}

/// What all recordings of one call come to.
pub(super) struct Walked {
    /// What people call the vehicle.
    pub(super) vehicle: String,
    pub(super) preset: Preset,
    pub(super) recordings: Vec<WalkedRecording>,
    /// Whether a vehicle file says what the train is.
    pub(super) has_vehicle: bool,
    /// The probability of the confidence intervals.
    pub(super) confidence: f64,
    /// In which a page says it.
    pub(super) language: Language,
    /// Whether a score was asked for; a page has one wherever the truth is known.
    pub(super) is_scored: bool,
}

impl Walked {
    /// The probability of the confidence intervals in per cent, with no more digits than it has.
    pub(super) fn confidence_pct(&self) -> String {
        let digits = format!("{:.7}", 100.0 * self.confidence);
        digits.trim_end_matches('0').trim_end_matches('.').to_owned()
    }

    /// The scores of all runs together, if that was asked for.
    pub(super) fn scores(&self) -> Option<RunScores> {
        if self.is_scored { self.known_scores() } else { None }
    }

    /// The scores of all runs whose truth is known.
    pub(super) fn known_scores(&self) -> Option<RunScores> {
        let runs = self.recordings.iter().flat_map(|recording| &recording.runs);
        let mut scores = runs.filter_map(|run| run.odometry.scores());
        let mut all = scores.next()?.clone();
        for scores in scores {
            all.merge(scores);
        }
        Some(all)
    }

    /// Whether the truth left the guaranteed bounds, or what they rest on is missing or does not hold.
    pub(super) fn falls_short(&self) -> bool {
        self.scores().is_some_and(|scores| leaves_bounds(&scores.preset(self.preset)))
            || !self.warnings(Language::English).is_empty()
    }

    /// What makes every figure uncertain: no vehicle file, or claims of it that a run contradicts.
    pub(super) fn warnings(&self, language: Language) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.has_vehicle {
            warnings.push(no_vehicle(language).to_owned());
        }
        for recording in &self.recordings {
            let periods: u64 = recording.runs.iter().map(|run| run.odometry.summary().periods).sum();
            let gaps = recording.time_faults.gaps;
            if gaps as f64 > GAPS * periods as f64 {
                let file = &recording.file;
                warnings.push(match language {
                    Language::English => format!(
                        "{file}: {gaps} of {periods} periods follow a gap, so hardly any speed is estimated; is t_s in \
                         seconds, and is every period in the file?"
                    ),
                    Language::German => format!(
                        "{file}: {gaps} von {periods} Perioden folgen auf eine Lücke, daher wird kaum ein Tempo geschätzt; \
                         ist t_s in Sekunden, und sind alle Perioden in der Datei?"
                    ),
                });
            }
            for run in &recording.runs {
                let claims = run.odometry.implausible_claims();
                let periods = run.odometry.summary().periods;
                let name = match (run.id.as_deref(), language) {
                    (None, _) => String::new(),
                    (Some(id), Language::English) => format!(", run {id}"),
                    (Some(id), Language::German) => format!(", Fahrt {id}"),
                };
                let file = &recording.file;
                let mut warn = |what: String| warnings.push(format!("{file}{name}: {what}"));
                if claims.contradicted as f64 > CONTRADICTED * periods as f64 {
                    warn(match language {
                        Language::English => format!(
                            "in {} no speed agrees with both the counts and the vehicle file: the guaranteed bounds do \
                             not hold; check max_traction_m_s2, max_brake_m_s2 and [brake_command]",
                            counted(claims.contradicted, "period")
                        ),
                        Language::German => format!(
                            "in {} Perioden passt keine Geschwindigkeit zu Impulsen und Fahrzeugdatei: die garantierten \
                             Grenzen gelten nicht; max_traction_m_s2, max_brake_m_s2 und [brake_command] prüfen",
                            claims.contradicted
                        ),
                    });
                }
                if claims.above_top > 0 {
                    warn(match language {
                        Language::English => format!(
                            "both wheelsets turn faster than max_speed_m_s in {}; check it, teeth and diameter_m",
                            counted(claims.above_top, "period")
                        ),
                        Language::German => format!(
                            "in {} Perioden drehen beide Radsätze schneller als max_speed_m_s; diesen Wert, teeth und \
                             diameter_m prüfen",
                            claims.above_top
                        ),
                    });
                }
                for (wheelset, scale) in claims.diameters.into_iter().enumerate() {
                    let Some(scale) = scale else { continue };
                    let wheelset = wheelset + 1;
                    warn(match language {
                        Language::English => format!(
                            "by the known places, wheelset {wheelset} is {scale:.4} times as large as diameter_m says, \
                             beyond diameter_tolerance; measure it"
                        ),
                        Language::German => format!(
                            "nach den bekannten Orten ist Radsatz {wheelset} {scale:.4} mal so groß, wie diameter_m sagt, \
                             mehr als diameter_tolerance erlaubt; nachmessen"
                        ),
                    });
                }
            }
        }
        warnings
    }
}

/// Whether the truth left the intervals of speed and distance more often than they promise.
pub(super) fn leaves_bounds(score: &OdometryScore) -> bool {
    score.speed_inside_pct.is_some_and(|share| share < SPEED_INSIDE_PCT)
        || score.distance_inside_pct.is_some_and(|share| share < 100.0)
}
