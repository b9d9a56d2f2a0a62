//! `wag demo`: one throw from start to end on the simulated rig. Reads top to
//! bottom as the data flows.

use super::demo_summary::{DemoRecord, show};
use super::explain::explain_stop;
use super::network::warning_of_pole;
use super::plan::describe;
use super::unconfirmed::confirm;
use crate::cli::{DemoArgs, TaskName};
use crate::config;
use crate::pipeline::{self, ArmLink, Film, RunFolder, SettleInput, Shot};
use crate::session::Session;
use anyhow::{Context, anyhow};
use arm_model::{JointTrajectory, Limits};
use cli_output::{Failure, OrInput, Outcome, Stage, watch_interrupts};
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest, check_reach, clear_of_arm, warnings};
use planner::service::PlannerRpc;
use planner::wiggle::wiggle;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig_sim::RigConfig;
use rig_sim::render::Appearance;
use run_log::files;
use serde_json::Value;
use shared_types::ipc::message::{CameraRpc, RigEvent, RigRequest, RigRpc, ScoreResult};
use shared_types::ipc::rpc::RpcClient;
use shared_types::rope::RANGES;
use shared_types::{OperatingMode, Plan, RopeEstimate, StereoCamera, Task};
use std::path::Path;
use std::time::{Duration, Instant};
use viewer::report;

/// Speed of moves between poses, as a part of the fastest move.
///
/// Slow enough that the move lasts several periods of the rope's pendulum and
/// leaves it with millimetres of swing.
const MOVE_SPEED: f64 = 0.04;
/// The joint that wiggles (0-based).
const WIGGLE_JOINT: usize = 5;
/// Frames of a wiggle (paper: 400 at 60 Hz).
const WIGGLE_FRAMES: u32 = 400;
/// Frames of a throw: two and a half seconds.
const THROW_FRAMES: u32 = 150;
/// How well the rig's camera is known to stand where its calibration says (m, and rad of
/// roll): exactly, but for what its lens leaves over.
const CAMERA_STD: f64 = 1e-3;
/// Time after the last setpoint that still belongs to the throw (ns).
const AFTER_THROW_NS: u64 = 600_000_000;
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
    let rig = pipeline::shipped_rig(args.rig_config.as_deref()).or_input()?;
    check_reach(target_m, RANGES[1].max, &rig.cell).or_input()?;
    clear_of_arm(target_m, &rig.cell).or_input()?;
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(args.out.as_deref(), &format!("demo-{}", args.seed))?;
    let began = Instant::now();
    let mut record = DemoRecord::new(args.seed, target_m, &folder);
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let result = throw_once(&folder, &mut session, &mut record, &rig, (args, quiet));
    session.end(result.is_ok());
    record.wall_s = began.elapsed().as_secs_f64();
    let keypoints_kept = session.received.keep_keypoints(folder.path());
    record.error = result.as_ref().err().map(|e| format!("{e:#}"));
    let summary_kept = files::write_json(&folder.file(files::SUMMARY), &record);
    let recorded = session.finish_run_file();
    explain_stop(folder.path(), quiet);
    result
        .with_context(|| format!("run `{}`", folder.path().display()))
        .map_err(Failure::failed)?;
    keypoints_kept.or_failed()?;
    if !quiet {
        show(&record);
    }
    keep_report(folder.path(), quiet);
    recorded.or_failed()?;
    summary_kept.or_failed()?;
    Ok(Some(serde_json::to_value(&record).or_failed()?))
}

/// The run as a page to look at. Without it the run is as good as before.
fn keep_report(run: &Path, quiet: bool) {
    match config::cell_here().and_then(|here| report::write(run, None, &here)) {
        Ok(written) if !quiet => println!("report: {}", written.path.display()),
        Ok(_) => {}
        Err(reason) => tracing::warn!("no report was written: {reason:#}"),
    }
}

/// The whole throw; each line hands the next what it found.
fn throw_once(
    folder: &RunFolder,
    session: &mut Session,
    record: &mut DemoRecord,
    rig: &RigConfig,
    (args, quiet): (&DemoArgs, bool),
) -> anyhow::Result<()> {
    let mut settings = config::here::<PlannerConfig>(None)?;
    settings.identify.seed = record.seed;
    settings.identify.camera_position_std_m = CAMERA_STD;
    settings.identify.camera_look_at_std_m = CAMERA_STD;
    settings.identify.camera_roll_std_rad = CAMERA_STD;
    let rig_config = pipeline::rig_config(folder, rig, record.seed, record.target_m);
    let mut demo = Demo::start(folder, session, record, quiet, settings, &rig_config)?;
    let motion = wiggle(&demo.settings.wiggle, &demo.limits)?;
    demo.bring_up(&motion)?;
    let film = demo.wiggle(&motion)?;
    let rope = demo.identify(&film, args.accept_unconfirmed)?;
    let plan = demo.plan(&rope)?;
    demo.settle(&rope, &film, &motion, &plan)?;
    let throw = demo.throw(&plan)?;
    let score = demo.score(&rig_config.appearance());
    demo.compare_with_truth(&throw, score)
}

