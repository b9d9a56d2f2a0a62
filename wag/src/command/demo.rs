//! `wag demo`: one throw from start to end on the simulated rig. Reads top to
//! bottom as the data flows.

use super::demo_summary::{DemoRecord, show};
use super::plan::{describe, planner_config, write_trajectory_csv};
use crate::cli::{DemoArgs, TaskName};
use crate::failure::{Failure, OrInput, Outcome};
use crate::files;
use crate::pipeline::{self, CalmInput, RunFolder};
use crate::progress::Stage;
use crate::session::{Session, watch_interrupts};
use anyhow::{Context, anyhow, bail};
use planner::tasks::check_reach;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use shared_types::ipc::message::{RigEvent, RigRequest, RigRpc, StrikeOrder};
use shared_types::ipc::rpc::RpcClient;
use shared_types::rope::RANGES;
use std::time::{Duration, Instant};

/// Speed of moves between poses, as a part of the fastest move.
///
/// Slow enough that the move lasts several periods of the rope's pendulum and
/// leaves it with millimetres of sway.
const MOVE_SPEED: f64 = 0.04;
/// The joint that wiggles (0-based).
const WIGGLE_JOINT: usize = 5;
/// Frames of a wiggle (paper: 400 at 60 Hz).
const WIGGLE_FRAMES: u32 = 400;
/// Frames of a throw: two and a half seconds.
const THROW_FRAMES: u32 = 150;
/// Longest wait for the rope to hang still (s).
const STILL_S: f64 = 3.0;

/// A target drawn from the seed where ropes of every length can strike
/// (distance from the base axis, height, bearing).
fn random_target(seed: u64) -> [f64; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(0x7a26_e701);
    let rho = rng.random_range(0.85..1.05);
    let height = rng.random_range(-0.10..0.60);
    let bearing: f64 = rng.random_range(-20.0_f64..20.0).to_radians();
    [rho * bearing.cos(), rho * bearing.sin(), height]
}

pub fn run(args: &DemoArgs, quiet: bool) -> Outcome<Option<Value>> {
    match args.task {
        TaskName::Strike => {}
        TaskName::Lob => return Err(super::plan::not_there("lob")),
        TaskName::Drape => return Err(super::plan::not_there("drape")),
    }
    let target_m = args
        .target
        .map_or_else(|| random_target(args.seed), |p| p.0);
    // Refused before anything starts, whatever rope turns out to be there.
    check_reach(target_m, RANGES[1].max).or_input()?;
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(args.out.as_deref(), &format!("demo-{}", args.seed))?;
    let began = Instant::now();
    let mut record = DemoRecord::new(args.seed, target_m, &folder);
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let result = throw_once(args, &folder, &mut session, &mut record, quiet);
    session.stop(None);
    record.wall_s = began.elapsed().as_secs_f64();
    let kept = session.recorder.write(folder.path(), record.epoch_ns());
    record.error = result.as_ref().err().map(|e| format!("{e:#}"));
    files::write_json(&folder.file("summary.json"), &record).or_failed()?;
    result
        .with_context(|| format!("run `{}`", folder.path().display()))
        .map_err(Failure::failed)?;
    kept.or_failed()?;
    if !quiet {
        show(&record);
    }
    Ok(Some(serde_json::to_value(&record).or_failed()?))
}

