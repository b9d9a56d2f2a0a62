//! `wag demo`: one throw from start to end on the simulated rig. Reads top to
//! bottom as the data flows.

mod rope;
mod summary;

use super::plan_again::LastThrow;
use super::runs::explain_stop;
use crate::cli::DemoArgs;
use crate::config;
use crate::pipeline::{self, ArmLink, BringUp, RunFolder, execute};
use anyhow::{Context, anyhow, bail};
use arm_model::{JointTrajectory, Limits};
use camera_ingest::calib::{VideoMode, write_camera_toml, write_factory_conf};
use camera_ingest::process::CameraConfig;
use cli_output::{OrInput, Outcome, Stage, output, watch_interrupts};
use planner::PlannerConfig;
use planner::plan::{check_reach, clear_of_arm};
use planner::service::{PlannerRequest, PlannerRpc};
use planner::wiggle::wiggle;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig_sim::RigConfig;
use run_log::{DemoRecord, Film, files};
use serde_json::Value;
use session::Session;
use shared_types::ipc::message::{CameraEvent, CameraRequest, CameraRpc, RigRequest, RigRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::rope::RANGES;
use shared_types::{OperatingMode, Plan, StereoCamera, Task};
use std::path::{Path, PathBuf};
use std::time::Instant;
use summary::show;
use viewer::report;

/// Speed of moves between poses, as a part of the fastest move.
///
/// Slow enough that the move lasts several periods of the rope's pendulum and
/// leaves it with millimetres of swing.
const MOVE_SPEED: f64 = 0.04;
/// Frames of a wiggle (paper: 400 at 60 Hz).
const WIGGLE_FRAMES: u32 = 400;
/// Frames of a throw: two and a half seconds.
const THROW_FRAMES: u32 = 150;
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

pub fn run(args: &DemoArgs) -> Outcome<Option<Value>> {
    if args.task != Task::Strike {
        let task = args.task.name();
        return Err(failed!(
            "a demo of the {task} is not implemented in this version; `wag plan {task}` plans and judges one in simulation"
        ));
    }
    let last = args.again.as_deref().map(last_demo).transpose()?;
    let (last, rig_config) = last.unzip();
    let rig_config = rig_config.as_ref().or(args.rig_config.as_ref());
    let rig: RigConfig = config::here(rig_config.map(PathBuf::as_path)).or_input()?;
    let seed = last.as_ref().map_or(args.seed, |_| rig.seed);
    let target_m = match (&last, args.target) {
        (Some(last), _) => last.plan.target_m,
        (None, Some(target)) => target.0,
        (None, None) => random_target(seed),
    };
    // Refused before anything starts, whatever rope turns out to be there.
    check_reach(target_m, RANGES[1].max, &rig.cell).or_input()?;
    clear_of_arm(target_m, &rig.cell).or_input()?;
    watch_interrupts().or_failed()?;
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    let plan = last.map(|last| {
        let ways = (
            config::here(None).or_input()?,
            config::here(None).or_input()?,
        );
        last.to_throw(ways, None)
    });
    let plan = plan.transpose()?;
    let folder = RunFolder::create(args.out.as_deref(), &format!("demo-{seed}"))?;
    let began = Instant::now();
    let mut record = DemoRecord::new(seed, target_m, &folder.path);
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let accept = args.accept_unconfirmed;
    let result = throw_once(&folder, &mut session, &mut record, &rig, (plan, accept));
    session.end(result.is_ok());
    record.wall_s = began.elapsed().as_secs_f64();
    let keypoints_kept = session.received.keep_keypoints(&folder.path);
    record.error = result.as_ref().err().map(|e| format!("{e:#}"));
    let summary_kept = files::write_json(&folder.file(files::SUMMARY), &record);
    let recorded = session.finish_run_file();
    explain_stop(&folder.path);
    let result = result.with_context(|| format!("run `{}`", folder.path.display()));
    result.or_failed()?;
    keypoints_kept.or_failed()?;
    show(&record);
    keep_report(&folder.path);
    recorded.or_failed()?;
    summary_kept.or_failed()?;
    Ok(Some(serde_json::to_value(&record).or_failed()?))
}

/// The run as a page to look at. Without it the run is as good as before.
fn keep_report(run: &Path) {
    match config::cell_here().and_then(|here| report::write(run, None, &here)) {
        Ok(written) => println!("report: {}", written.path.display()),
        Err(reason) => tracing::warn!("no report was written: {reason:#}"),
    }
}

/// The throw of a demo, and the file of its rig, seed and all.
fn last_demo(run: &Path) -> Outcome<(LastThrow, PathBuf)> {
    let rig_config = run.join("config").join("rig.toml");
    if !rig_config.is_file() {
        return Err(bad_input!(
            "`{}` is not the folder of a demo: it lacks config/rig.toml",
            run.display()
        ));
    }
    Ok((LastThrow::read(run, None)?, rig_config))
}

/// The whole throw; each line hands the next what it found. A `corrected` plan needs no wiggle.
fn throw_once(
    folder: &RunFolder,
    session: &mut Session,
    record: &mut DemoRecord,
    rig: &RigConfig,
    (corrected, accept_unconfirmed): (Option<Plan>, bool),
) -> anyhow::Result<()> {
    let settings = config::here::<PlannerConfig>(None)?.with_identify_seed(record.seed);
    let rig_config = pipeline::rig_config(folder, rig, record.seed, record.target_m);
    let mut demo = Demo::start(folder, session, record, settings, &rig_config)?;
    let plan = match corrected {
        Some(plan) => {
            demo.keep_plan(&plan)?;
            demo.bring_up(&plan.trajectory)?;
            plan
        }
        None => {
            let motion = wiggle(&demo.settings.wiggle, &demo.limits)?;
            demo.bring_up(&motion)?;
            let film = demo.wiggle(&motion)?;
            let tracked = demo.track(&film, accept_unconfirmed)?;
            let rope = demo.identify(&film, tracked)?;
            let plan = demo.plan(&rope)?;
            demo.settle(&rope, &film, &motion, &plan)?;
            plan
        }
    };
    let throw = demo.throw(&plan)?;
    demo.score(&rig_config);
    demo.compare_with_truth(&throw)
}

/// The running processes and what all stages need.
struct Demo<'a> {
    folder: &'a RunFolder,
    session: &'a mut Session,
    record: &'a mut DemoRecord,
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
        settings: PlannerConfig,
        rig_config: &RigConfig,
    ) -> anyhow::Result<Self> {
        let stage = Stage::begin("start");
        let limits = config::here::<Limits>(None)?;
        // The calibration lies in the run folder as a lab's would.
        let calibration = rig_config.camera.stereo_camera();
        let (conf, mode) = (Path::new("camera.conf"), VideoMode::Vga);
        write_factory_conf(&folder.path.join(conf), &calibration, mode)?;
        write_camera_toml(&folder.file(files::CAMERA), &calibration, mode, conf)?;
        let target_m = Some(record.target_m);
        pipeline::start_recorder(session, folder, &limits, Some(&calibration), target_m)?;
        let (rig, address) = pipeline::start_rig(session, folder, rig_config)?;
        let domain = folder.domain.clone();
        let config = CameraConfig {
            domain: domain.clone(),
        };
        let ping = &CameraRequest::Ping;
        let camera = pipeline::start(session, folder, "camera-ingest", &config, ping)?;
        let config = PlannerConfig {
            domain,
            ..settings.clone()
        };
        let ping = &PlannerRequest::Ping;
        let planner = pipeline::start(session, folder, "planner", &config, ping)?;
        let arm = pipeline::controller(session, folder, &limits, &address)?;
        record.stages.start_s = stage.done("rig, controller, camera and planner are up");
        Ok(Self {
            folder,
            session,
            record,
            limits,
            settings,
            calibration,
            rig,
            camera,
            planner,
            arm,
        })
    }

    /// Tells a person, and keeps it in the summary.
    fn warn(&mut self, warning: &str) {
        output::remark(format_args!("warning: {warning}"));
        self.record.warnings.push(warning.to_owned());
    }

    /// Asks the camera; its last event, unless that is a failure.
    fn ask_camera(
        &mut self,
        request: &CameraRequest,
        within_s: f64,
        stage: &Stage,
    ) -> anyhow::Result<CameraEvent> {
        let event = self.session.ask(&self.camera, request, within_s, |event| {
            if let CameraEvent::Progress(p) = event {
                stage.progress(p);
            }
        })?;
        answered(event)
    }

    /// Waits until nothing moves in the picture; whether that came about.
    fn wait_still(&mut self, stage: &Stage) -> anyhow::Result<bool> {
        stage.say("waiting for the rope to hang still");
        let request = CameraRequest::WaitStill { timeout_s: STILL_S };
        match self.ask_camera(&request, STILL_S + 5.0, stage)? {
            CameraEvent::Still { still } => Ok(still),
            other => bail!("the camera process answered with {other:?}"),
        }
    }

    /// Enables the arm, moves to the start pose, waits for the rope.
    fn bring_up(&mut self, motion: &JointTrajectory) -> anyhow::Result<()> {
        let stage = Stage::begin("bring-up");
        let mut found = BringUp::default();
        pipeline::acquire(self.session, &self.arm, &mut found)?;
        self.record.warnings.extend(found.warnings);
        pipeline::arm_for(self.session, &self.arm, OperatingMode::SetUp, None)?;
        pipeline::move_to(self.session, &self.arm, motion.start(), MOVE_SPEED)?;
        let still = self.wait_still(&stage)?;
        self.record.stages.bringup_s = stage.done(if still {
            "arm enabled and armed (simulated: no confirmation needed), rope hangs still"
        } else {
            "arm enabled, rope still swings a little"
        });
        Ok(())
    }

    /// Records frames; as soon as the first is kept, streams `trajectory`. A throw is
    /// finished whatever becomes of the film, of both eyes. A wiggle is made for the film's
    /// sake, which needs the left eye only, and is braked when it is lost.
    fn film(
        &mut self,
        frames: u32,
        trajectory: &JointTrajectory,
        throw: bool,
        stage: &Stage,
    ) -> anyhow::Result<Film> {
        let request = CameraRequest::Record {
            frames,
            both_images: throw,
        };
        let recording = self.camera.call(&request)?;
        let first_stamp_ns = match answered(self.session.next(&recording, 5.0)?)? {
            CameraEvent::Recording { first_stamp_ns } => first_stamp_ns,
            other => bail!("the camera process answered a recording with {other:?}"),
        };
        let stream = |session: &mut Session| execute(session, &self.arm, trajectory);
        let motion = if throw {
            self.session.committed(stream)?
        } else {
            stream(self.session)?
        };
        let within_s = f64::from(frames) / 15.0 + 5.0;
        let event = self.session.finish(&recording, within_s, |event| {
            if let CameraEvent::Progress(p) = event {
                stage.progress(p);
            }
        })?;
        match answered(event)? {
            CameraEvent::Recorded {
                frames, dropped, ..
            } => Ok(Film {
                first_stamp_ns,
                frames,
                dropped,
                motion,
            }),
            other => bail!("the camera process answered a recording with {other:?}"),
        }
    }

    /// Streams the wiggle and films it.
    fn wiggle(&mut self, wiggle: &JointTrajectory) -> anyhow::Result<Film> {
        let stage = Stage::begin("wiggle");
        pipeline::arm_simulated(self.session, &self.arm, OperatingMode::Wiggle)?;
        let film = self.film(WIGGLE_FRAMES, wiggle, false, &stage)?;
        self.record.set_wiggle(film);
        self.record.stages.wiggle_s =
            stage.done(&format!("{} frames, {} dropped", film.frames, film.dropped));
        Ok(film)
    }

    /// Throws once, open loop, filmed.
    fn throw(&mut self, plan: &Plan) -> anyhow::Result<Film> {
        let stage = Stage::begin("throw");
        pipeline::arm_simulated(self.session, &self.arm, OperatingMode::Throw)?;
        // Empties the histograms, so that they hold this throw alone.
        pipeline::latency(self.session, &self.arm)?;
        let film = self.film(THROW_FRAMES, &plan.trajectory, true, &stage)?;
        self.record.set_throw(film);
        self.record.latency = Some(pipeline::latency(self.session, &self.arm)?);
        self.record.stages.throw_s =
            stage.done(&format!("{} frames, {} dropped", film.frames, film.dropped));
        Ok(film)
    }

    /// Measures the closest approach of tip and target by the camera. That it could not
    /// see the throw does not undo the throw; it is reported.
    fn score(&mut self, rig: &RigConfig) {
        let stage = Stage::begin("score");
        let colours = rig.appearance();
        let request = CameraRequest::Score {
            camera: Box::new(self.calibration.clone()),
            tip_rgb: colours.lead_rgb,
            target_rgb: colours.target_rgb,
            strobe: Some(self.folder.file("throw.png").display().to_string()),
        };
        let score = match self.ask_camera(&request, 60.0, &stage) {
            Ok(CameraEvent::Scored(score)) => Ok(score),
            Ok(other) => Err(anyhow!("the camera process answered with {other:?}")),
            Err(reason) => Err(reason),
        };
        self.record.stages.score_s = stage.done(&match &score {
            Ok(s) => format!("by camera {:.1} cm", 100.0 * s.closest_m),
            Err(_) => "the camera could not measure the throw".to_owned(),
        });
        self.record.set_score(score);
    }

    /// Only now the rig is asked what really happened.
    fn compare_with_truth(&mut self, throw: &Film) -> anyhow::Result<()> {
        let request = RigRequest::Truth {
            from_ns: throw.motion.start_ns,
            to_ns: throw.motion.end_ns + AFTER_THROW_NS,
        };
        let truth = self.session.ask(&self.rig, &request, 10.0, |_| ())?;
        self.record.set_truth(truth)
    }
}

/// An event of the camera that is no failure.
fn answered(event: CameraEvent) -> anyhow::Result<CameraEvent> {
    match event {
        CameraEvent::Failed { message } => bail!(message),
        event => Ok(event),
    }
}
