//! Sway after the wiggle and after calming moves, over random ropes:
//! `calm_table [ropes] [wait s] [duration s] [knots] [degrees Hz ramp duration]`.
//! The last four describe another wiggle than the default one.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use planner::calm::{CalmConfig, CalmRequest, calm, sway_after};
use planner::ropes::random_rope;
use planner::tasks::start_pose_for;
use planner::wiggle::{WiggleConfig, wiggle};
use shared_types::plan::START_POSE;
use shared_types::{JointTrajectory, JointVector, Limits, RopeParams};
use std::time::Instant;

/// Joints as a perfect encoder would report them every 4 ms.
fn measured(trajectory: &JointTrajectory) -> (Vec<f64>, Vec<JointVector>) {
    let count = (trajectory.duration_s() / 0.004).ceil();
    (0..)
        .map(|i| f64::from(i) * 0.004)
        .take_while(|t| *t <= count * 0.004)
        .map(|t| (t, trajectory.state_at(t).q))
        .unzip()
}

fn perturbed(rope: &RopeParams, part: f64) -> RopeParams {
    RopeParams {
        length_m: rope.length_m * (1.0 + part),
        joint_stiffness_nm_per_rad: rope.joint_stiffness_nm_per_rad * (1.0 + part),
        ..*rope
    }
}

fn main() {
    let args: Vec<f64> = std::env::args()
        .skip(1)
        .map(|a| a.parse().expect("a number"))
        .collect();
    let arg = |i: usize, default: f64| args.get(i).copied().unwrap_or(default);
    let wait_s = arg(1, 1.5);
    let config = CalmConfig {
        duration_s: arg(2, CalmConfig::default().duration_s),
        knots: arg(3, 7.0).to_string().parse().expect("whole knots"),
        ..CalmConfig::default()
    };
    let default = WiggleConfig::default();
    let wiggled = wiggle(
        &WiggleConfig {
            amplitude_rad: arg(4, default.amplitude_rad.to_degrees()).to_radians(),
            frequency_hz: arg(5, default.frequency_hz),
            ramp_s: arg(6, default.ramp_s),
            duration_s: arg(7, default.duration_s),
            ..default
        },
        &Limits::default(),
    )
    .expect("the wiggle keeps the limits");
    let (times_s, q) = measured(&wiggled);
    println!("rope length damping stiffness  turn |  plain   calm  +0.5%  -0.5%  10 ms late (mm) | tool m/s  offset rad  seconds");
    let mut seed = 0u64;
    while seed < arg(0, 8.0) as u64 {
        let mut rope = random_rope(seed);
        if seed % 2 == 0 {
            rope.joint_damping_nms_per_rad = 0.001;
        }
        let turn = [0.0, 35.0, -20.0, -35.0][(seed % 4) as usize];
        let bearing = f64::to_radians(turn);
        let request = CalmRequest {
            rope,
            times_s: times_s.clone(),
            q: q.clone(),
            start_s: wiggled.duration_s() + wait_s,
            start_q: START_POSE,
            end_q: start_pose_for([bearing.cos(), bearing.sin(), 0.0]),
            limits: Limits::default(),
        };
        let begun = Instant::now();
        let found = calm(&request, &config);
        let seconds = begun.elapsed().as_secs_f64();
        print!(
            "{seed:4} {:6.3} {:7.4} {:9.3} {turn:5.0} |",
            rope.length_m, rope.joint_damping_nms_per_rad, rope.joint_stiffness_nm_per_rad
        );
        match found {
            Ok(m) => {
                let with = |r: RopeParams, late_s: f64| {
                    let request = CalmRequest {
                        rope: r,
                        start_s: request.start_s + late_s,
                        ..request.clone()
                    };
                    1e3 * sway_after(&request, &m.trajectory, 2).expect("it simulates")
                };
                let tool = Limits::default().tcp_margin(&m.trajectory).value;
                let e = m.trajectory.extrema(5);
                println!(
                    "{:7.1} {:6.2} {:6.1} {:6.1} {:6.1} | {tool:.2} {:.3} {seconds:.2}",
                    1e3 * m.plain_sway_m,
                    1e3 * m.calm_sway_m,
                    with(perturbed(&rope, 0.005), 0.0),
                    with(perturbed(&rope, -0.005), 0.0),
                    with(rope, 0.010),
                    (e.q_max.value - START_POSE[5]).max(START_POSE[5] - e.q_min.value),
                );
            }
            Err(error) => println!(" {error}"),
        }
        seed += 1;
    }
}
