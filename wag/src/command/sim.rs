//! `wag sim`: rope simulation from files to files.

use crate::cli::{SimRopeArgs, SimThrowArgs};
use crate::config;
use anyhow::{Context, ensure};
use arm_model::unit_hint;
use cli_output::{OrInput, Outcome};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, MeasuredArm, Outcome as SimOutcome, PoseTrack, Precision,
    Rollout, SimOptions, Start, roll_out,
};
use run_log::files;
use serde_json::{Value, json};
use shared_types::RopeParams;

/// Output rate of tip positions (Hz).
const TIP_RATE_HZ: f64 = 240.0;

/// Runs one candidate on one thread.
fn simulate(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    options: &SimOptions,
) -> anyhow::Result<Rollout> {
    let mut rollouts = roll_out(&[Candidate::new(rope, motion)], options)?;
    let rollout = rollouts.pop().context("the simulator returned nothing")?;
    ensure!(
        rollout.outcome != SimOutcome::Diverged,
        "the simulation diverged even at a quarter of the step {} s; use a smaller --dt",
        options.step_s
    );
    Ok(rollout)
}

fn check_step(dt: f64) -> anyhow::Result<()> {
    ensure!(
        dt.is_finite() && (1e-7..=0.02).contains(&dt),
        "--dt is {dt} s, but must be from 1e-7 to 0.02 s{}",
        unit_hint("dt_s", dt, 0.02)
    );
    Ok(())
}

/// Frames j/rate from 0 to the last row.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "positive and bounded by the caller's check"
)]
fn options(step_s: f64, start: Start, duration_s: f64, rate_hz: f64) -> SimOptions {
    SimOptions {
        start,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count: (duration_s * rate_hz + 1e-6).floor() as usize + 1,
        },
        ..SimOptions::new(step_s, Precision::F64, duration_s)
    }
}

pub fn rope(args: &SimRopeArgs) -> Outcome<Option<Value>> {
    let rope = files::read_rope(&args.rope).or_input()?;
    let rows = files::read_pose(&args.pose).or_input()?;
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Err(bad_input!("`{}` is empty", args.pose.display()));
    };
    let (first_s, last_s) = (first.t_s, last.t_s);
    if !(args.fps.is_finite() && args.fps > 0.0 && args.fps <= 1e5) {
        return Err(bad_input!(
            "--fps is {}, but must be above 0 and at most 100000",
            args.fps
        ));
    }
    check_step(args.dt).or_input()?;
    if first_s.abs() > 1e-9 {
        return Err(bad_input!(
            "`{}`: column `t` starts at {first_s} s, but must start at 0",
            args.pose.display()
        ));
    }
    let motion = PoseTrack::new(&rows)
        .with_context(|| format!("`{}`", args.pose.display()))
        .or_input()?;
    let straight = Start::Straight {
        joint0_rotvec: args.initial_joint0.0,
    };
    let start = if args.hanging {
        Start::Equilibrium
    } else {
        straight
    };
    let options = SimOptions {
        precision: args.precision,
        ..options(args.dt, start, last_s, args.fps)
    };
    let count = options.frames.count;
    let rollout = simulate(&rope, &motion, &options).or_failed()?;
    let nodes = rollout.nodes.nodes();
    let mut bytes = Vec::new();
    rope_sim::npy::write_f64(&mut bytes, &rollout.nodes.shape(), &rollout.nodes.to_f64())
        .or_failed()?;
    files::write_atomic(&args.out, &bytes).or_failed()?;
    let rerun = rollout.outcome == SimOutcome::RerunAtQuarterStep;
    println!(
        "{count} frames of {nodes} nodes in `{}`; fastest tip {:.2} m/s{}",
        args.out.display(),
        rollout.peak_tip_speed_m_s,
        if rerun {
            "; diverged at the step asked for and was run again at a quarter of it"
        } else {
            ""
        }
    );
    Ok(Some(json!({
        "ok": true, "command": "sim rope", "frames": count, "nodes": nodes, "out": args.out,
        "peak_tip_speed_m_s": rollout.peak_tip_speed_m_s, "rerun_at_quarter_step": rerun,
    })))
}

pub fn throw(args: &SimThrowArgs) -> Outcome<Option<Value>> {
    let rope = files::read_rope(&args.rope).or_input()?;
    let joints = files::read_joints(&args.joints).or_input()?;
    check_step(args.dt).or_input()?;
    let cell = config::cell().or_input()?;
    let first_s = joints.times_s.first().copied().unwrap_or_default();
    let times: Vec<f64> = joints.times_s.iter().map(|t| t - first_s).collect();
    let motion = MeasuredArm::new(&times, &joints.q, cell.pole)
        .with_context(|| format!("`{}`", args.joints.display()))
        .or_input()?;
    let duration_s = times.last().copied().unwrap_or_default();
    let options = options(args.dt, Start::Equilibrium, duration_s, TIP_RATE_HZ);
    let count = options.frames.count;
    let rollout = simulate(&rope, &motion, &options).or_failed()?;
    let mut text = String::from("t,x,y,z\n");
    for frame in 0..count {
        let tip = rollout.nodes.position(frame, rollout.nodes.nodes() - 1);
        let t = first_s + options.frames.time_s(frame);
        text.push_str(&format!("{t:.6},{:.9},{:.9},{:.9}\n", tip.x, tip.y, tip.z));
    }
    files::write_atomic(&args.out, text.as_bytes()).or_failed()?;
    println!(
        "{count} tip positions in `{}`; fastest {:.2} m/s",
        args.out.display(),
        rollout.peak_tip_speed_m_s
    );
    Ok(Some(json!({
        "ok": true, "command": "sim throw", "samples": count, "out": args.out,
        "peak_tip_speed_m_s": rollout.peak_tip_speed_m_s,
    })))
}