/// The running processes and what all stages need.
struct Demo<'a> {
    folder: &'a RunFolder,
    session: &'a mut Session,
    record: &'a mut DemoRecord,
    quiet: bool,
    limits: Limits,
    settings: PlannerConfig,
    calibration: StereoCamera,
    rig: RpcClient<RigRpc>,
    camera: RpcClient<CameraRpc>,
    planner: RpcClient<PlannerRpc>,
    arm: ArmLink,
}

impl<'a> Demo<'a> {
    /// Starts all processes; the rig first, because the arm's ports are found
    /// there.
    fn start(
        folder: &'a RunFolder,
        session: &'a mut Session,
        record: &'a mut DemoRecord,
        quiet: bool,
        settings: PlannerConfig,
        rig_config: &RigConfig,
    ) -> anyhow::Result<Self> {
        let stage = Stage::begin("start", quiet);
        let limits = config::here::<Limits>(None)?;
        let calibration = rig_config.stereo_camera();
        pipeline::write_calibration(folder, &calibration)?;
        let target_m = Some(record.target_m);
        pipeline::start_recorder(session, folder, &limits, Some(&calibration), target_m)?;
        let rig = pipeline::start_rig(session, folder, rig_config)?;
        let address = pipeline::arm_ports(session, &rig)?;
        let camera = pipeline::start_camera(session, folder)?;
        let planner = pipeline::start_planner(session, folder, &settings)?;
        let arm = pipeline::start_controller(session, folder, &limits, address)?;
        record.stages.start_s = stage.done("rig, controller, camera and planner are up");
        Ok(Self {
            folder,
            session,
            record,
            quiet,
            limits,
            settings,
            calibration,
            rig,
            camera,
            planner,
            arm,
        })
    }

    /// Enables the arm, moves to the start pose, waits for the rope.
    fn bring_up(&mut self, wiggle: &JointTrajectory) -> anyhow::Result<()> {
        let stage = Stage::begin("bring-up", self.quiet);
        self.record.warnings = pipeline::acquire(self.session, &self.arm)?;
        // The arm is simulated: nobody needs to be asked.
        pipeline::arm_for(self.session, &self.arm, OperatingMode::SetUp)?;
        pipeline::move_to(self.session, &self.arm, wiggle.start(), MOVE_SPEED)?;
        stage.say("waiting for the rope to hang still");
        let still = pipeline::wait_still(self.session, &self.camera, STILL_S)?;
        self.record.stages.bringup_s = stage.done(if still {
            "arm enabled and armed (simulated: no confirmation needed), rope hangs still"
        } else {
            "arm enabled, rope still swings a little"
        });
        Ok(())
    }

    /// Streams the wiggle and films it.
    fn wiggle(&mut self, wiggle: &JointTrajectory) -> anyhow::Result<Film> {
        let stage = Stage::begin("wiggle", self.quiet);
        pipeline::arm_for(self.session, &self.arm, OperatingMode::Wiggle)?;
        let film = pipeline::film_during(
            self.session,
            &self.camera,
            &self.arm,
            wiggle,
            Shot {
                frames: WIGGLE_FRAMES,
                both_eyes: false,
                throw: false,
            },
            &stage,
        )?;
        self.record.set_wiggle(film);
        self.record.stages.wiggle_s =
            stage.done(&format!("{} frames, {} dropped", film.frames, film.dropped));
        Ok(film)
    }

    /// Tracks the rope through the film and fits its parameters.
    fn identify(&mut self, film: &Film, accept_unconfirmed: bool) -> anyhow::Result<RopeEstimate> {
        let stage = Stage::begin("track", self.quiet);
        let overlay = self.folder.file("wiggle.png");
        let tracked = pipeline::track(
            self.session,
            &self.camera,
            &self.calibration,
            film,
            self.settings.cell.pole,
            &overlay,
            &stage,
        )?;
        self.record.track = Some(tracked.clone());
        self.record.stages.track_s = stage.done(&format!(
            "{:.1} ms a frame, rope lost in {:.1} %",
            tracked.ms_per_frame,
            100.0 * tracked.lost_fraction
        ));
        let look = format!("look at `{}`", overlay.display());
        confirm(&tracked.doubts, accept_unconfirmed, &look)?;
        let method = self.settings.identify.method;
        if let Some(warning) = warning_of_pole(method, &self.settings.cell.pole) {
            self.warn(warning);
        }
        let stage = Stage::begin("identify", self.quiet);
        let rope = pipeline::identify(
            self.session,
            &self.planner,
            &self.calibration,
            film,
            tracked.appearance,
            &self.settings,
            &stage,
        )?;
        files::write_rope_estimate(&self.folder.file(files::ROPE), &rope, &tracked.doubts)?;
        self.record.stages.identify_s = stage.done(&format!(
            "length {:.3} m, residual {:.2} px, {} simulations",
            rope.params.length_m, rope.residual_px, rope.simulations
        ));
        self.record.identified = Some(rope.clone());
        Ok(rope)
    }

