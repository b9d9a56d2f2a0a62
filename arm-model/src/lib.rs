//! The arm as every crate sees it: joints, kinematics, limits, trajectories, response.
//!
//! Pure functions and data: no clock, no socket, no file. Without the feature `std` it
//! is what the control core needs and no more, with the same bits on every machine.
//!
//! Conventions: SI units and radians; the world frame is the arm's base (x forward, z up,
//! REP-103).
//!
//! ```
//! use arm_model::{JointTrajectory, joint::START_POSE};
//!
//! let mut end = START_POSE;
//! end.0[0] += 0.2;
//! let motion = JointTrajectory::new(&[0.0, 1.0], &[START_POSE, end])?;
//! let halfway = motion.state_at(0.5);
//! assert!((halfway.q.0[0] - 0.1).abs() < 1e-12);
//! # Ok::<(), arm_model::TrajectoryError>(())
//! ```
#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

extern crate alloc;

pub mod capsules;
pub mod cell;
mod checked_length;
pub mod exact;
pub mod geometry;
pub mod joint;
pub mod kinematics;
pub mod limits;
pub mod piece;
#[cfg(feature = "std")]
pub mod response;
pub mod task_bodies;
pub mod trajectory;
mod unit;

pub use cell::{Cell, Pole};
pub use joint::{JOINTS, JointState, JointVector};
pub use limits::{Limits, LimitsSpec};
pub use piece::JointPiece;
#[cfg(feature = "std")]
pub use response::{ArmResponse, JointResponse, TrackingLag};
pub use trajectory::{JointTrajectory, TrajectoryError};
pub use unit::unit_hint;
