//! The processes of `wag` while one of them dies: what a running plan needs, it
//! has; what an operator withdraws, stops.
#![cfg(test)]

mod demo;
mod identical;
mod kill;
mod operator;
mod shell;
#[path = "../support/mod.rs"]
mod support;
