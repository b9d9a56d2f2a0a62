//! The space in which a throw is searched for (CMA-ES-traj), and its trajectories.
//!
//! Paper, section "CMA-ES Trajectory Optimization" and appendix "Trajectory
//! Parameterization and Velocity Filtering": three joint-space waypoints at fixed
//! times, a cubic spline from the start pose, candidates that break a limit
//! rejected when they are drawn.

use arm_model::{JointTrajectory, JointVector, Limits, TrajectoryError};
use serde::{Deserialize, Serialize};

/// Free waypoints of a throw (paper: three).
pub(super) const WAYPOINTS: usize = 3;

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

    /// Number of coordinates of the waypoints.
    #[must_use]
    pub fn count(self) -> usize {
        WAYPOINTS * self.joints().len()
    }
}

/// The space of throws that leave `start` and pass three waypoints. A point of
/// it lists the moved joints (rad) of the first waypoint, then of the second and
/// the third; where the whole throw may be turned, by how much (rad); where the times are
/// free too, the logarithm of how much each of the three segments is stretched.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WaypointSpace {
    /// Pose at rest from which the throw starts (rad).
    pub start: JointVector,
    /// Which joints move.
    pub dimensions: Dimensions,
    /// Times of the waypoints after the start (s), increasing.
    pub times_s: [f64; WAYPOINTS],
    /// Most by which joint 1 is turned all along, start included (rad); 0 where it keeps
    /// the target's bearing. A rope that curls leaves the plane of the throw.
    pub turn_max_rad: f64,
    /// Whether the arm stands at the start already: joint 1 turns on the way then.
    pub stands: bool,
    /// Most by which a segment between these times is stretched or shrunk (1); 1
    /// where they are fixed, as in the paper.
    pub stretch_max: f64,
}

impl WaypointSpace {
    /// Whether the times of the waypoints are free.
    pub(super) fn is_timed(&self) -> bool {
        self.stretch_max > 1.0
    }

    /// Number of coordinates of poses, the first ones.
    pub(super) fn pose_count(&self) -> usize {
        self.dimensions.count() + usize::from(self.turn_max_rad > 0.0)
    }

    /// Number of search coordinates.
    pub(super) fn count(&self) -> usize {
        self.pose_count() + if self.is_timed() { WAYPOINTS } else { 0 }
    }

    /// One value per coordinate: `of_joint` (0-based) for the waypoints, `of_turn` for the
    /// turn, `of_segment` for the stretches.
    fn filled<T: Copy>(&self, of_joint: impl Fn(usize) -> T, of_turn: T, of_segment: T) -> Vec<T> {
        let joints = self.dimensions.joints();
        let mut out: Vec<T> = (0..WAYPOINTS)
            .flat_map(|_| joints.iter().map(|&j| of_joint(j)))
            .collect();
        out.resize(self.pose_count(), of_turn);
        out.resize(self.count(), of_segment);
        out
    }

    /// The point that stays in the start pose.
    pub(super) fn resting(&self) -> Vec<f64> {
        self.filled(|j| self.start[j], 0.0, 0.0)
    }

    /// Ranges of the coordinates as (lower, upper): those of the joints (rad), and of
    /// the stretches' logarithms.
    pub(super) fn bounds(&self, limits: &Limits) -> (Vec<f64>, Vec<f64>) {
        let most = self.stretch_max.ln();
        let of_joint = |j: usize| (limits.position_min_rad[j], limits.position_max_rad[j]);
        // Joint 1 keeps its range where the throw is turned.
        let (low, high) = of_joint(0);
        let turn = (
            (low - self.start[0]).max(-self.turn_max_rad).min(0.0),
            (high - self.start[0]).min(self.turn_max_rad).max(0.0),
        );
        self.filled(of_joint, turn, (-most, most))
            .into_iter()
            .unzip()
    }

    /// Deviations of a first generation from those of the joints (rad).
    pub(super) fn std_dev(&self, of_joints_rad: &JointVector) -> Vec<f64> {
        // The bounds are three deviations away.
        let (turn, stretch) = (self.turn_max_rad / 3.0, self.stretch_max.ln() / 3.0);
        self.filled(|j| of_joints_rad[j], turn, stretch)
    }

    /// Times of all knots of the spline of a point, start included (s).
    pub(super) fn knot_times_s(&self, x: &[f64]) -> [f64; WAYPOINTS + 1] {
        let mut out = [0.0; WAYPOINTS + 1];
        out[1..].copy_from_slice(&self.times_s);
        if self.is_timed() {
            let (at, fixed) = (self.pose_count(), out);
            for i in 0..WAYPOINTS {
                let stretch = x.get(at + i).map_or(1.0, |log| libm::exp(*log));
                out[i + 1] = out[i] + stretch * (fixed[i + 1] - fixed[i]);
            }
        }
        out
    }

    /// Poses at all knots of the spline, start included (rad). Missing
    /// coordinates stay at the start pose.
    pub(super) fn knots(&self, x: &[f64]) -> [JointVector; WAYPOINTS + 1] {
        let (joints, poses) = (self.dimensions.joints(), self.dimensions.count());
        let mut out = [self.start; WAYPOINTS + 1];
        for (knot, part) in out[1..]
            .iter_mut()
            .zip(x[..poses.min(x.len())].chunks(joints.len()))
        {
            for (&j, value) in joints.iter().zip(part) {
                knot[j] = *value;
            }
        }
        if let Some(turn) = x.get(poses).filter(|_| self.turn_max_rad > 0.0) {
            for knot in &mut out[usize::from(self.stands)..] {
                knot[0] += turn;
            }
        }
        out
    }

