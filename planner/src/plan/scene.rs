//! Bodies of a task in the vertical plane through base axis and target.

use crate::collide::Block;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rope_sim::{Obstacle, Shape};

/// A frame at the target whose x points away from the base axis and whose z is up: the
/// scene of a task beside the x axis is that on it, turned.
pub(super) struct PlanarScene {
    /// Turn about the vertical (rad).
    pub(super) bearing_rad: f64,
    pose: Isometry3<f64>,
}

impl PlanarScene {
    /// The frame at a target (m).
    pub(super) fn at(target_m: [f64; 3]) -> Self {
        let bearing_rad = target_m[1].atan2(target_m[0]);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), bearing_rad);
        Self {
            bearing_rad,
            pose: Isometry3::from_parts(Translation3::from(target_m), turn),
        }
    }

    /// A point of the frame in the world (m).
    pub(super) fn point(&self, local_m: [f64; 3]) -> [f64; 3] {
        self.pose
            .transform_point(&Point3::from(local_m))
            .coords
            .into()
    }

    fn middle_of(&self, top_m: [f64; 3], size_m: [f64; 3]) -> (Isometry3<f64>, [f64; 3]) {
        let half_m = size_m.map(|s| s / 2.0);
        let down = Translation3::new(top_m[0], top_m[1], top_m[2] - half_m[2]);
        (self.pose * down, half_m)
    }

    /// A box by the middle of its upper face and its whole edges (m).
    pub(super) fn box_below(&self, top_m: [f64; 3], size_m: [f64; 3], friction: f64) -> Obstacle {
        let (pose, half_m) = self.middle_of(top_m, size_m);
        Obstacle {
            shape: Shape::Box { half_m },
            pose,
            friction,
        }
    }

    /// The same box, for the arm to keep clear of.
    pub(super) fn block_below(&self, top_m: [f64; 3], size_m: [f64; 3]) -> Block {
        let (pose, half_m) = self.middle_of(top_m, size_m);
        Block { pose, half_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_targets_bearing() {
        let scene = PlanarScene::at([0.6, 0.6, 0.2]);
        let [x, y, z] = scene.point([-0.1, 0.0, 0.05]);
        let rho = 0.72f64.sqrt() - 0.1;
        assert!((x.hypot(y) - rho).abs() < 1e-12 && (x - y).abs() < 1e-12);
        assert!((z - 0.25).abs() < 1e-12);
        let block = scene.block_below([0.0; 3], [0.3, 0.4, 0.02]);
        assert!((block.pose.translation.vector.z - 0.19).abs() < 1e-12);
    }
}
