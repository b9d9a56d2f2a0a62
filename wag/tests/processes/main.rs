//! The processes of `wag` while one of them dies: what a running plan needs, it
//! has; what an operator withdraws, stops.
#![allow(
    unreachable_pub,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

mod demo;
mod identical;
mod operator;
mod shell;
#[path = "../support/mod.rs"]
mod support;
