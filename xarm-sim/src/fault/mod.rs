//! Faults of arm and wire, injected by a script.
//!
//! A script is a TOML file with a list of `[[fault]]`; each entry says when
//! ([`Trigger`]), for how long, and what ([`FaultKind`]). The same script runs
//! in real and in virtual time. `configs/rig/faults.toml` shows every kind.

mod error;
pub mod kind;
mod parse;
mod runner;
mod schema;
mod script;

pub use error::FaultScriptError;
pub use kind::{FaultKind, ForeignWish, PortSet, ReportPort};

pub(super) use runner::{FaultRunner, Progress, Transition};
pub use script::{Fault, FaultScript, Trigger};
