//! Every fault of the script at the simulated arm's edge, in virtual time:
//! what a client gets, and what the joints do.
#![allow(
    unreachable_pub,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    reason = "tests may fail loudly"
)]

mod arm;
mod bench;
mod link;
mod reports;
