//! What the project's command-line programs share: text and JSON on the standard
//! streams, tables, progress, failures with their exit codes.
//!
//! `#[macro_use] extern crate cli_output;` puts this crate's `print!`, `println!`,
//! `eprint!` and `eprintln!` in the place of the standard ones.
//!
//! Exit codes: 0 done, 1 ran and failed, 2 bad usage or input.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

// First: its macros stand for the standard ones everywhere below.
#[macro_use]
pub mod output;

pub mod event;
#[macro_use]
mod failure;
mod machine;
mod program;
mod progress;
pub mod table;

#[doc(hidden)]
pub use anyhow::anyhow;
pub use failure::{Failure, OrInput, Outcome, nearest};
pub use machine::Machine;
pub use program::{
    finish, interrupted, is_interrupted, parse, refuse_usage, seed, start, watch_interrupts,
    watch_parent,
};
pub use progress::Stage;
