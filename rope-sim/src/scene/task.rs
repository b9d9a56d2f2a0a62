//! What stands at the target of a task.

use super::{Domino, Obstacle, Scene, Shape};
use arm_model::Cell;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use shared_types::Task;

/// A frame at the target whose x points away from the base axis and whose z is up: the
/// scene of a task beside the x axis is that on it, turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskFrame {
    /// Turn about the vertical (rad).
    pub bearing_rad: f64,
    pose: Isometry3<f64>,
}

impl TaskFrame {
    /// The frame at a target (m).
    #[must_use]
    pub fn at(target_m: [f64; 3]) -> Self {
        let bearing_rad = target_m[1].atan2(target_m[0]);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), bearing_rad);
        Self {
            bearing_rad,
            pose: Isometry3::from_parts(Translation3::from(target_m), turn),
        }
    }

    /// A point of the frame in the world (m).
    #[must_use]
    pub fn point(&self, local_m: [f64; 3]) -> [f64; 3] {
        self.pose
            .transform_point(&Point3::from(local_m))
            .coords
            .into()
    }

    /// A point of the world in the frame (m).
    #[must_use]
    pub fn local(&self, world_m: [f64; 3]) -> [f64; 3] {
        self.pose
            .inverse_transform_point(&Point3::from(world_m))
            .coords
            .into()
    }

    /// A box by the middle of its upper face and its whole edges (m).
    fn box_below(&self, top_m: [f64; 3], size_m: [f64; 3], friction: f64) -> Obstacle {
        let half_m = size_m.map(|s| s / 2.0);
        let down = Translation3::new(top_m[0], top_m[1], top_m[2] - half_m[2]);
        Obstacle {
            shape: Shape::Box { half_m },
            pose: self.pose * down,
            friction,
        }
    }
}

impl Scene {
    /// What stands at the target of a task: nothing for a strike, board, column and domino
    /// for a lob, a wall for a drape, with the floor.
    #[must_use]
    pub fn of_task(task: Task, target_m: [f64; 3], cell: &Cell) -> Self {
        let frame = TaskFrame::at(target_m);
        match task {
            Task::Strike => Self::EMPTY,
            Task::Lob => Self {
                obstacles: of_lob(&frame, target_m, cell),
                domino: Some(domino(&frame, cell)),
            },
            Task::Drape => Self::with(vec![
                frame.box_below([0.0; 3], cell.wall.size_m, cell.wall.friction),
                Obstacle::floor(cell.floor_z_m, cell.wall.friction),
            ]),
        }
    }
}

fn of_lob(frame: &TaskFrame, target_m: [f64; 3], cell: &Cell) -> Vec<Obstacle> {
    let board = &cell.board;
    let thickness_m = board.size_m[2];
    let column_m = (target_m[2] - thickness_m - cell.floor_z_m).max(0.01);
    vec![
        frame.box_below([0.0; 3], board.size_m, board.friction),
        Obstacle::column_below(
            frame.point([0.0, 0.0, -thickness_m]),
            board.column_radius_m,
            column_m,
            board.friction,
        ),
        Obstacle::floor(cell.floor_z_m, board.friction),
    ]
}

fn domino(frame: &TaskFrame, cell: &Cell) -> Domino {
    let [thickness_m, width_m, height_m] = cell.domino.size_m;
    Domino {
        foot_m: frame.point([-cell.domino.before_target_m, 0.0, 0.0]),
        facing_rad: frame.bearing_rad,
        thickness_m,
        width_m,
        height_m,
        mass_kg: cell.domino.mass_kg,
        friction: cell.domino.friction,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_targets_bearing() {
        let frame = TaskFrame::at([0.6, 0.6, 0.2]);
        let [x, y, z] = frame.point([-0.1, 0.0, 0.05]);
        let rho = 0.72f64.sqrt() - 0.1;
        assert!((x.hypot(y) - rho).abs() < 1e-12 && (x - y).abs() < 1e-12);
        assert!((z - 0.25).abs() < 1e-12);
        let back = frame.local([x, y, z]);
        assert!((Vector3::from(back) - Vector3::new(-0.1, 0.0, 0.05)).norm() < 1e-12);
        let scene = Scene::of_task(Task::Drape, [0.6, 0.6, 0.2], &Cell::default());
        assert!((scene.obstacles[0].pose.translation.vector.z).abs() < 1e-12);
    }
}
