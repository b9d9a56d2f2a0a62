//! The stages of a run from wiggle to throw: each hands the next what it found.

use crate::command::area::response_for_plans;
use crate::command::known_rope::KnownRope;
use crate::command::motion;
use crate::command::on_arm::{AT_START, enable, set_up_move};
use crate::pipeline::{self, ArmAddress, FramesFrom, RunFolder};
use anyhow::{Context, anyhow, bail};
use arm_model::{JointTrajectory, Limits};
use camera_ingest::calib::keep_calibration;
use cli_output::{Stage, output};
use planner::PlannerConfig;
use planner::arm_response::Following;
use planner::service::{PlannerRequest, PlannerRpc};
use planner::wiggle::{WiggleConfig, wiggle};
use rt_controller::os::now_ns;
use rt_controller::point_to_point::fraction_that_lasts;
use run_log::{Film, RunRecord, files};
use session::Session;
use session::arm::{self, ArmLink, BringUp};
use shared_types::ipc::message::{CameraEvent, CameraRequest, CameraRpc, RigRpc, RopeAppearance};
use shared_types::ipc::rpc::RpcClient;
use shared_types::{
    MonotonicNs, OperatingMode, Plan, RopeEstimate, RopeParams, StereoCamera, Task,
};
use std::time::{Duration, Instant};

/// Speed of moves between poses, as a part of the fastest move.
///
/// Slow enough that the move lasts several periods of the rope's pendulum and
/// leaves it with millimetres of swing.
const MOVE_SPEED: f64 = 0.04;
/// How long it lasts instead where a run is to be fast (s): two periods of the slowest pendulum of
/// the ranges, 0.6 Hz, which a jerk-limited move leaves with a fiftieth of its way.
const FAST_MOVE_S: f64 = 3.5;
/// Longest wait for the rope to hang still after a move that was planned to bring it to rest (s).
pub(super) const SETTLED_WITHIN_S: f64 = 3.0;
/// The same after any other move, where the swing of whatever was before decays by itself (s).
const DECAYED_WITHIN_S: f64 = 180.0;
/// Longest wait for the rope after which a confirmed move is not confirmed again.
const MOVE_FRESH: Duration = Duration::from_secs(10);
/// What to do where the colours to look for are not known.
pub const UNNAMED_COLOURS: &str = "name the colour of the target with --target-rgb, and without a wiggle the tip's with --tip-rgb";
/// How often the camera is asked for frames before the arm is enabled.
const LOOKS: usize = 4;

/// Where a run begins.
#[derive(Debug)]
pub enum Entry {
    /// With the wiggle, and that is all.
    WiggleAlone,
    Wiggle,
    /// The rope is known.
    Rope(Box<KnownRope>),
    /// So is the throw.
    Plan(Box<Plan>),
}

/// What a run is to do, and with what.
#[derive(Debug)]
pub struct Setup {
    pub settings: PlannerConfig,
    pub limits: Limits,
    pub address: ArmAddress,
    /// Whether the operator must confirm each motion.
    pub asks: bool,
    /// Whether the operator knows why the arm was stopped before.
    pub acknowledges: bool,
    pub frames: FramesFrom,
    pub camera: StereoCamera,
    pub rig: Option<RpcClient<RigRpc>>,
    pub accept_unconfirmed: bool,
    /// Ropes that a plan weighs beside the likeliest.
    pub robust: usize,
    /// Whether the films are kept whole, both images.
    pub keeps_films: bool,
    /// The wiggle of a run that is to be fast: the throw is made out of the swing that it leaves.
    pub short_wiggle: Option<WiggleConfig>,
}

/// The running processes and what all stages need.
pub struct Run<'a> {
    pub(super) folder: &'a RunFolder,
    pub(super) session: &'a mut Session,
    pub(super) record: &'a mut RunRecord,
    pub(super) setup: Setup,
    pub(super) following: Option<Following>,
    pub(super) camera: RpcClient<CameraRpc>,
    pub(super) planner: RpcClient<PlannerRpc>,
    pub(super) arm: ArmLink,
    /// When the arm was enabled.
    pub(super) enabled: MonotonicNs,
}