fn throw_once(
    args: &DemoArgs,
    folder: &RunFolder,
    session: &mut Session,
    record: &mut DemoRecord,
    quiet: bool,
) -> anyhow::Result<()> {
    let limits = files::default_limits()?;
    let planner_settings = planner_config(None)?;

    // Start: rig first, because the others find the arm's ports there.
    let stage = Stage::begin("start", quiet);
    let rig_config = pipeline::rig_config(folder, args.seed, record.target_m)?;
    let calibration = rig_config.stereo_camera();
    let colours = rig_config.appearance();
    pipeline::write_calibration(folder, &calibration)?;
    let rig = pipeline::start_rig(session, folder, &rig_config)?;
    let ports = arm_ports(session, &rig)?;
    let camera = pipeline::start_camera(session, folder)?;
    let planner = pipeline::start_planner(session, folder, &planner_settings)?;
    let arm = pipeline::start_controller(session, folder, &limits, ports)?;
    record.stages.start_s = stage.done("rig, controller, camera and planner are up");

    // Bring-up: enable the arm, move to the start pose, wait for the rope.
    let stage = Stage::begin("bring-up", quiet);
    record.warnings = pipeline::acquire(session, &arm)?;
    let wiggle = planner::wiggle::wiggle(&planner_settings.wiggle, &limits)?;
    pipeline::move_to(session, &arm, wiggle.start(), MOVE_SPEED)?;
    stage.say("waiting for the rope to hang still");
    let still = pipeline::wait_still(session, &camera, STILL_S)?;
    record.stages.bringup_s = stage.done(if still {
        "arm enabled, rope hangs still"
    } else {
        "arm enabled, rope still sways a little"
    });

    // Wiggle: stream it and film it.
    let stage = Stage::begin("wiggle", quiet);
    let film = pipeline::film_during(
        session,
        &camera,
        &arm,
        &wiggle,
        WIGGLE_FRAMES,
        false,
        &stage,
    )?;
    record.set_wiggle(&film);
    record.stages.wiggle_s =
        stage.done(&format!("{} frames, {} dropped", film.frames, film.dropped));

    // Track and identify.
    let stage = Stage::begin("track", quiet);
    let overlay = folder.file("wiggle.png");
    let tracked = pipeline::track(session, &camera, &calibration, &film, &overlay, &stage)?;
    record.set_track(&tracked);
    record.stages.track_s = stage.done(&format!(
        "{:.1} ms a frame, rope lost in {:.1} %",
        tracked.ms_per_frame,
        100.0 * tracked.lost_part
    ));
    let stage = Stage::begin("identify", quiet);
    let appearance = tracked.appearance;
    let estimate = pipeline::identify(
        session,
        &planner,
        &calibration,
        &film,
        appearance,
        args.seed,
        &stage,
    )?;
    files::write_rope_estimate(&folder.file("params.toml"), &estimate)?;
    record.stages.identify_s = stage.done(&format!(
        "length {:.3} m, residual {:.2} px, {} simulations",
        estimate.params.length_m, estimate.residual_px, estimate.simulations
    ));
    record.set_identified(&estimate);

    // Plan with what was identified.
    let stage = Stage::begin("plan", quiet);
    let order = StrikeOrder {
        rope: estimate.params,
        target_m: record.target_m,
        limits: limits.clone(),
        seed: args.seed,
    };
    let plan = pipeline::plan_strike(session, &planner, order, &stage)?;
    files::write_json(&folder.file("plan.json"), &plan)?;
    write_trajectory_csv(&folder.file("plan.csv"), &plan.trajectory, &limits)?;
    record.stages.plan_s = stage.done(&describe(&plan));
    record.set_plan(&plan);

    // Calm: turn towards the target so that the rope comes to rest.
    let stage = Stage::begin("calm", quiet);
    let arm_lag_s = pipeline::joint_lag_s(&session.recorder, &film.motion, WIGGLE_JOINT);
    let input = CalmInput {
        rope: estimate.params,
        film: &film,
        start_q: wiggle.end(),
        end_q: plan.trajectory.start(),
        limits: &limits,
        arm_lag_s: arm_lag_s.unwrap_or_default(),
    };
    let calmed = pipeline::calm(session, &planner, &arm, &input, &stage)?;
    stage.say("waiting for the rope to hang still");
    pipeline::wait_still(session, &camera, STILL_S)?;
    record.set_calm(&calmed, arm_lag_s);
    record.stages.calm_s = stage.done(&format!(
        "sway {:.1} cm -> {:.1} cm",
        100.0 * calmed.plain_sway_m,
        100.0 * calmed.calm_sway_m
    ));

    // Throw once, open loop, filmed.
    let stage = Stage::begin("throw", quiet);
    pipeline::latency(session, &arm)?;
    let throw = pipeline::film_during(
        session,
        &camera,
        &arm,
        &plan.trajectory,
        THROW_FRAMES,
        true,
        &stage,
    )?;
    record.set_latency(&pipeline::latency(session, &arm)?);
    record.stages.throw_s = stage.done(&format!(
        "{} frames, {} dropped",
        throw.frames, throw.dropped
    ));

    // Score by the camera; then, apart, what really happened.
    let stage = Stage::begin("score", quiet);
    let strobe = folder.file("throw.png");
    let score = pipeline::score(
        session,
        &camera,
        &calibration,
        colours.lead_rgb,
        colours.target_rgb,
        &strobe,
    );
    record.set_score(score);
    let truth = rig_truth(
        session,
        &rig,
        throw.motion.start_ns,
        throw.motion.end_ns + 600_000_000,
    )?;
    record.set_truth(&truth)?;
    record.stages.score_s = stage.done(&record.score_line());
    Ok(())
}

fn arm_ports(session: &mut Session, rig: &RpcClient<RigRpc>) -> anyhow::Result<(u16, u16)> {
    match session.ask(rig, &RigRequest::Ports, Duration::from_secs(5), |_| ())? {
        RigEvent::Ports { command, reports } => Ok((command, reports[0])),
        RigEvent::Failed { message } => Err(anyhow!(message)),
        other => bail!("the rig answered with {other:?}"),
    }
}

fn rig_truth(
    session: &mut Session,
    rig: &RpcClient<RigRpc>,
    from_ns: u64,
    to_ns: u64,
) -> anyhow::Result<RigEvent> {
    let request = RigRequest::Truth { from_ns, to_ns };
    match session.ask(rig, &request, Duration::from_secs(10), |_| ())? {
        RigEvent::Failed { message } => Err(anyhow!(message)),
        truth => Ok(truth),
    }
}
