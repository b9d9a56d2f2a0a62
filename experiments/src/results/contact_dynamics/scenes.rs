//! The ten scenes. Board, domino and wall are as large and as rough as those of the planner's
//! lobs and drapes; the origin is the middle of the board's, or wall's, upper face.

use super::motion::{Ramp, Ramps};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rope_sim::{Domino, Obstacle, Scene, Shape};
use shared_types::RopeParams;

/// Edges outwards, across and down (m), and friction: board, wall.
const BOARD_M: [f64; 3] = [0.30, 0.40, 0.01];
const BOARD_FRICTION: f64 = 0.6;
const WALL_M: [f64; 3] = [0.02, 0.60, 0.40];
const WALL_FRICTION: f64 = 0.5;
/// How much before the board's middle the domino stands (m).
const DOMINO_BEFORE_M: f64 = 0.06;

/// One rope, what it touches and how it is moved.
#[derive(Debug, Clone)]
pub(in crate::results) struct TouchScene<M = Ramps> {
    pub name: &'static str,
    pub rope: RopeParams,
    pub scene: Scene,
    pub motion: M,
    pub horizon_s: f64,
}

/// Limp, with a heavy lead. Numbers in the order of [`shared_types::rope::RANGES`].
fn limp() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.005, 0.08, 0.006, 0.05, 0.08, 0.025, 0.8])
}

/// Stiffer, with a heavier one.
fn stiff() -> RopeParams {
    RopeParams::from_array([24.0, 0.50, 0.02, 0.3, 0.008, 0.06, 0.12, 0.03, 0.8])
}

/// Limp, with a light one.
fn light() -> RopeParams {
    RopeParams::from_array([20.0, 0.60, 0.004, 0.06, 0.005, 0.04, 0.04, 0.02, 0.9])
}

/// A box by its whole edges (m), the middle of its upper face in the origin, turned about the
/// vertical.
fn boxed(size_m: [f64; 3], turn_rad: f64, friction: f64) -> Obstacle {
    let half_m = size_m.map(|edge_m| edge_m / 2.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
    Obstacle {
        shape: Shape::Box { half_m },
        pose: Isometry3::from_parts(Translation3::new(0.0, 0.0, -half_m[2]), turn),
        friction,
    }
}

fn board() -> Scene {
    Scene::with(vec![boxed(BOARD_M, 0.0, BOARD_FRICTION)])
}

fn wall(turn_rad: f64) -> Scene {
    Scene::with(vec![boxed(WALL_M, turn_rad, WALL_FRICTION)])
}

fn board_with_domino(facing_rad: f64) -> Scene {
    Scene {
        domino: Some(Domino {
            foot_m: [-DOMINO_BEFORE_M, 0.0, 0.0],
            facing_rad,
            thickness_m: 0.008,
            width_m: 0.025,
            height_m: 0.050,
            mass_kg: 0.010,
            friction: 0.4,
        }),
        ..board()
    }
}

/// All, in the order of the table.
pub(super) fn all() -> Vec<TouchScene> {
    let mut all = on_the_board();
    all.extend(on_wall_and_floor());
    all
}

fn scene(
    name: &'static str,
    rope: RopeParams,
    scene: Scene,
    start_m: [f64; 3],
    ramps: &[Ramp],
    horizon_s: f64,
) -> TouchScene {
    TouchScene {
        name,
        rope,
        scene,
        motion: Ramps {
            start_m,
            ramps: ramps.to_vec(),
        },
        horizon_s,
    }
}

fn on_the_board() -> Vec<TouchScene> {
    let ramp = Ramp::new;
    vec![
        scene(
            "lob-fells",
            limp(),
            board_with_domino(0.0),
            [-0.60, 0.0, 0.70],
            &[
                ramp([0.1, 0.6], [0.40, 0.0, 0.0], -1.0),
                ramp([0.6, 1.1], [-0.15, 0.0, -0.40], 0.6),
            ],
            2.4,
        ),
        scene(
            "lob-fells-askew",
            stiff(),
            board_with_domino(0.4),
            [-0.66, -0.04, 0.65],
            &[
                ramp([0.1, 0.6], [0.40, 0.04, 0.0], -1.0),
                ramp([0.6, 1.1], [-0.10, 0.0, -0.37], 0.6),
            ],
            2.4,
        ),
        scene(
            "lob-nudges",
            limp(),
            board_with_domino(0.0),
            [-0.45, 0.0, 0.585],
            &[ramp([0.1, 1.3], [0.229, 0.0, 0.0], 0.0)],
            3.0,
        ),
        scene(
            "lay-on-board",
            stiff(),
            board(),
            [0.12, 0.0, 0.65],
            &[
                ramp([0.1, 0.7], [-0.40, 0.05, 0.0], 0.0),
                ramp([0.3, 1.1], [0.0, 0.0, -0.45], 0.0),
            ],
            2.2,
        ),
    ]
}

fn on_wall_and_floor() -> Vec<TouchScene> {
    let ramp = Ramp::new;
    vec![
        scene(
            "drape",
            limp(),
            wall(0.0),
            [-0.55, 0.0, 0.40],
            &[
                ramp([0.1, 0.55], [0.50, 0.0, 0.20], -1.6),
                ramp([0.55, 1.2], [-0.05, 0.0, -0.40], 1.0),
            ],
            2.6,
        ),
        scene(
            "drape-askew",
            light(),
            wall(0.35),
            [-0.60, -0.05, 0.45],
            &[
                ramp([0.1, 0.55], [0.50, 0.1, 0.20], -1.6),
                ramp([0.55, 1.2], [-0.05, 0.0, -0.40], 1.0),
            ],
            2.6,
        ),
        scene(
            "pull-over-wall",
            stiff(),
            wall(0.0),
            [-0.20, 0.0, 0.25],
            &[ramp([0.1, 0.9], [0.45, 0.0, 0.0], 0.0)],
            2.4,
        ),
        scene(
            "swing-into-wall",
            limp(),
            wall(0.0),
            [-0.45, 0.0, 0.35],
            &[ramp([0.1, 0.5], [0.25, 0.0, 0.0], 0.0)],
            2.0,
        ),
        scene(
            "swing-into-wall-askew",
            light(),
            wall(0.5),
            [-0.45, 0.0, 0.35],
            &[ramp([0.1, 0.5], [0.25, 0.05, 0.0], 0.0)],
            2.0,
        ),
        scene(
            "lay-on-floor",
            light(),
            Scene::with(vec![Obstacle::floor(0.0, BOARD_FRICTION)]),
            [0.0, 0.0, 0.75],
            &[
                ramp([0.1, 0.7], [-0.40, 0.1, 0.0], 0.0),
                ramp([0.3, 1.1], [0.0, 0.0, -0.50], 0.0),
            ],
            2.2,
        ),
    ]
}
