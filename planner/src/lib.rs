//! Identifies rope parameters from one filmed wiggle and plans throws.
//!
//! Two searches share one strategy, [`cmaes`]: [`sysid`] fits the rope's
//! parameters to keypoints (the paper's Φ-CMA-ES), and [`tasks`] finds the joint
//! waypoints of a throw (CMA-ES-traj) with the pieces of [`trajopt`] and
//! [`collide`]. [`wiggle`] makes the motion that is filmed. [`response`] finds how
//! the arm follows its setpoints, and [`preflight`] says what it will make of a plan. [`filming`] makes recordings of known ropes with
//! the errors of real ones. The physics is that of `rope-sim`.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod calm;
pub mod cmaes;
pub mod collide;
pub mod filming;
pub mod observation;
pub mod phi;
pub mod preflight;
pub mod process;
pub mod response;
pub mod ropes;
pub mod sysid;
pub mod tasks;
pub mod trajopt;
pub mod wiggle;
pub mod wiggle_design;
pub mod workers;
