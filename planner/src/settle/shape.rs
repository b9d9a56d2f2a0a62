//! Shape of the move: a smooth step from start to end with offsets on its knots.

use crate::wiggle::smooth_step;
use arm_model::{JointTrajectory, JointVector, TrajectoryError};

/// Joints that are offset, 0-based. With the pole down, joint 1 moves the rope's
/// upper end across the arm's plane and joint 6 within it; together they reach
/// both planes of swing.
const OFFSET_JOINTS: [usize; 2] = [0, 5];

/// A family of rest-to-rest moves between two poses, by the offsets of
/// [`OFFSET_JOINTS`] at the inner knots (rad).
#[derive(Debug, Clone)]
pub(super) struct MoveShape {
    times_s: Vec<f64>,
    /// The plain move at the knots (rad).
    plain: Vec<JointVector>,
}

impl MoveShape {
    /// Knots about `knot_s` apart.
    pub(super) fn new(start: JointVector, end: JointVector, duration_s: f64, knot_s: f64) -> Self {
        let segments = ((duration_s / knot_s).round() as usize).max(2);
        let fraction = |i: usize| i as f64 / segments as f64;
        Self {
            times_s: (0..=segments).map(|i| duration_s * fraction(i)).collect(),
            plain: (0..=segments)
                .map(|i| start.zip_with(end, |a, b| a + (b - a) * smooth_step(fraction(i))))
                .collect(),
        }
    }

    /// The plain move.
    pub(super) fn no_offsets(&self) -> Vec<f64> {
        vec![0.0; OFFSET_JOINTS.len() * (self.plain.len() - 2)]
    }

    /// The move with these offsets, joint by joint at each inner knot (rad).
    pub(super) fn trajectory(&self, offsets: &[f64]) -> Result<JointTrajectory, TrajectoryError> {
        let mut knots = self.plain.clone();
        for (knot, offsets) in knots[1..]
            .iter_mut()
            .zip(offsets.chunks(OFFSET_JOINTS.len()))
        {
            for (joint, offset) in OFFSET_JOINTS.into_iter().zip(offsets) {
                knot[joint] += offset;
            }
        }
        JointTrajectory::new(&self.times_s, &knots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_kept_and_only_two_joints_are_offset() {
        let (a, b) = (JointVector::splat(0.1), JointVector::splat(0.4));
        let shape = MoveShape::new(a, b, 3.5, 0.44);
        let mut offsets = shape.no_offsets();
        offsets.fill(0.05);
        let (plain, moved) = (
            shape.trajectory(&shape.no_offsets()).unwrap(),
            shape.trajectory(&offsets).unwrap(),
        );
        assert_eq!((moved.start(), moved.end()), (a, b));
        assert_eq!(moved.waypoint_count(), 9);
        assert_eq!(moved.waypoint_count(), offsets.len() / 2 + 2);
        for i in 1..=offsets.len() / 2 {
            let d = moved.waypoints()[i] - plain.waypoints()[i];
            for j in 0..7 {
                let want = if OFFSET_JOINTS.contains(&j) {
                    0.05
                } else {
                    0.0
                };
                assert!((d[j] - want).abs() < 1e-12);
            }
        }
    }
}
