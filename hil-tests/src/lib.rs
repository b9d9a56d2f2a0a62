//! The simulated rig: an arm controller that speaks the real protocol, and what
//! stands around it.
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::float_cmp,
        reason = "tests may fail loudly"
    )
)]

pub mod arm;
pub mod hidden;
pub mod render;
pub mod rig;
pub mod virtual_rig;
pub mod wiggle_film;
