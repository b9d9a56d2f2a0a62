//! Faults of arm and wire, injected by a script.
//!
//! A script is a TOML file with a list of `[[fault]]`; each entry says when
//! ([`Trigger`]), for how long, and what ([`FaultKind`]). The same script runs
//! in real and in virtual time. `configs/rig/faults.toml` shows every kind.

pub mod kind;
mod runner;
mod script;

pub use kind::{FaultKind, ForeignRequest, PortSet, ReportPort};
pub use script::{Fault, FaultScript, FaultScriptError, Trigger};

pub(super) use runner::{FaultRunner, Progress};
