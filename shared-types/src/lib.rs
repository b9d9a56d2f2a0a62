//! The words every process of the system agrees on.
//!
//! Data flows one way: camera -> keypoints -> parameters -> plan -> setpoints -> record. This
//! crate holds the types that one of these stages hands to the next, and the shared-memory
//! services ([`ipc`]) through which processes meet.
//!
//! It is *not* a place for algorithms of one stage only, for files, or for
//! sockets.
//!
//! Conventions: SI units and radians everywhere; the unit comes last in the
//! name of a raw number (`timeout_ms`); the world frame `w` is the arm base
//! (x forward, z up, REP-103); `p_w_tip` is the tip's position expressed in `w`.
//!
//! Without the feature `std` it is what the control core needs and no more.
#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

extern crate alloc;

#[cfg(feature = "std")]
pub mod camera;
pub mod command_interface;
pub mod fault;
#[cfg(feature = "std")]
pub mod file_error;
pub mod ipc;
#[cfg(feature = "std")]
pub mod keypoints;
pub mod operating_mode;
#[cfg(feature = "std")]
pub mod plan;
#[cfg(feature = "std")]
pub mod rope;
#[cfg(feature = "std")]
pub mod rope_extras;
#[cfg(feature = "std")]
pub mod rope_state;
pub mod time;

#[cfg(feature = "std")]
pub use camera::{Intrinsics, Shutter, StereoCamera};
pub use command_interface::CommandInterface;
pub use fault::FaultCode;
#[cfg(feature = "std")]
pub use keypoints::{KeypointFrame, KeypointTrack};
pub use operating_mode::{Arming, OperatingMode};
#[cfg(feature = "std")]
pub use plan::{Condition, ErrorForecast, LimitedBy, Plan, Task, Verdict};
#[cfg(feature = "std")]
pub use rope::{RopeEstimate, RopeParams};
#[cfg(feature = "std")]
pub use rope_extras::{AirDrag, BendingFriction, RopeExtras};
#[cfg(feature = "std")]
pub use rope_state::RopeState;
pub use time::MonotonicNs;

/// Version of this build, written into every result file.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

#[cfg(test)]
mod tests {
    use super::*;
    use ipc::{CommandKind, ControllerMode, PreviewState};

    /// Raw numbers are part of recorded runs and of shared memory.
    #[test]
    fn numbers_come_back_and_unknown_ones_are_safe() {
        for raw in 0..=u8::MAX {
            let command = CommandKind::from_raw(raw).map(|kind| kind as u8);
            assert_eq!(command, (raw < 6).then_some(raw));
            let interface = CommandInterface::from_raw(raw).map(|interface| interface as u8);
            assert_eq!(interface, (raw < 2).then_some(raw));
            let armed = OperatingMode::from_raw(raw).map(|mode| mode as u8);
            assert_eq!(armed, (1..4).contains(&raw).then_some(raw));
            assert_eq!(ControllerMode::from_raw(raw) as u8, raw.min(5));
            let seen = if raw < 5 { raw } else { 0 };
            assert_eq!(PreviewState::from_raw(raw) as u8, seen);
        }
    }
}
