//! The control core: pure, no clock, no I/O, no allocation.
//!
//! [`ControlState::step`] turns what one cycle knows into one setpoint at most.
//! Everything it decides by is here: modes ([`mode`]), motions ([`motion`],
//! [`phases`], [`brake`]), the limiter that every setpoint passes ([`limiter`])
//! and the monitors ([`monitor`]). Time is the cycle's planned deadline, so a
//! recorded run can be stepped again with the same result.
//!
//! It uses `core`, and `alloc` for the one box a motion comes in.
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

pub mod arming;
pub mod brake;
mod commands;
pub mod cycle;
pub mod exchange;
mod faults;
pub mod limiter;
pub mod mode;
pub mod monitor;
pub mod motion;
pub mod phases;
pub mod reaction;
pub mod record;
pub mod settings;
pub mod snapshot;
pub mod stopping;
pub mod time_scaling;
pub mod velocity_interface;
pub mod violation;

pub use cycle::ControlState;
pub use exchange::{
    ArmCodes, ArmCommand, ControlCommand, ControlEvent, CycleInput, CycleOutput, LinkInput,
};
pub use motion::Motion;
pub use settings::{ControlSettings, OperatingModeSpeeds, Thresholds};
