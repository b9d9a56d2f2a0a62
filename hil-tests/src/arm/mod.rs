//! A simulated xArm 7 controller: same protocol, same ports, same refusals.
//!
//! [`model`] is the controller and its joints as a pure state machine: time and
//! requests go in, replies and reports come out. [`server`] puts sockets and
//! the monotonic clock around it. [`SimulatedArm`] is what the rest of the rig
//! holds: it knows the ports and the true motion of the joints.
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
