//! One scene in both engines: what is asked of each, and what it answers.

use super::scenes::TouchScene;
use crate::results::other_reality::child::{Mujoco, pose};
use anyhow::{Context, ensure};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rope_sim::{
    AttachMotion, Candidate, Domino, FrameTimes, Obstacle, Outcome, Precision, Rollout, Scene,
    Shape, SimOptions, roll_out_in,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

const SCRIPT: &str = include_str!("../../../other_reality/contact.py");
/// Time between two places of the tip that are compared (s).
pub(in crate::results) const PERIOD_S: f64 = 1e-3;

/// What one engine makes of a scene.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::results) struct Course {
    /// From the start on, one every [`PERIOD_S`] (m).
    pub tip_m: Vec<Vector3<f64>>,
    /// When the rope first touched anything (s).
    pub first_s: Option<f64>,
    pub domino: Option<DominoCourse>,
}

/// What becomes of the domino.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(in crate::results) struct DominoCourse {
    /// When its tilt passed 45 degrees (s).
    pub down_at_s: Option<f64>,
    /// Greatest tilt up to then, either way (rad).
    pub peak_tilt_rad: f64,
}

/// How many times the tip's place is told.
pub(in crate::results) fn places(scene: &TouchScene<impl AttachMotion>) -> usize {
    (scene.horizon_s / PERIOD_S).round() as usize + 1
}

/// The rope in `rope-sim`, in steps of `step_s`, among bodies that may differ from the scene's.
pub(in crate::results) fn rolled_out(
    scene: &TouchScene<impl AttachMotion>,
    bodies: &Scene,
    step_s: f64,
) -> anyhow::Result<Rollout> {
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: PERIOD_S,
            count: places(scene),
        },
        ..SimOptions::new(step_s, Precision::F64, scene.horizon_s)
    };
    let candidate = Candidate::new(&scene.rope, &scene.motion);
    let mut runs = roll_out_in(bodies, &[candidate], &options)?;
    runs.pop().context("no rollout")
}

/// The path of its tip (m).
pub(in crate::results) fn tip_of(run: &Rollout) -> Vec<Vector3<f64>> {
    let (frames, tip) = (run.nodes.frames(), run.nodes.nodes() - 1);
    (0..frames).map(|k| run.nodes.position(k, tip)).collect()
}

/// The scene in `rope-sim`, in steps of `step_s`.
pub(super) fn ours(scene: &TouchScene, step_s: f64) -> anyhow::Result<Course> {
    let run = rolled_out(scene, &scene.scene, step_s)?;
    ensure!(
        run.outcome == Outcome::Clean,
        "`{}` blew up in rope-sim at steps of {step_s} s",
        scene.name
    );
    // Rollouts do not say when the domino is touched, but until then it might stand fast.
    let obstacles = scene.scene.obstacles.iter().copied();
    let fixed = Scene::with(
        obstacles
            .chain(scene.scene.domino.as_ref().map(standing_fast))
            .collect(),
    );
    let fixed = rolled_out(scene, &fixed, step_s)?;
    let touched = fixed.contacts.iter();
    let first_s = touched
        .filter_map(|contact| Some(contact.first?.0))
        .reduce(f64::min);
    Ok(Course {
        tip_m: tip_of(&run),
        first_s,
        domino: run.domino.map(|domino| DominoCourse {
            down_at_s: domino.down_at_s,
            peak_tilt_rad: domino.peak_tilt_rad.abs(),
        }),
    })
}

#[derive(Deserialize)]
struct Answer {
    mujoco: String,
    tip_m: Vec<f64>,
    first_s: Option<f64>,
    down_at_s: Option<f64>,
    peak_tilt_rad: f64,
}

/// The scene in MuJoCo, in steps of `step_s`, and MuJoCo's version. `domino_stays`: a domino that
/// has fallen lies in the rope's way, as a real one does, and ours does not.
pub(in crate::results) fn theirs(
    mujoco: &Mujoco,
    scene: &TouchScene<impl AttachMotion>,
    step_s: f64,
    domino_stays: bool,
) -> anyhow::Result<(Course, String)> {
    let every = (PERIOD_S / step_s).round();
    let steps = (scene.horizon_s / step_s).round() as u64;
    let poses: Vec<[f64; 7]> = (0..=steps)
        .map(|i| pose(&scene.motion.at(i as f64 * step_s)))
        .collect();
    let obstacles = scene.scene.obstacles.iter();
    let bodies = obstacles.map(|obstacle| {
        let half_m = match obstacle.shape {
            Shape::Box { half_m } => Some(half_m),
            Shape::HalfSpace => None,
            shape @ Shape::Cylinder { .. } => anyhow::bail!("MuJoCo is not asked for {shape:?}"),
        };
        let pose = seven(&obstacle.pose);
        Ok(json!({ "half_m": half_m, "pose": pose, "friction": obstacle.friction }))
    });
    let bodies: Vec<Value> = bodies.collect::<Result<_, _>>()?;
    let request = json!({
        "rope": scene.rope, "bodies": bodies, "domino": scene.scene.domino.as_ref().map(free_box),
        "domino_stays": domino_stays, "pose_period_s": step_s, "poses": poses,
        "every": every as u64,
    });
    let answer = mujoco.ask(SCRIPT, &serde_json::to_vec(&request)?)?;
    let answer: Answer = serde_json::from_slice(&answer).context("answer of MuJoCo's rope")?;
    ensure!(
        answer.tip_m.len() == 3 * places(scene),
        "MuJoCo's rope answered with {} numbers, not {}",
        answer.tip_m.len(),
        3 * places(scene)
    );
    let points = answer.tip_m.chunks_exact(3);
    let course = Course {
        tip_m: points.map(Vector3::from_column_slice).collect(),
        first_s: answer.first_s,
        domino: scene.scene.domino.as_ref().map(|_| DominoCourse {
            down_at_s: answer.down_at_s,
            peak_tilt_rad: answer.peak_tilt_rad,
        }),
    };
    Ok((course, answer.mujoco))
}

/// Place, then attitude, scalar first.
fn seven(pose: &Isometry3<f64>) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation);
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

/// Half a domino's edges (m), and its pose at the start.
fn upright(domino: &Domino) -> ([f64; 3], Isometry3<f64>) {
    let edges_m = [domino.thickness_m, domino.width_m, domino.height_m];
    let half_m = edges_m.map(|edge_m| edge_m / 2.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), domino.facing_rad);
    let centre_m = Vector3::from(domino.foot_m) + Vector3::z() * half_m[2];
    (half_m, Isometry3::from_parts(centre_m.into(), turn))
}

/// A domino that nothing moves.
fn standing_fast(domino: &Domino) -> Obstacle {
    let (half_m, pose) = upright(domino);
    Obstacle {
        shape: Shape::Box { half_m },
        pose,
        friction: domino.friction,
    }
}

/// A domino as a box that nothing holds.
fn free_box(domino: &Domino) -> Value {
    let (half_m, pose) = upright(domino);
    json!({
        "half_m": half_m, "pose": seven(&pose), "mass_kg": domino.mass_kg,
        "friction": domino.friction,
    })
}
