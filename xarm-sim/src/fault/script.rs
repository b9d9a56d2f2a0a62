//! Scripts: which fault, when, and for how long.

use super::error::FaultScriptError;
use super::kind::FaultKind;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// When a fault begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trigger {
    /// At a time since the arm was switched on (s): `at_s = 2.5`.
    At(f64),
    /// With the N-th motion command, setpoint or velocity, that the arm takes
    /// up: `on = "first_setpoint"`, `on = "setpoint:250"`.
    Setpoint(u64),
    /// When a motion has run for a part of its length:
    /// `on = "motion:50"`, `motion_s = 1.6`, `motion = 2`.
    Motion {
        /// Part of the length (0 to 1).
        part: f64,
        /// Length of the motion (s); the arm cannot know it.
        length_s: f64,
        /// Which motion since the arm was switched on, from 1.
        number: u32,
    },
    /// When a joint is asked to move faster than this (rad/s):
    /// `on = "speed:1.5"`.
    Speed(f64),
}

/// A fault to inject.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// When it begins.
    pub trigger: Trigger,
    /// How long it lasts (s); `None` is for ever, or a moment.
    pub duration_s: Option<f64>,
    /// What happens.
    pub kind: FaultKind,
}

/// The faults of a run; none by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<toml::Table>", into = "Vec<toml::Table>")]
pub struct FaultScript {
    /// In the order of the file.
    pub faults: Vec<Fault>,
}

impl FaultScript {
    /// Reads a script.
    ///
    /// # Errors
    /// [`FaultScriptError`], which names file, entry, field and allowed values.
    pub fn read(path: &Path) -> Result<Self, FaultScriptError> {
        let in_file = |error: FaultScriptError| error.in_file(path);
        let text = std::fs::read_to_string(path).map_err(|source| FaultScriptError::Read {
            path: path.to_owned(),
            source,
        })?;
        text.parse().map_err(in_file)
    }

    /// A script of one fault.
    #[must_use]
    pub fn one(trigger: Trigger, duration_s: Option<f64>, kind: FaultKind) -> Self {
        Self {
            faults: vec![Fault {
                trigger,
                duration_s,
                kind,
            }],
        }
    }

    /// Whether there is nothing to inject.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.faults.is_empty()
    }
}
