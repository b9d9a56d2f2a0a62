//! Sway after the wiggle and after calming moves, over random ropes:
//! `calm_table [ropes] [wait s] [move s] [knot s] [degrees Hz ramp duration]`.
//! The last four describe another wiggle than the default one. Every second
//! rope is given the least damping of the ranges.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector, Limits};
use planner::calm::{CalmConfig, CalmRequest, calm, sway_after};
use planner::ropes::random_rope;
use planner::tasks::start_pose_for;
use planner::wiggle::{WiggleConfig, wiggle};
use shared_types::RopeParams;
use std::time::Instant;

/// Turns of joint 1 towards the target (degrees).
const TURNS_DEG: [f64; 4] = [0.0, 35.0, -20.0, -35.0];

/// Joints as a perfect encoder would report them every 4 ms.
fn measured(trajectory: &JointTrajectory) -> (Vec<f64>, Vec<JointVector>) {
    (0..)
        .map(|i| f64::from(i) * 0.004)
        .take_while(|t| *t <= trajectory.duration_s())
        .map(|t| (t, trajectory.state_at(t).q))
        .unzip()
}

fn rope(seed: u64) -> RopeParams {
    let drawn = random_rope(seed);
    RopeParams {
        joint_damping_nms_per_rad: if seed.is_multiple_of(2) {
            0.001
        } else {
            drawn.joint_damping_nms_per_rad
        },
        ..drawn
    }
}

fn perturbed(rope: &RopeParams, part: f64) -> RopeParams {
    RopeParams {
        length_m: rope.length_m * (1.0 + part),
        joint_stiffness_nm_per_rad: rope.joint_stiffness_nm_per_rad * (1.0 + part),
        ..*rope
    }
}

/// One line of the table.
fn row(request: &CalmRequest, config: &CalmConfig) -> String {
    let begun = Instant::now();
    let found = match calm(request, config) {
        Ok(found) => found,
        Err(error) => return error.to_string(),
    };
    let seconds = begun.elapsed().as_secs_f64();
    let left_mm = |rope: RopeParams, late_s: f64| {
        let request = CalmRequest {
            rope,
            start_s: request.start_s + late_s,
            ..request.clone()
        };
        1e3 * sway_after(&request, &found.trajectory, 2).expect("it simulates")
    };
    let tool = request.limits.tcp_margin(&found.trajectory).value;
    let e = found.trajectory.extrema(5);
    let offset = (e.q_max.value - START_POSE[5]).max(START_POSE[5] - e.q_min.value);
    format!(
        "{:7.1} {:6.2} {:6.1} {:6.1} {:6.1} | {tool:5.2} {offset:6.3} {:5.1} {seconds:6.2}",
        1e3 * found.plain_sway_m,
        1e3 * found.calm_sway_m,
        left_mm(perturbed(&request.rope, 0.005), 0.0),
        left_mm(perturbed(&request.rope, -0.005), 0.0),
        left_mm(request.rope, 0.010),
        found.trajectory.duration_s(),
    )
}

fn main() {
    let args: Vec<f64> = std::env::args()
        .skip(1)
        .map(|a| a.parse().expect("a number"))
        .collect();
    let arg = |i: usize, default: f64| args.get(i).copied().unwrap_or(default);
    let mut config = CalmConfig::default();
    config.knot_s = arg(3, config.knot_s);
    if let Some(duration_s) = args.get(2) {
        config.durations_s = vec![*duration_s];
    }
    let default = WiggleConfig::default();
    let shape = WiggleConfig {
        amplitude_rad: arg(4, default.amplitude_rad.to_degrees()).to_radians(),
        frequency_hz: arg(5, default.frequency_hz),
        ramp_s: arg(6, default.ramp_s),
        duration_s: arg(7, default.duration_s),
        ..default
    };
    let before = wiggle(&shape, &Limits::default()).expect("a wiggle the arm may execute");
    let (times_s, q) = measured(&before);
    println!(
        "                                 | sway (mm)                          | tool  joint 6 move planned"
    );
    println!(
        "rope length damping stiff.  turn |  plain   calm  +0.5%  -0.5%  late  |  m/s     rad    s    in s"
    );
    for (seed, turn_deg) in (0u64..).zip(TURNS_DEG.into_iter().cycle()) {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        if seed as f64 >= arg(0, 8.0) {
            break;
        }
        let rope = rope(seed);
        let bearing = turn_deg.to_radians();
        let request = CalmRequest {
            rope,
            times_s: times_s.clone(),
            q: q.clone(),
            start_s: before.duration_s() + arg(1, 1.5),
            start_q: START_POSE,
            end_q: start_pose_for([bearing.cos(), bearing.sin(), 0.0]),
            limits: Limits::default(),
        };
        println!(
            "{seed:4} {:6.3} {:7.4} {:6.3} {turn_deg:5.0} | {}",
            rope.length_m,
            rope.joint_damping_nms_per_rad,
            rope.joint_stiffness_nm_per_rad,
            row(&request, &config)
        );
    }
}
