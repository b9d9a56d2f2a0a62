//! The kinds of configuration, and what is built in of each.

use arm_model::{Cell, Limits};
use planner::PlannerConfig;
use rig_sim::{RigConfig, check};
use rt_controller::config::ControllerConfig;
use serde::de::DeserializeOwned;
use serde::de::Error as _;

/// What a file configures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// The planner: searches, fitness weights, identification, the wiggle.
    Planner,
    /// What the arm may do.
    Limits,
    /// The pole on the arm, and what stands around it.
    Cell,
    /// The controller: real-time set-up, monitors, guardian.
    Controller,
    /// The simulated rig: camera, arm lag, noise.
    Rig,
}

/// A type that a kind's file is read into.
pub trait Configured: DeserializeOwned {
    /// Its kind.
    const KIND: Kind;

    /// The same in a cell, where it has one.
    #[must_use]
    fn in_cell(self, _cell: Cell) -> Self {
        self
    }
}

impl Configured for Cell {
    const KIND: Kind = Kind::Cell;
}

impl Configured for PlannerConfig {
    const KIND: Kind = Kind::Planner;

    fn in_cell(self, cell: Cell) -> Self {
        Self { cell, ..self }
    }
}

impl Configured for Limits {
    const KIND: Kind = Kind::Limits;
}

impl Configured for ControllerConfig {
    const KIND: Kind = Kind::Controller;
}

impl Configured for RigConfig {
    const KIND: Kind = Kind::Rig;

    fn in_cell(self, cell: Cell) -> Self {
        Self { cell, ..self }
    }
}

impl Kind {
    /// Whether its configuration has a table `cell`: the cell that holds, written there for
    /// the process that reads it.
    pub fn has_cell(self) -> bool {
        matches!(self, Self::Planner | Self::Rig)
    }

    /// Its name in messages, its file in a site's or a rig's folder, and where its built-in
    /// text is in the sources, with that text.
    fn about(self) -> [&'static str; 4] {
        macro_rules! built_in {
            ($name:literal, $file:literal, $path:literal) => {
                [
                    $name,
                    $file,
                    $path,
                    include_str!(concat!("../../../", $path)),
                ]
            };
        }
        match self {
            Self::Planner => built_in!("planner", "planner.toml", "configs/planner/planner.toml"),
            Self::Limits => built_in!("limits", "limits.toml", "configs/robot/xarm7.toml"),
            Self::Cell => built_in!("cell", "cell.toml", "configs/cell/lab.toml"),
            Self::Controller => {
                built_in!(
                    "controller",
                    "rt-controller.toml",
                    "configs/rt/controller.toml"
                )
            }
            Self::Rig => built_in!("rig", "rig.toml", "configs/rig/demo.toml"),
        }
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        self.about()[0]
    }

    /// Its file in a site's or a rig's folder.
    pub fn file(self) -> &'static str {
        self.about()[1]
    }

    /// Where its built-in text is in the sources.
    pub fn built_in_path(self) -> &'static str {
        self.about()[2]
    }

    /// Its built-in text.
    pub fn built_in(self) -> &'static str {
        self.about()[3]
    }

    /// Whether a table can be read as this kind.
    pub fn accepts(self, table: toml::Table) -> Result<(), toml::de::Error> {
        match self {
            Self::Planner => table.try_into::<PlannerConfig>().map(drop),
            Self::Limits => table
                .try_into::<Limits>()
                .and_then(|limits| limits.check_rating().map_err(toml::de::Error::custom)),
            Self::Cell => table.try_into::<Cell>().map(drop),
            Self::Controller => table.try_into::<ControllerConfig>().map(drop),
            Self::Rig => table
                .try_into::<RigConfig>()
                .and_then(|rig| check(&rig).map_err(toml::de::Error::custom)),
        }
    }

    /// What is wrong with a text of this kind by itself: such an error knows its line.
    pub fn refusal_of(self, text: &str) -> Option<toml::de::Error> {
        match self {
            Self::Planner => toml::from_str::<PlannerConfig>(text).err(),
            Self::Limits => toml::from_str::<Limits>(text).err(),
            Self::Cell => toml::from_str::<Cell>(text).err(),
            Self::Controller => toml::from_str::<ControllerConfig>(text).err(),
            Self::Rig => toml::from_str::<RigConfig>(text).err(),
        }
    }
}