    /// The point of a trajectory that leaves the start pose, or it turned within the bounds;
    /// none for one of other waypoints.
    pub(super) fn encode(&self, trajectory: &JointTrajectory) -> Option<Vec<f64>> {
        let (knots, times_s) = (trajectory.waypoints(), trajectory.times_s());
        let fixed_s = self.knot_times_s(&[]);
        if knots.len() != fixed_s.len() {
            return None;
        }
        let joints = self.dimensions.joints();
        let moved = knots[1..].iter().flat_map(|q| joints.iter().map(|&j| q[j]));
        let mut x: Vec<f64> = moved.collect();
        let turned = knots[usize::from(self.stands)][0];
        x.resize(self.pose_count(), turned - self.start[0]);
        if self.is_timed() {
            let spans = times_s.windows(2).zip(fixed_s.windows(2));
            x.extend(spans.map(|(is, fixed)| libm::log((is[1] - is[0]) / (fixed[1] - fixed[0]))));
        }
        let near = |a: &f64, b: &f64| (a - b).abs() < 1e-9;
        let same_times = times_s
            .iter()
            .zip(&self.knot_times_s(&x))
            .all(|(a, b)| near(a, b));
        let same =
            |(a, b): (&JointVector, &JointVector)| a.iter().zip(b.iter()).all(|(a, b)| near(a, b));
        (same_times && knots.iter().zip(&self.knots(&x)).all(same)).then_some(x)
    }

    /// The trajectory of a point.
    ///
    /// # Errors
    /// Numbers that are not finite, waypoint times out of order.
    pub(super) fn decode(&self, x: &[f64]) -> Result<JointTrajectory, TrajectoryError> {
        JointTrajectory::new(&self.knot_times_s(x), &self.knots(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    /// Spaces of three and of seven joints, with times that stretch by as much.
    fn spaces(stretch_max: f64) -> [WaypointSpace; 2] {
        [Dimensions::Planar, Dimensions::Full].map(|dimensions| WaypointSpace {
            start: START_POSE,
            dimensions,
            turn_max_rad: 0.0,
            stands: false,
            times_s: [0.4, 0.8, 1.1],
            stretch_max,
        })
    }

    #[test]
    fn coordinates_land_on_their_joints_and_waypoints() {
        for space in spaces(1.0) {
            let mut x = space.resting();
            assert_eq!(x.len(), space.dimensions.count());
            let rest = space.decode(&x).unwrap();
            assert_eq!(rest.start(), rest.end());
            let joints = space.dimensions.joints();
            x[joints.len()] += 0.25;
            let moved = space.decode(&x).unwrap();
            let joint = joints[0];
            assert!((moved.waypoints()[2][joint] - START_POSE[joint] - 0.25).abs() < 1e-12);
            assert_eq!(moved.waypoints()[1], START_POSE);
            assert_eq!(moved.times_s(), &[0.0, 0.4, 0.8, 1.1]);
        }
    }

    #[test]
    fn an_arm_that_stands_is_turned_on_the_way() {
        for stands in [false, true] {
            let mut space = spaces(1.0)[0].clone();
            (space.turn_max_rad, space.stands) = (0.3, stands);
            let mut x = space.resting();
            *x.last_mut().unwrap() = 0.1;
            let turned = space.decode(&x).unwrap();
            let moved = |q: &JointVector| (q[0] - START_POSE[0] - 0.1).abs() < 1e-12;
            let moved: Vec<bool> = turned.waypoints().iter().map(moved).collect();
            assert_eq!(moved, [!stands, true, true, true]);
            assert_eq!(space.encode(&turned), Some(x));
        }
    }

    #[test]
    fn free_times_stretch_each_segment_and_leave_the_waypoints() {
        for space in spaces(1.5) {
            let (mut x, waypoints) = (space.resting(), space.dimensions.count());
            assert_eq!(x.len(), waypoints + WAYPOINTS);
            assert_eq!(space.decode(&x).unwrap().times_s(), &[0.0, 0.4, 0.8, 1.1]);
            x[waypoints - 1] += 0.25;
            x[waypoints + 1] = 1.5_f64.ln();
            let moved = space.decode(&x).unwrap();
            for (is, wanted) in moved.times_s().iter().zip([0.0, 0.4, 1.0, 1.3]) {
                assert!((is - wanted).abs() < 1e-12, "{is} s, not {wanted} s");
            }
            let last = *space.dimensions.joints().last().unwrap();
            assert!((moved.end()[last] - START_POSE[last] - 0.25).abs() < 1e-12);
            let again = space.encode(&moved).unwrap();
            assert!(again.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
            // Times that are fixed elsewhere, and a joint that the space does not move.
            assert_eq!(spaces(1.0)[0].encode(&moved), None);
            let mut knots = moved.waypoints().to_vec();
            knots[2][6] += 0.1;
            let seventh = JointTrajectory::new(moved.times_s(), &knots).unwrap();
            let is_planar = space.dimensions == Dimensions::Planar;
            assert_eq!(space.encode(&seventh).is_none(), is_planar);
            let (low, high) = space.bounds(&Limits::default());
            assert_eq!((low.len(), high.len()), (x.len(), x.len()));
            assert!((high[x.len() - 1] - 1.5_f64.ln()).abs() < 1e-15);
        }
    }
}
