//! What is simulated: a scenario, or a train of a file on a line of a file.

use std::path::Path;

use anyhow::{Context, anyhow};
use clap::ValueEnum;
use footplate_sim::line::{LineConditions, LineLevel, LineRun, LineScenario, LineService, LineWorld};
use footplate_store::{read_line, read_train};

/// Something that a seed makes a run of.
pub(super) enum World {
    Scenario(LineScenario),
    Service {
        name: String,
        service: Box<LineService>,
    },
    /// Drawn from ranges.
    Random(LineLevel),
}

/// What the operator of a random world knows of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum LevelName {
    /// Teeth, diameters, limits of speed and acceleration.
    #[value(name = "L0")]
    L0,
    /// The command, too.
    #[value(name = "L1")]
    L1,
    /// Brake, slide protection and gradients, too.
    #[value(name = "L2")]
    L2,
}

impl LevelName {
    pub(super) const fn level(self) -> LineLevel {
        match self {
            Self::L0 => LineLevel::L0,
            Self::L1 => LineLevel::L1,
            Self::L2 => LineLevel::L2,
        }
    }
}

/// Scenarios as a person names them.
#[derive(Debug, Clone)]
pub(super) struct Scenarios(pub(super) Vec<LineScenario>);

impl Scenarios {
    /// Reads the name of a scenario, several with commas between them, or `all`.
    pub(super) fn parse(names: &str) -> anyhow::Result<Self> {
        if names.eq_ignore_ascii_case("all") {
            return Ok(Self(LineScenario::all().to_vec()));
        }
        let known = || LineScenario::all().iter().map(LineScenario::name).collect::<Vec<_>>().join(", ");
        let named = |name: &str| {
            LineScenario::by_name(name.trim())
                .ok_or_else(|| anyhow!("there is no scenario `{name}`; there are {} and all", known()))
        };
        Ok(Self(names.split(',').map(named).collect::<anyhow::Result<_>>()?))
    }
}

impl World {
    /// A train that runs along a line, both from files.
    pub(super) fn service(train: &Path, line: &Path) -> anyhow::Result<Self> {
        let (train_file, line_file) = (read_train(train, None)?, read_line(line, None)?);
        let name = format!("{} on {}", train_file.train.name, line_file.line.name());
        let service = LineService::new(train_file.train, line_file.line)
            .with_context(|| format!("{} cannot run on {}", train.display(), line.display()))?;
        Ok(Self::Service { name, service: Box::new(service) })
    }

    /// What people call it.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Scenario(scenario) => scenario.name(),
            Self::Service { name, .. } => name,
            Self::Random(level) => level.name(),
        }
    }

    /// What files are called that are made of it.
    pub(super) fn file_name(&self) -> String {
        let plain = |letter: char| if letter.is_alphanumeric() { letter } else { '-' };
        let letters: String = self.name().chars().map(plain).collect();
        letters.split('-').filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-")
    }

    pub(super) fn run(&self, seed: u64, conditions: LineConditions) -> LineRun {
        match self {
            Self::Scenario(scenario) => scenario.run(seed, conditions),
            Self::Service { service, .. } => service.run(seed, conditions),
            Self::Random(level) => LineWorld::draw(seed).run(*level),
        }
    }
}
