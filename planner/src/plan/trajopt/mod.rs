//! CMA-ES-traj: the space that is searched for the joint waypoints of a throw.
//!
//! Paper, section "CMA-ES Trajectory Optimization" and appendix "Trajectory
//! Parameterization and Velocity Filtering": three joint-space waypoints at fixed
//! times, a cubic spline from the start pose, candidates that break a limit
//! rejected when they are drawn.

mod decode;
mod pole;
mod screen;

pub use decode::Dimensions;
pub(crate) use decode::{WAYPOINTS, WaypointSpace};
pub use pole::PolePose;
pub(crate) use pole::reach_pose;
pub use screen::Clearance;
pub(crate) use screen::Screen;
