//! Poses of the pole in the plane of joints 2, 4 and 6, and the joints that reach them.

use arm_model::{JointVector, Pole};
use nalgebra::{Matrix3, Vector3};

/// Where the pole's end is and where the pole points, in the vertical plane through the
/// base axis that joint 1 has turned to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolePose {
    /// Distance of the pole's end from the base axis (m).
    pub rho_m: f64,
    /// Height of the pole's end (m).
    pub z_m: f64,
    /// Turn of the pole out of straight down, outwards positive (rad).
    pub tilt_rad: f64,
}

/// Joints that move in the plane.
const JOINTS_IN_PLANE: [usize; 3] = [1, 3, 5];
/// Largest change of a joint in one step of the iteration (rad).
const STEP_MAX_RAD: f64 = 0.3;
const ITERATIONS: usize = 60;
/// Damping of the iteration, which keeps it calm near the end of the reach (1).
const DAMPING: f64 = 1e-3;

impl PolePose {
    /// The pole in the pose `q`, seen in the plane of its joint 1.
    #[must_use]
    pub fn of(q: &JointVector, pole: &Pole) -> Self {
        let (end, attach) = pole.attach_pose(q);
        let (sin, cos) = q[0].sin_cos();
        let outwards = Vector3::new(cos, sin, 0.0);
        // -z of the attach frame points along the pole.
        let along = -attach.column(2);
        Self {
            rho_m: end.dot(&outwards),
            z_m: end.z,
            tilt_rad: along.dot(&outwards).atan2(-along.z),
        }
    }

    /// Poses by how far the pole's end is outside and above a point (m), and its tilt (rad).
    #[must_use]
    pub fn beside<const N: usize>([x, y, z]: [f64; 3], places: [[f64; 3]; N]) -> [Self; N] {
        places.map(|[outside_m, above_m, tilt_rad]| Self {
            rho_m: x.hypot(y) + outside_m,
            z_m: z + above_m,
            tilt_rad,
        })
    }

    fn minus(self, other: Self) -> Vector3<f64> {
        let turn = (self.tilt_rad - other.tilt_rad).sin();
        Vector3::new(self.rho_m - other.rho_m, self.z_m - other.z_m, 0.3 * turn)
    }
}

/// Joints 2, 4 and 6 changed from `start` so that the pole takes the pose, or comes as
/// near to it as the arm gets (rad).
pub(super) fn reach_pose(start: &JointVector, wanted: PolePose, pole: &Pole) -> JointVector {
    const STEP: f64 = 1e-6;
    let mut q = *start;
    for _ in 0..ITERATIONS {
        let now = PolePose::of(&q, pole);
        let missing = wanted.minus(now);
        let slopes = Matrix3::from_fn(|i, k| {
            let mut moved = q;
            moved[JOINTS_IN_PLANE[k]] += STEP;
            PolePose::of(&moved, pole).minus(now)[i] / STEP
        });
        let normal = slopes.tr_mul(&slopes) + Matrix3::identity() * DAMPING;
        let Some(step) = normal.lu().solve(&slopes.tr_mul(&missing)) else {
            break;
        };
        let shorter = (STEP_MAX_RAD / step.amax().max(1e-12)).min(1.0);
        for (k, j) in JOINTS_IN_PLANE.into_iter().enumerate() {
            q[j] += shorter * step[k];
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    #[test]
    fn poses_in_reach_are_reached_in_any_plane() {
        let pole = Pole::default();
        let down = PolePose::of(&START_POSE, &pole);
        assert!(down.tilt_rad.abs() < 1e-3 && (down.rho_m - 0.663).abs() < 2e-3);
        let mut start = START_POSE;
        start[0] = -0.6;
        let poses = [[0.55, 0.7, 0.8], [0.80, 0.45, 1.0], [2.0, 0.3, 1.5]];
        let [high, far, beyond] = PolePose::beside([0.0; 3], poses);
        for wanted in [high, far] {
            let found = PolePose::of(&reach_pose(&start, wanted, &pole), &pole);
            assert!(wanted.minus(found).norm() < 2e-3, "{wanted:?} {found:?}");
        }
        assert!(PolePose::of(&reach_pose(&start, beyond, &pole), &pole).rho_m > 0.85);
    }
}
