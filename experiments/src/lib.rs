//! Experiments with ropes whose truth is known: what the results of the paper are made
//! from. The program `experiments` makes the results and the benchmarks.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod trials;
