//! `wag` from files to files, as its users start it: what it reads, writes and refuses.
#![cfg(test)]

mod bad_input;
mod cases;
mod cell;
mod config;
mod files;
mod plan;
mod report;
mod sim;
mod streams;
#[path = "../support/mod.rs"]
mod support;
