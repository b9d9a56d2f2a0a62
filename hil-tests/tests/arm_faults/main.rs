//! Every fault of the script at the simulated arm's edge, in virtual time:
//! what a client gets, and what the joints do.
#![cfg(test)]
#![allow(unreachable_pub, clippy::float_cmp, reason = "a test")]

mod arm;
mod link;
mod reports;
mod scenario;
