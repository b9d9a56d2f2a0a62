//! A simulated xArm 7 controller: same protocol, same ports, same refusals.
//!
//! [`model`] is the controller and its joints as a pure state machine: time and
//! requests go in, replies and reports come out. [`server`] puts sockets and
//! the monotonic clock around it. [`SimulatedArm`] is what the rest of the rig
//! holds: it knows the ports and the true motion of the joints.
//!
//! Where the vendor documents nothing, this arm does the plain thing: servo_j
//! outside mode 1 is taken and ignored; a decelerated stop ends in state 4; a
//! setpoint that breaks several limits raises the first of C23, C24 and C60.
//! The speed of a setpoint is its step over the mean interval of the stream,
//! at least 4 ms; a stream begins anew after 33 ms of silence.
//!
//! Left out, because nothing in the system uses it: Cartesian moves, hand
//! guiding, self-collision (C22) and collision (C31) detection, torques
//! (reported as zero), feedback pushes (clients fall back to polling).

pub mod clock;
pub mod config;
pub mod history;
mod joint;
pub mod model;
mod reference;
mod reports;
pub mod server;
mod servo;

pub use config::{ArmConfig, ArmStartError, JointLag};
pub use history::{JointSample, MotionHistory};
pub use model::{Answer, ArmModel};
pub use server::{ArmPorts, SimulatedArm, serve_forever};