impl<'a> Run<'a> {
    /// Starts what does not run yet, the controller last, and makes sure that the camera sees.
    pub fn start(
        folder: &'a RunFolder,
        session: &'a mut Session,
        record: &'a mut RunRecord,
        setup: Setup,
        stage: &Stage,
    ) -> anyhow::Result<Self> {
        let Setup { limits, .. } = &setup;
        keep_calibration(&folder.file(files::CAMERA), &setup.camera)?;
        let camera = Some(&setup.camera);
        pipeline::start_recorder(session, folder, limits, camera, record.target_m)?;
        let camera = pipeline::start_camera(session, folder, &setup.frames)?;
        let ping = PlannerRequest::Ping;
        let planner = match session.find(&ping)? {
            Some(running) => running,
            None => {
                let config = PlannerConfig {
                    domain: folder.domain.clone(),
                    ..setup.settings.clone()
                };
                pipeline::start(session, folder, "planner", &config, &ping)?
            }
        };
        let arm = pipeline::controller(session, folder, limits, &setup.address)?;
        let response = response_for_plans(&setup.address).map_err(|why| anyhow!("{why}"))?;
        let following = response.map(|response| Following::new(&response, limits));
        let mut run = Self {
            folder,
            session,
            record,
            setup,
            following,
            camera,
            planner,
            arm,
            enabled: MonotonicNs(0),
        };
        run.look(stage)?;
        let unseen = match run.record.task {
            Task::Strike => Some("the throw will not be measured"),
            Task::Lob => Some("whether the domino falls will not be seen"),
            Task::Drape => None,
        };
        let unseen = unseen.filter(|_| run.record.target_m.is_some());
        if let Some(unseen) = unseen.filter(|_| run.record.target_rgb.is_none()) {
            run.warn(&format!("{unseen}: {UNNAMED_COLOURS}"));
        }
        run.record.stages.start_s = stage.done("controller, camera and planner are up");
        Ok(run)
    }

    /// A camera that sends nothing is known before the arm is enabled.
    fn look(&mut self, stage: &Stage) -> anyhow::Result<()> {
        let request = CameraRequest::WaitStill { timeout_s: 0.0 };
        let mut seen = self.ask_camera(&request, 5.0, stage);
        for _ in 1..LOOKS {
            if seen.is_ok() {
                break;
            }
            seen = self.ask_camera(&request, 5.0, stage);
        }
        let camera = &self.setup.camera;
        let calibrated = [camera.width_px, camera.height_px];
        match seen? {
            CameraEvent::Still { size_px, .. } if size_px == calibrated => Ok(()),
            CameraEvent::Still { size_px, .. } => bail!(
                "the camera sends images of {size_px:?} pixels, but its calibration is for {calibrated:?}"
            ),
            other => bail!("the camera process answered with {other:?}"),
        }
    }

