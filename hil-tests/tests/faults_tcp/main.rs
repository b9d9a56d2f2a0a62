//! Faults over real sockets and real processes: the controller and its guardian
//! run as processes of their own, the simulated arm listens on TCP in this one.
//!
//! For each fault: the expected reaction, exactly one record of its cause, no
//! setpoint that breaks a limit, rest, and no motion without acknowledgement.
//! What must hold on a busy machine is asserted here; times are asserted in
//! virtual time, except the guardian's.
#![cfg(test)]
#![allow(unreachable_pub, reason = "a test")]

mod child;
mod commander;
mod errors;
mod flight;
mod joints;
mod link;
mod operator;
mod plans;
mod processes;
mod reports;
mod service;
mod stand;
