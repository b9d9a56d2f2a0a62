//! Experiments with ropes whose truth is known: what the results of the paper are made
//! from. The program `experiments` makes the results and the benchmarks.
#![forbid(unsafe_code)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::float_cmp,
        clippy::cast_precision_loss,
        reason = "tests may fail loudly"
    )
)]

pub mod trials;
