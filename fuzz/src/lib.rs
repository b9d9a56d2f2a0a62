//! What is fuzzed: one module per kind of input. Each has `run`, which takes any
//! bytes and panics when something is wrong, and `seeds`, examples made by our own
//! encoders to begin with.
//!
//! `.ci/fuzz SECONDS` builds and runs them all. An input that fails is kept in
//! `fuzz/artifacts`; fix it with a test of the crate it fails in.

pub mod artefacts;
pub mod calibration;
pub mod configs;
pub mod messages;
pub mod recording;
pub mod seeds;
pub mod video;
pub mod wire;
