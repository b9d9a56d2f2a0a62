//! What decides in the controller, free of the machine it runs on.
//!
//! No clock, no I/O, no `std`: bytes and instants come in, setpoints and bytes go
//! out, and the same numbers come out on every machine. [`control`] is the core
//! that the real-time loop steps, [`driver`] the cycle around it, [`xarm`] the arm's protocol, [`overrun`] the
//! pacing, [`clock_map`] the arm's clock on ours; [`point_to_point`] plans the
//! moves that the controller makes itself, before they begin.
//!
//! Memory is fixed, but for the box in which a motion comes and goes back. The
//! crate `rt-controller` gives it a thread, sockets and shared memory; a
//! microcontroller would give it a timer and a MAC. `no-std-check` beside it
//! shows that it links without `std`.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

extern crate alloc;

pub mod clock_map;
pub mod control;
pub mod driver;
pub mod overrun;
pub mod point_to_point;
pub mod report_feed;
pub mod transport;
pub mod xarm;
