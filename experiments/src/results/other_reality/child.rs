//! A rope in MuJoCo: what `other_reality/rope.py` is asked, in a child process, and what it
//! answers.

#[cfg(test)]
#[path = "../../../../hil-tests/support/missing.rs"]
mod missing;

use anyhow::{Context, anyhow, bail, ensure};
use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rope_sim::{FrameTimes, Sway};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use std::ffi::OsString;
use std::process::{Command, Stdio};

/// Names the Python that has MuJoCo.
pub(super) const PYTHON: &str = "WAG_MUJOCO_PYTHON";
const SCRIPT: &str = include_str!("../../../other_reality/rope.py");
/// Steps of the simulation, and times between two poses of the attach frame (s): the first at
/// which it does not blow up, as it may where a chain whips.
const STEPS_S: [f64; 3] = [5e-4, 2.5e-4, 1.25e-4];
const BLEW_UP: &str = "blew up";

/// A rope in MuJoCo.
#[derive(Debug, Clone, Copy)]
pub(super) struct OtherRope {
    /// With its extras.
    pub params: RopeParams,
    /// Links for each of its links.
    pub refinement: u32,
    /// How it leaves the clamp, about two axes across the rope (rad).
    pub clamp_tilt_rad: [f64; 2],
    pub sway: Sway,
}

/// A Python that has MuJoCo.
#[derive(Debug, Clone)]
pub(in crate::results) struct Mujoco(OsString);

#[derive(Serialize)]
struct Request<'a> {
    rope: &'a RopeParams,
    refinement: u32,
    clamp_tilt_rad: [f64; 2],
    sway: serde_json::Value,
    seed: u64,
    pose_period_s: f64,
    poses: Vec<[f64; 7]>,
    times_s: Vec<f64>,
    nodes: usize,
}

#[derive(Deserialize)]
struct Answer {
    nodes_m: Vec<f64>,
}

impl Mujoco {
    /// The Python that the environment names.
    pub fn from_environment() -> anyhow::Result<Self> {
        std::env::var_os(PYTHON).map(Self).with_context(|| {
            format!("{PYTHON} does not name a Python with MuJoCo: make one with `python3 -m venv venv && venv/bin/pip install mujoco numpy`, then set {PYTHON}=venv/bin/python")
        })
    }

    /// Positions of `nodes` points of a rope, uniform in arc length from clamp to tip, whose
    /// attach frame moves as told; time by time. The rope hung at rest before, in one of the
    /// shapes that friction holds; which one, `seed` says.
    pub(super) fn simulate(
        &self,
        rope: &OtherRope,
        motion: impl Fn(f64) -> FrameMotion,
        seed: u64,
        times: &FrameTimes,
        nodes: usize,
    ) -> anyhow::Result<Vec<Vector3<f64>>> {
        let times_s: Vec<f64> = (0..times.count).map(|i| times.time_s(i)).collect();
        let last_s = *times_s.last().context("no time is asked for")?;
        let answer = |step_s: f64| {
            let steps = (last_s / step_s).ceil() as usize;
            let request = Request {
                rope: &rope.params,
                refinement: rope.refinement,
                clamp_tilt_rad: rope.clamp_tilt_rad,
                sway: serde_json::json!({
                    "angle_rad": rope.sway.angle_rad,
                    "rate_rad_s": rope.sway.rate_rad_s,
                }),
                seed,
                pose_period_s: step_s,
                poses: (0..=steps)
                    .map(|i| pose(&motion(i as f64 * step_s)))
                    .collect(),
                nodes,
                times_s: times_s.clone(),
            };
            self.ask(SCRIPT, &serde_json::to_vec(&request)?)
        };
        let blew_up = |found: &anyhow::Result<_>| {
            let why = found.as_ref().err().map(ToString::to_string);
            why.is_some_and(|why| why.contains(BLEW_UP))
        };
        let [first, shorter @ ..] = STEPS_S;
        let mut found = answer(first);
        for step_s in shorter {
            if blew_up(&found) {
                found = answer(step_s);
            }
        }
        let answer: Answer = serde_json::from_slice(&found?).context("answer of MuJoCo's rope")?;
        ensure!(
            answer.nodes_m.len() == 3 * nodes * times.count,
            "MuJoCo's rope answered with {} numbers, not {}",
            answer.nodes_m.len(),
            3 * nodes * times.count
        );
        let points = answer.nodes_m.chunks_exact(3);
        Ok(points.map(Vector3::from_column_slice).collect())
    }

    /// The Python, or nothing where there is none: said aloud, and a failure in CI.
    #[cfg(test)]
    pub fn for_tests() -> Option<Self> {
        missing::named(PYTHON, "Python with MuJoCo").map(Self)
    }