    /// Tells a person, and keeps it in the summary.
    fn warn(&mut self, warning: &str) {
        if !self.quiet {
            eprintln!("warning: {warning}");
        }
        self.record.warnings.push(warning.to_owned());
    }

    /// Plans the throw with what was identified.
    fn plan(&mut self, rope: &RopeEstimate) -> anyhow::Result<Plan> {
        let stage = Stage::begin("plan", self.quiet);
        let options = PlanOptions {
            seed: self.record.seed,
            ..self.settings.search
        };
        let goal = self.settings.goal(Task::Strike, self.record.target_m);
        let request = PlanRequest {
            limits: self.limits.clone(),
            cell: self.settings.cell,
            ..PlanRequest::new(goal, &rope.params, options)
        };
        let plan = pipeline::plan(self.session, &self.planner, request, &stage)?;
        files::write_json(&self.folder.file(files::PLAN), &plan)?;
        files::write_trajectory(
            &self.folder.file("plan.csv"),
            &plan.trajectory,
            self.limits.period_s(),
        )?;
        self.record.stages.plan_s = stage.done(&describe(&plan));
        for warning in warnings(&plan) {
            self.warn(&warning);
        }
        self.record.set_plan(&plan);
        Ok(plan)
    }

    /// Turns towards the target so that the rope comes to rest.
    fn settle(
        &mut self,
        rope: &RopeEstimate,
        film: &Film,
        wiggle: &JointTrajectory,
        plan: &Plan,
    ) -> anyhow::Result<()> {
        let stage = Stage::begin("settle", self.quiet);
        let arm_lag_s = {
            let span = [film.motion.start_ns, film.motion.end_ns];
            self.session.received.cycles.joint_lag_s(WIGGLE_JOINT, span)
        };
        let input = SettleInput {
            rope: rope.params,
            film,
            start_q: wiggle.end(),
            end_q: plan.trajectory.start(),
            limits: &self.limits,
            cell: self.settings.cell,
            config: &self.settings.settle,
            arm_lag_s: arm_lag_s.unwrap_or_default(),
        };
        let settled = pipeline::settle(self.session, &self.planner, &self.arm, &input, &stage)?;
        stage.say("waiting for the rope to hang still");
        pipeline::wait_still(self.session, &self.camera, STILL_S)?;
        self.record.settle = Some(settled);
        self.record.arm_lag_s = arm_lag_s;
        self.record.stages.settle_s = stage.done(&format!(
            "swing {:.1} cm -> {:.1} cm",
            100.0 * settled.plain_residual_m,
            100.0 * settled.residual_m
        ));
        Ok(())
    }

    /// Throws once, open loop, filmed.
    fn throw(&mut self, plan: &Plan) -> anyhow::Result<Film> {
        let stage = Stage::begin("throw", self.quiet);
        pipeline::arm_for(self.session, &self.arm, OperatingMode::Throw)?;
        // Empties the histograms, so that they hold this throw alone.
        pipeline::latency(self.session, &self.arm)?;
        let film = pipeline::film_during(
            self.session,
            &self.camera,
            &self.arm,
            &plan.trajectory,
            Shot {
                frames: THROW_FRAMES,
                both_eyes: true,
                throw: true,
            },
            &stage,
        )?;
        self.record.latency = Some(pipeline::latency(self.session, &self.arm)?);
        self.record.stages.throw_s =
            stage.done(&format!("{} frames, {} dropped", film.frames, film.dropped));
        Ok(film)
    }

    /// Scores the throw by the camera.
    fn score(&mut self, colours: &Appearance) -> anyhow::Result<ScoreResult> {
        let stage = Stage::begin("score", self.quiet);
        let strobe = self.folder.file("throw.png");
        let score = pipeline::score(
            self.session,
            &self.camera,
            &self.calibration,
            colours.lead_rgb,
            colours.target_rgb,
            &strobe,
        );
        self.record.stages.score_s = stage.done(&match &score {
            Ok(s) => format!("by camera {:.1} cm", 100.0 * s.closest_m),
            Err(_) => "the camera could not measure the throw".to_owned(),
        });
        score
    }

    /// Only now the rig is asked what really happened. That the camera could
    /// not see the throw does not undo the throw; it is reported.
    fn compare_with_truth(
        &mut self,
        throw: &Film,
        score: anyhow::Result<ScoreResult>,
    ) -> anyhow::Result<()> {
        self.record.set_score(score);
        let request = RigRequest::Truth {
            from_ns: throw.motion.start_ns,
            to_ns: throw.motion.end_ns + AFTER_THROW_NS,
        };
        match self
            .session
            .ask(&self.rig, &request, Duration::from_secs(10), |_| ())?
        {
            RigEvent::Failed { message } => Err(anyhow!(message)),
            truth => self.record.set_truth(&truth),
        }
    }
}
