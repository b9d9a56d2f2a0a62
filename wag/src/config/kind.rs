//! The kinds of configuration, and what is built in of each.

use arm_model::{Cell, Limits};
use planner::PlannerConfig;
use rig_sim::RigConfig;
use rt_controller::config::ControllerConfig;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error as _};

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

/// What this program holds of a kind.
#[derive(Debug, Clone, Copy)]
pub struct BuiltIn {
    /// The kind's name in messages.
    pub name: &'static str,
    /// Its file in a site's or a rig's folder.
    pub file: &'static str,
    /// Where the built-in text is in the sources.
    pub path: &'static str,
    pub text: &'static str,
}

impl Kind {
    /// Whether its configuration has a table `cell`: the cell that holds, written there for
    /// the process that reads it.
    pub fn has_cell(self) -> bool {
        matches!(self, Self::Planner | Self::Rig)
    }

    pub fn built_in(self) -> BuiltIn {
        macro_rules! shipped {
            ($name:literal, $file:literal, $path:literal) => {
                BuiltIn {
                    name: $name,
                    file: $file,
                    path: $path,
                    text: include_str!(concat!("../../../", $path)),
                }
            };
        }
        match self {
            Self::Planner => shipped!("planner", "planner.toml", "configs/planner/planner.toml"),
            Self::Limits => shipped!("limits", "limits.toml", "configs/robot/xarm7.toml"),
            Self::Cell => shipped!("cell", "cell.toml", "configs/cell/lab.toml"),
            Self::Controller => {
                shipped!(
                    "controller",
                    "rt-controller.toml",
                    "configs/rt/controller.toml"
                )
            }
            Self::Rig => shipped!("rig", "rig.toml", "configs/rig/demo.toml"),
        }
    }

    pub fn name(self) -> &'static str {
        self.built_in().name
    }

    /// Whether something can be read as this kind. The error of a text knows its line.
    pub fn check<'de, D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        match self {
            Self::Planner => PlannerConfig::deserialize(from).map(drop),
            Self::Limits => Limits::deserialize(from)
                .and_then(|limits| limits.check_rating().map_err(D::Error::custom)),
            Self::Cell => Cell::deserialize(from).map(drop),
            Self::Controller => ControllerConfig::deserialize(from).map(drop),
            Self::Rig => RigConfig::deserialize(from)
                .and_then(|rig| rig_sim::check(&rig).map_err(D::Error::custom)),
        }
    }
}