    /// What a script answers to a request.
    pub fn ask(&self, script: &str, request: &[u8]) -> anyhow::Result<Vec<u8>> {
        use std::io::Write;
        let mut child = Command::new(&self.0)
            .args(["-c", script])
            // Its matrices are small; threads would only get in each other's way.
            .env("OPENBLAS_NUM_THREADS", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("{PYTHON} `{}`", self.0.display()))?;
        // It reads everything before it writes. One that ended early says why itself.
        let written = match child.stdin.take() {
            Some(mut stdin) => stdin.write_all(request),
            None => bail!("no standard input for MuJoCo's rope"),
        };
        let output = child.wait_with_output()?;
        if output.status.success() {
            written?;
            return Ok(output.stdout);
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or("it said nothing");
        Err(anyhow!(
            "the rope in MuJoCo failed ({PYTHON} `{}`; it needs `pip install mujoco numpy`): {last}",
            self.0.display()
        ))
    }
}

/// Origin, then attitude as a quaternion, scalar first.
pub(in crate::results) fn pose(frame: &FrameMotion) -> [f64; 7] {
    let attitude = Rotation3::from_matrix_unchecked(frame.r);
    let q = UnitQuaternion::from_rotation_matrix(&attitude);
    let p = frame.p_m;
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

#[cfg(test)]
mod tests {
    use super::*;
    use planner::ropes::trial_rope;
    use planner::wiggle::{WiggleConfig, wiggling_arm};
    use rope_sim::{AttachMotion, Candidate, Precision, SimOptions, roll_out};
    use shared_types::{AirDrag, BendingFriction, RopeExtras};

    fn plain(params: RopeParams, refinement: u32) -> OtherRope {
        OtherRope {
            params,
            refinement,
            clamp_tilt_rad: [0.0; 2],
            sway: Sway::NONE,
        }
    }

    /// MuJoCo has the equations of motion, and none of ours; drag is the script's own.
    #[test]
    fn what_both_know_is_the_same_rope() {
        let Some(mujoco) = Mujoco::for_tests() else {
            return;
        };
        let times = FrameTimes {
            first_s: 0.0,
            period_s: 0.02,
            count: 336,
        };
        let arm = wiggling_arm(&WiggleConfig::default()).unwrap();
        let options = SimOptions {
            frames: times,
            ..SimOptions::new(2.5e-4, Precision::F64, 6.7)
        };
        let extras = RopeExtras {
            air_drag: Some(AirDrag {
                air_density_kg_m3: 1.2,
                normal_coefficient: 1.1,
                tangential_coefficient: 0.02,
                lead_coefficient: 0.5,
            }),
            rest_curvature_per_m: [0.3, -0.4, 0.0],
            mass_slope: 0.3,
            clamp_stiffness: 1.8,
            friction: None,
        };
        for (index, extras) in [(0, RopeExtras::NONE), (1, RopeExtras::NONE), (0, extras)] {
            let rope = trial_rope(1, index).with_extras(extras);
            let candidate = Candidate::new(&rope, &arm);
            let ours = roll_out(&[candidate], &options).unwrap();
            let motion = |t_s| arm.at(t_s);
            let theirs = mujoco
                .simulate(&plain(rope, 1), motion, 1, &times, 2)
                .unwrap();
            let tip = rope.links as usize;
            for (frame, nodes) in theirs.chunks_exact(2).enumerate() {
                let apart_m = (ours[0].nodes.position(frame, tip) - nodes[1]).norm();
                assert!(apart_m < 1e-3, "rope {index}, frame {frame}: {apart_m} m");
            }
        }
    }

    /// A swing dies away sooner, and a rope that was left to itself rests where friction holds
    /// it: off its equilibrium, each time elsewhere.
    #[test]
    fn friction_dissipates_and_holds() {
        let Some(mujoco) = Mujoco::for_tests() else {
            return;
        };
        let rope = RopeParams {
            joint_damping_nms_per_rad: 5e-4,
            ..trial_rope(1, 0)
        };
        let friction = BendingFriction {
            moment_max_nm: 0.5 * rope.bending_stiffness_nm2(),
            slip_curvature_per_m: 0.3,
        };
        let tips_m = |friction, sway, seed, count| -> Vec<f64> {
            let extras = RopeExtras {
                friction,
                ..RopeExtras::NONE
            };
            let other = OtherRope {
                sway,
                ..plain(rope.with_extras(extras), 1)
            };
            let times = FrameTimes {
                first_s: 0.0,
                period_s: 0.02,
                count,
            };
            let nodes = mujoco
                .simulate(&other, |_| FrameMotion::world(), seed, &times, 2)
                .unwrap();
            nodes.chunks_exact(2).map(|nodes| nodes[1].y).collect()
        };
        let last_swing_m = |friction| {
            let sway = Sway {
                angle_rad: [0.1, 0.0],
                rate_rad_s: [0.0, 0.0],
            };
            let tips_m = tips_m(friction, sway, 1, 400);
            let last = || tips_m[320..].iter().copied();
            last().fold(f64::MIN, f64::max) - last().fold(f64::MAX, f64::min)
        };
        let (free_m, held_m) = (last_swing_m(None), last_swing_m(Some(friction)));
        assert!(held_m < 0.6 * free_m, "{held_m} of {free_m} m");
        let at_rest_m = |friction, seed| tips_m(friction, Sway::NONE, seed, 2)[0];
        let (free_m, held_m) = (at_rest_m(None, 1), at_rest_m(Some(friction), 1));
        let elsewhere_m = at_rest_m(Some(friction), 2);
        assert!(free_m.abs() < 1e-5, "{free_m} m");
        assert!(held_m.abs() > 1e-4, "{held_m} m");
        assert!(
            (held_m - elsewhere_m).abs() > 1e-4,
            "{held_m}, {elsewhere_m} m"
        );
    }
}
