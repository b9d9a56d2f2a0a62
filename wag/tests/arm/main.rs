//! `wag rig`, and `wag wiggle` on it with what records a run, guards it and reads it.
#![cfg(test)]

mod fast;
mod guardian;
mod recorded;
mod rig;
mod run;
mod service;
#[path = "../support/mod.rs"]
mod support;
