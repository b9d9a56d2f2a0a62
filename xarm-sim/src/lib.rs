//! A simulated xArm 7 controller: same protocol, same ports, same refusals.
//!
//! [`model`] is the controller and its joints as a pure state machine: time and
//! requests go in, replies and joint motion come out. [`endpoint`] adds
//! connections, report streams and the faults of a script ([`fault`]), still
//! without sockets or clocks. [`server`] puts sockets and the monotonic clock
//! around it. [`SimulatedArm`] is what the rest of the rig holds: it knows the
//! ports and the true motion of the joints.
//!
//! Where the vendor documents nothing, this arm does the plain thing: servo_j
//! outside mode 1 is taken and ignored; a decelerated stop ends in state 4; a
//! setpoint that breaks several limits raises the first of C23, C24, C60, C22
//! and C35. The speed of a setpoint is its step over the mean interval of the
//! stream, at least 4 ms; a stream begins anew after 33 ms of silence. Velocity
//! commands accelerate with the vendor's largest jerk and acceleration. Torques
//! and currents are plausible, no more.
//!
//! Refused as unknown commands (status 0x08, warning 13), because nothing in the
//! system uses them: Cartesian moves and setpoints (registers 21, 30, 82),
//! blended moves (24), inverse kinematics (43) and the TCP limit test (46).
//! Reduced mode is stored and told, but limits nothing.

#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod clock;
pub mod collision;
pub mod config;
mod controller_clock;
pub mod endpoint;
pub mod event;
pub mod fault;
mod feedback;
pub mod firmware;
pub mod history;
mod joint;
pub mod model;
mod pacer;
mod reference;
mod reports;
pub mod server;
mod servo;
mod setpoint_check;
mod start_error;
mod velocity;

pub use collision::Obstacle;
pub use config::ArmConfig;
pub use controller_clock::ControllerClock;
pub use endpoint::{ArmEndpoint, Closing, ConnectRefused, Service};
pub use event::{ArmCounters, ArmEvent, TimedEvent};
pub use fault::{Fault, FaultKind, FaultScript, FaultScriptError, Trigger};
pub use firmware::Firmware;
pub use history::{History, JointSample};
pub use joint::JointLag;
pub use model::{Answer, AnswerData, ArmModel};
pub use pacer::Intake;
pub use reports::ReportKind;
pub use server::{ArmPorts, SimulatedArm};
pub use start_error::ArmStartError;