    /// From the entry to its end: that of the throw, but for a wiggle alone.
    pub fn go(&mut self, from: Entry) -> anyhow::Result<()> {
        let (plan, thrown) = match from {
            Entry::WiggleAlone => {
                self.tracked()?;
                self.record.ok = true;
                return Ok(());
            }
            Entry::Plan(plan) => {
                self.keep_plan(&plan)?;
                self.check_throw(&plan)?;
                self.bring_up(&plan.trajectory)?;
                (*plan, None)
            }
            Entry::Rope(rope) => {
                self.keep_rope(&rope)?;
                let plan = self.plan_from_rest(&rope)?;
                // What was confirmed before may be minutes old.
                let what = "The arm will be enabled and move to the throw's start.";
                let asked = self.setup.asks.then(|| self.session.confirm(what, "MOVE"));
                asked.transpose()?;
                self.bring_up(&plan.trajectory)?;
                (plan, None)
            }
            Entry::Wiggle => {
                let (mut motion, mut film, appearance) = self.tracked()?;
                let told = self.record.warnings.len();
                let mut rope = self.identify(&film, appearance)?;
                let fits = rope.estimate().is_none_or(RopeEstimate::is_reliable);
                if self.setup.short_wiggle.is_some() && !fits {
                    let why = self.record.warnings.drain(told..).next();
                    self.warn(&format!(
                        "wiggled again, at length, and calmed before the throw, because the short film is not relied on: {}",
                        why.unwrap_or_default()
                    ));
                    let appearance;
                    (motion, film, appearance) =
                        self.tracked_at_length((&rope.params, &film, &motion))?;
                    rope = self.identify(&film, appearance)?;
                }
                if let Some((plan, throw)) = self.throw_out_of_swing(&rope, &film, &motion)? {
                    (plan, Some(throw))
                } else {
                    let plan = self.plan_from_rest(&rope)?;
                    let start_q = plan.trajectory.start();
                    self.settle((&rope.params, &film, &motion, start_q), "THROW")?;
                    (plan, None)
                }
            }
        };
        let throw = thrown.map_or_else(|| self.throw(&plan), Ok)?;
        if throw.frames > 0 {
            self.score(&throw, &plan);
        }
        self.compare_with_truth(&throw, &plan)?;
        if throw.frames > 0 {
            self.keep_film(files::THROW_FILM)?;
        }
        self.record.ok = true;
        Ok(())
    }

    /// Wiggles, films and tracks: motion, film, sizes of rope and lead.
    fn tracked(&mut self) -> anyhow::Result<(JointTrajectory, Film, RopeAppearance)> {
        let Setup {
            settings, limits, ..
        } = &self.setup;
        let config = self.setup.short_wiggle.as_ref().unwrap_or(&settings.wiggle);
        let motion = wiggle(config, limits)?;
        self.bring_up(&motion)?;
        self.tracked_from_start(motion)
    }

    /// The same with the usual wiggle, after a `short` one that did not tell the `rope` well, but
    /// well enough to damp its swing.
    fn tracked_at_length(
        &mut self,
        (rope, film, short): (&RopeParams, &Film, &JointTrajectory),
    ) -> anyhow::Result<(JointTrajectory, Film, RopeAppearance)> {
        self.setup.short_wiggle = None;
        // Nothing goes on with it where the longer wiggle fails.
        self.record.identified = None;
        std::fs::remove_file(self.folder.file(files::ROPE))?;
        let motion = wiggle(&self.setup.settings.wiggle, &self.setup.limits)?;
        self.check_motion(&motion, OperatingMode::Wiggle)?;
        self.settle((rope, film, short, motion.start()), "WIGGLE")?;
        // The rope is another one than that was planned with, so that it still swings.
        let stage = Stage::begin("stillness");
        let is_still = self.wait_or_warn(&stage)?;
        self.record.stages.settle_s += stage.done(swings(is_still));
        self.tracked_from_start(motion)
    }

    fn tracked_from_start(
        &mut self,
        motion: JointTrajectory,
    ) -> anyhow::Result<(JointTrajectory, Film, RopeAppearance)> {
        let film = self.wiggle(&motion)?;
        let appearance = self.track(&film)?;
        Ok((motion, film, appearance))
    }

    /// Tells a person once, and keeps it in the summary.
    pub(super) fn warn(&mut self, warning: &str) {
        if self.record.warnings.iter().all(|told| told != warning) {
            output::remark(format_args!("warning: {warning}"));
            self.record.warnings.push(warning.to_owned());
        }
    }

