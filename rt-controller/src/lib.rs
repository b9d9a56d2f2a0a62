//! Hard real-time controller that streams setpoints to an xArm 7.
//!
//! ```text
//!   other processes            this process                                 arm
//!                 requests  +-----------+ commands +--------------+ setpoints, 250 Hz
//!   wag  <----------------> |   bridge   |-------> | control loop | ---------------> command port
//!        <----------------- |           | <------ |  (real time) | <--------------- replies
//!         cycle records,    +-----------+ records +--------------+
//!         joint reports           ^                      ^
//!                                 |    joint reports     |
//!                                 +----[ receiver ]------+ <----------------------- report port
//! ```
//!
//! Read in this order: [`driver`] (one cycle, top to bottom), [`rt_loop`] (the thread
//! it runs in), [`control`] (the
//! pure core it steps), [`transport`] and [`xarm`] (the wire), then [`bridge`]
//! and [`process`] (everything that may wait).
//!
//! It plans no throws and knows no rope: it takes finished motions, checks them
//! against the limits, and streams them on time or stops. It is not a safety
//! function; the emergency stop and the arm's own limits are.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod arm_settings;
pub mod armed_speed;
pub mod bridge;
pub mod commander;
pub mod config;
pub mod error;
pub mod guardian;
pub mod loopback_bench;
pub mod os;
pub mod ports;
pub mod process;
pub mod recording;
pub mod report_stream;
pub mod rt_loop;
pub mod session;
pub mod set_up;
pub mod stopping;
pub mod transport;
pub mod warm_up;
mod watchdog;

pub use config::ControllerConfig;
pub use control_core::{clock_map, control, driver, overrun, point_to_point, report_feed, xarm};
pub use error::ControllerError;
pub use process::run;
