//! The bodies of a lob or a drape as strokes: boxes as capsules side by side.

use super::solid::{Material, Solid};
use nalgebra::{Isometry3, Point3, Vector3};
use rope_sim::{Domino, Scene, Shape};

/// Part of their width by which neighbouring capsules overlap.
const OVERLAP: f64 = 0.3;
/// A domino that has fallen lies flat (rad).
const FLAT_RAD: f64 = core::f64::consts::FRAC_PI_2;

/// What a task is thrown at, as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskBodies {
    bodies: Vec<Solid>,
    domino: Option<(Domino, Material)>,
}

impl TaskBodies {
    /// The bodies of a scene but for its floor, which every room has; the domino in
    /// `domino_rgb`.
    #[must_use]
    pub fn of(scene: &Scene, domino_rgb: [u8; 3]) -> Self {
        let wood = Material::plain([205, 190, 165], 12.0);
        let of_obstacle = |obstacle: &rope_sim::Obstacle| match obstacle.shape {
            Shape::HalfSpace => Vec::new(),
            Shape::Box { half_m } => capsules(&obstacle.pose, half_m, wood),
            Shape::Cylinder {
                half_length_m,
                radius_m,
            } => {
                let end = |z: f64| {
                    obstacle
                        .pose
                        .transform_point(&Point3::new(0.0, 0.0, z))
                        .coords
                };
                let line: Vec<_> = (0..=8)
                    .map(|k| end(half_length_m * (f64::from(k) / 4.0 - 1.0)))
                    .collect();
                Solid::chain(&line, radius_m, wood).collect()
            }
        };
        Self {
            bodies: scene.obstacles.iter().flat_map(of_obstacle).collect(),
            domino: scene
                .domino
                .map(|domino| (domino, Material::plain(domino_rgb, 30.0))),
        }
    }

    /// What is drawn while the domino leans by `tilt_rad`; beyond 45 degrees it has fallen.
    pub(super) fn solids(&self, tilt_rad: f64) -> Vec<Solid> {
        let mut solids = self.bodies.clone();
        if let Some((domino, material)) = &self.domino {
            let has_fallen = tilt_rad.abs() > core::f64::consts::FRAC_PI_4;
            let shown_rad = if has_fallen {
                FLAT_RAD.copysign(tilt_rad)
            } else {
                tilt_rad
            };
            let half_m = [domino.thickness_m, domino.width_m, domino.height_m].map(|e| e / 2.0);
            solids.extend(capsules(&leaning(domino, shown_rad), half_m, *material));
        }
        solids
    }
}

/// Pose of a domino's middle that leans about the lower edge of its face.
fn leaning(domino: &Domino, tilt_rad: f64) -> Isometry3<f64> {
    let half_m = 0.5 * domino.thickness_m.copysign(tilt_rad);
    let edge = Vector3::new(half_m, 0.0, 0.0);
    let stand = Isometry3::new(
        Vector3::from(domino.foot_m),
        Vector3::z() * domino.facing_rad,
    );
    let about_edge = Isometry3::translation(edge.x, 0.0, 0.0)
        * Isometry3::rotation(Vector3::y() * tilt_rad)
        * Isometry3::translation(-edge.x, 0.0, 0.0);
    stand * about_edge * Isometry3::translation(0.0, 0.0, domino.height_m / 2.0)
}

/// Capsules of the thinnest edge's width along the longest edge, side by side along the other.
fn capsules(pose: &Isometry3<f64>, half_m: [f64; 3], material: Material) -> Vec<Solid> {
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| half_m[*a].total_cmp(&half_m[*b]));
    let [thin, across, along] = axes;
    let radius_m = half_m[thin];
    let reach = |axis: usize| (half_m[axis] - radius_m).max(0.0);
    let count = (2.0 * reach(across) / (2.0 * radius_m * (1.0 - OVERLAP))).ceil();
    let rows = count as i32;
    let point = |row: i32, end: f64| {
        let mut local = Vector3::zeros();
        local[across] = reach(across) * (2.0 * f64::from(row) / count.max(1.0) - 1.0);
        local[along] = reach(along) * end;
        pose.transform_point(&Point3::from(local)).coords
    };
    (0..=rows)
        .map(|row| Solid::new(&point(row, -1.0), &point(row, 1.0), radius_m, material))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Cell;
    use shared_types::Task;

    #[test]
    fn boxes_are_filled_and_a_fallen_domino_lies_on_the_board() {
        let target_m = [0.7, 0.3, 0.2];
        let scene = Scene::of_task(Task::Lob, target_m, &Cell::default());
        let drawn = TaskBodies::of(&scene, [20, 160, 60]);
        let count = drawn.bodies.len();
        let highest_m = |tilt_rad: f64| {
            let solids = drawn.solids(tilt_rad);
            let tops = solids[count..]
                .iter()
                .map(|s| s.a_m.z.max(s.b_m.z) + s.radius_m);
            tops.fold(f64::NEG_INFINITY, f64::max)
        };
        let [thickness_m, _, height_m] = Cell::default().domino.size_m;
        assert!((highest_m(0.0) - target_m[2] - height_m).abs() < 1e-9);
        assert!((highest_m(0.8) - target_m[2] - thickness_m).abs() < 1e-9);
        assert!((highest_m(-0.8) - target_m[2] - thickness_m).abs() < 1e-9);
        // No gap between neighbours of the board.
        let board: Vec<_> = drawn.bodies.iter().filter(|s| s.radius_m < 0.006).collect();
        assert!(board.len() > 20);
        for pair in board.windows(2) {
            let apart_m = (pair[1].a_m - pair[0].a_m).norm();
            assert!(apart_m < 2.0 * pair[0].radius_m, "{apart_m} m");
        }
    }
}