    /// Asks the camera; its last event, unless that is a failure.
    pub(super) fn ask_camera(
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
    pub(super) fn wait_still(&mut self, stage: &Stage, timeout_s: f64) -> anyhow::Result<bool> {
        stage.say("waiting for the rope to hang still");
        let request = CameraRequest::WaitStill { timeout_s };
        match self.ask_camera(&request, timeout_s + 5.0, stage)? {
            CameraEvent::Still { still, .. } => Ok(still),
            other => bail!("the camera process answered with {other:?}"),
        }
    }

    /// Arms for a wiggle or a throw, which the operator confirms where somebody must.
    pub(super) fn arm_for(&mut self, operating_mode: OperatingMode) -> anyhow::Result<()> {
        let word = motion::words(operating_mode).1;
        let asked = self.setup.asks.then_some((AT_START, word));
        let confirmed_ns = self.session.confirm_and_hold(asked)?;
        arm::arm_for(self.session, &self.arm, operating_mode, Some(confirmed_ns))
    }

    /// Enables the arm, moves to the start pose, waits for the rope.
    fn bring_up(&mut self, motion: &JointTrajectory) -> anyhow::Result<()> {
        if self.setup.short_wiggle.is_some() {
            self.await_stillness()?;
        }
        let stage = Stage::begin("bring-up");
        let mut found = BringUp::default();
        let of = (&self.setup.address, self.setup.acknowledges);
        let enabled = enable(self.session, &self.arm, of, &mut found);
        self.record.bring_up = found.steps_json();
        self.record.warnings.extend(found.warnings);
        enabled?;
        self.enabled = MonotonicNs(now_ns());
        self.move_to_start(motion)?;
        if self.setup.short_wiggle.is_none() {
            self.wait_or_warn(&stage)?;
        }
        let confirmation = if self.setup.address.simulated && !self.setup.asks {
            " (simulated: no confirmation needed)"
        } else {
            ""
        };
        let done = format!("arm enabled{confirmation}, it stands at the start");
        self.record.stages.bringup_s += stage.done(&done);
        Ok(())
    }

    /// Waits for the rope before the arm is enabled. What was confirmed before a long wait is
    /// confirmed again.
    fn await_stillness(&mut self) -> anyhow::Result<()> {
        loop {
            let began = Instant::now();
            let stage = Stage::begin("stillness");
            let is_still = self.wait_or_warn(&stage)?;
            self.record.stages.bringup_s += stage.done(swings(is_still));
            if !self.setup.asks || began.elapsed() < MOVE_FRESH {
                return Ok(());
            }
            let what = "The arm will be enabled and move to the wiggle's start.";
            self.session.confirm(what, "MOVE")?;
        }
    }

    /// Moves to the start of `motion` at set-up speed. Where the run is to be fast the rope hung
    /// still before, and the move leaves it so.
    fn move_to_start(&mut self, motion: &JointTrajectory) -> anyhow::Result<()> {
        let mut speed = MOVE_SPEED;
        if self.setup.short_wiggle.is_some() {
            self.session.received.drain()?;
            let now = self.session.received.cycles.joints_between(0, u64::MAX);
            let (_, from) = now.last().context("the arm does not report its joints")?;
            speed = fraction_that_lasts(from, &motion.start(), FAST_MOVE_S, &self.setup.limits)?;
        }
        set_up_move(self.session, &self.arm, motion.start(), speed)
    }

    /// Waits until the rope hangs still, or its swing has had time to decay; whether it does.
    pub(super) fn wait_or_warn(&mut self, stage: &Stage) -> anyhow::Result<bool> {
        let is_still = self.wait_still(stage, DECAYED_WITHIN_S)?;
        if !is_still {
            self.warn(&format!(
                "the rope still swings after {DECAYED_WITHIN_S} s, and what follows takes it to hang still"
            ));
        }
        Ok(is_still)
    }
}

const fn swings(is_still: bool) -> &'static str {
    if is_still {
        "the rope hangs still"
    } else {
        "the rope still swings"
    }
}

/// An event of the camera that is no failure.
pub(super) fn answered(event: CameraEvent) -> anyhow::Result<CameraEvent> {
    match event {
        CameraEvent::Failed { message } => bail!(message),
        event => Ok(event),
    }
}
