//! The 36 faults of `docs/src/faults.md`, each a test in virtual time: the real
//! control core, pacing and command link against the simulated arm.
//!
//! [`stage`] sets a throw up, [`judge`] says what every stop must look like,
//! whatever its cause; the other modules hold the faults by family.
#![cfg(test)]
#![allow(clippy::float_cmp, reason = "tests compare exact numbers")]

mod arm;
mod judge;
mod limits;
mod link;
mod machine;
mod measured_lag;
mod operator;
mod plan;
mod processes;
mod reports;
mod rig;
mod stage;
mod tracking;
