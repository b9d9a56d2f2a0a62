//! CMA-ES-traj: the search for joint waypoints of a throw.
//!
//! Paper, section "CMA-ES Trajectory Optimization" and appendix "Trajectory
//! Parameterization and Velocity Filtering": three joint-space waypoints at fixed
//! times, a cubic spline from the start pose, candidates that break a limit
//! rejected when they are drawn.

mod decode;
mod pole;
mod polish;
mod screen;
mod search;

pub use decode::{Dimensions, WAYPOINTS, WaypointSpace};
pub use pole::{PolePose, reach_pose};
pub use polish::{Polish, Polished, polish};
pub use screen::{Clearance, Screen};
pub use search::{Found, SearchOptions, SearchResult, Value, Valued, search};
