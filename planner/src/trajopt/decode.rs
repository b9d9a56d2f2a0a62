//! From search coordinates to joint trajectories.

use serde::{Deserialize, Serialize};
use shared_types::{JointTrajectory, JointVector, Limits, TrajectoryError};

/// Free waypoints of a throw (paper: three).
pub const WAYPOINTS: usize = 3;

/// Which joints a search moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dimensions {
    /// Joints 2, 4 and 6: motion in the plane that joint 1 has turned to the
    /// target's bearing; 9 coordinates.
    Planar,
    /// All joints; 21 coordinates.
    Full,
}

impl Dimensions {
    /// Moved joints, 0-based.
    #[must_use]
    pub fn joints(self) -> &'static [usize] {
        match self {
            Self::Planar => &[1, 3, 5],
            Self::Full => &[0, 1, 2, 3, 4, 5, 6],
        }
    }

    /// Number of search coordinates.
    #[must_use]
    pub fn count(self) -> usize {
        WAYPOINTS * self.joints().len()
    }
}

/// The space of throws that leave `start` and pass three waypoints. A point of
/// it lists the moved joints (rad) of the first waypoint, then of the second and
/// the third.
#[derive(Debug, Clone, PartialEq)]
pub struct WaypointSpace {
    /// Pose at rest from which the throw starts (rad).
    pub start: JointVector,
    /// Which joints move.
    pub dimensions: Dimensions,
    /// Times of the waypoints after the start (s), increasing.
    pub times_s: [f64; WAYPOINTS],
}

impl WaypointSpace {
    /// The point that stays in the start pose.
    #[must_use]
    pub fn resting(&self) -> Vec<f64> {
        let joints = self.dimensions.joints();
        (0..WAYPOINTS)
            .flat_map(|_| joints.iter().map(|&j| self.start[j]))
            .collect()
    }

    /// Joint ranges per coordinate as (lower, upper) (rad).
    #[must_use]
    pub fn bounds(&self, limits: &Limits) -> (Vec<f64>, Vec<f64>) {
        let joints = self.dimensions.joints();
        (0..WAYPOINTS)
            .flat_map(|_| joints.iter())
            .map(|&j| (limits.position_min_rad[j], limits.position_max_rad[j]))
            .unzip()
    }

    /// Times of all knots of the spline, start included (s).
    #[must_use]
    pub fn knot_times_s(&self) -> [f64; WAYPOINTS + 1] {
        let mut out = [0.0; WAYPOINTS + 1];
        out[1..].copy_from_slice(&self.times_s);
        out
    }

    /// Poses at all knots of the spline, start included (rad). Missing
    /// coordinates stay at the start pose.
    #[must_use]
    pub fn knots(&self, x: &[f64]) -> [JointVector; WAYPOINTS + 1] {
        let joints = self.dimensions.joints();
        let mut out = [self.start; WAYPOINTS + 1];
        for (knot, part) in out[1..].iter_mut().zip(x.chunks(joints.len())) {
            for (&j, value) in joints.iter().zip(part) {
                knot[j] = *value;
            }
        }
        out
    }

    /// The trajectory of a point.
    ///
    /// # Errors
    /// Numbers that are not finite, waypoint times out of order.
    pub fn decode(&self, x: &[f64]) -> Result<JointTrajectory, TrajectoryError> {
        JointTrajectory::new(&self.knot_times_s(), &self.knots(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::plan::START_POSE;

    #[test]
    fn coordinates_land_on_their_joints_and_waypoints() {
        for dimensions in [Dimensions::Planar, Dimensions::Full] {
            let space = WaypointSpace {
                start: START_POSE,
                dimensions,
                times_s: [0.4, 0.8, 1.1],
            };
            let mut x = space.resting();
            assert_eq!(x.len(), dimensions.count());
            let rest = space.decode(&x).unwrap();
            assert_eq!(rest.start(), rest.end());
            let per_waypoint = dimensions.joints().len();
            x[per_waypoint] += 0.25;
            let moved = space.decode(&x).unwrap();
            let joint = dimensions.joints()[0];
            assert!((moved.waypoints()[2][joint] - START_POSE[joint] - 0.25).abs() < 1e-12);
            assert_eq!(moved.waypoints()[1], START_POSE);
            assert_eq!(moved.times_s(), &[0.0, 0.4, 0.8, 1.1]);
        }
    }
}
