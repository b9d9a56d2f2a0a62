//! What a run makes of the film of the wiggle: the rope, a plan for it, and a move
//! that brings it to rest.

use super::stages::{Run, SETTLED_WITHIN_S, Setup};
use crate::command::known_rope::KnownRope;
use crate::command::plan::describe;
use anyhow::{Context, bail, ensure};
use arm_model::{JointTrajectory, JointVector};
use cli_output::Stage;
use planner::history::ArmHistory;
use planner::plan::{PlanOptions, PlanRequest, warnings};
use planner::service::{Declined, IdentifyRequest, PlannerEvent, PlannerRequest};
use planner::settle::SettleRequest;
use rt_controller::control::arming::THROW_WITHIN_NS;
use rt_controller::os::now_ns;
use run_log::{Film, Settled, Tracked, confirm, files};
use session::arm::{arm_for, execute};
use shared_types::ipc::message::{CameraEvent, CameraRequest, RopeAppearance};
use shared_types::rope_state::Sway;
use shared_types::{MonotonicNs, OperatingMode, Plan, RopeParams};
use std::time::Duration;

/// The joint that wiggles (0-based).
const WIGGLE_JOINT: usize = 5;
/// Joint reports this much before and after a film are given along (ns).
const JOINT_MARGIN_NS: u64 = 300_000_000;
/// Time allowed for an identification or a plan (s).
const PLANNING_S: f64 = 300.0;
/// Keypoints per frame.
const KEYPOINTS: u32 = 24;
/// Time allowed for planning before the settling move begins, and the longest after plans that
/// came too late, each twice as long (s). The swing decays meanwhile: to wait spoils nothing.
const UNASKED_S: [f64; 2] = [2.0, 32.0];
/// The same of a move that must begin soon after it was confirmed.
const ASKED_S: [f64; 2] = [2.0, 8.0];
/// Latest begin after it was confirmed (s), with half a second for the controller to hear of it.
pub(super) const CONFIRMED_S: f64 = THROW_WITHIN_NS as f64 * 1e-9 - 0.5;
/// How long the rope is watched for its stillness where somebody waits (s).
const WATCHED_S: f64 = 15.0;
/// What an operator confirms before it.
const SETTLES: &str =
    "The arm will move to the next start and damp the rope's swing, as fast as in a wiggle.";
/// Time after which the answer about a settling move is not waited for any longer (s).
const SETTLED_S: f64 = 60.0;
/// From the call to the first setpoint, on average (s): half a turn of the
/// controller's bridge and half a cycle.
const HANDOVER_S: f64 = 0.005;

/// The rope, and the film and the motion after which it swings; where the next one starts.
type Motions<'a> = (&'a RopeParams, &'a Film, &'a JointTrajectory, JointVector);

/// What came of an attempt to settle.
enum Attempt {
    Made(Settled),
    /// The plan was not there in time.
    Late,
    /// The operator did not let it begin at its instant.
    Unheld,
}

impl Run<'_> {
    /// Asks the planner; its last event, unless that is a failure.
    fn ask_planner(
        &mut self,
        request: &PlannerRequest,
        within_s: f64,
        stage: &Stage,
    ) -> anyhow::Result<PlannerEvent> {
        let event = self
            .session
            .ask(&self.planner, request, within_s, |event| {
                if let PlannerEvent::Progress(p) = event {
                    stage.progress(p);
                }
            })?;
        match event {
            PlannerEvent::Failed { message } => Err(Declined(message).into()),
            event => Ok(event),
        }
    }

    /// Measured joints around a film.
    fn film_joints(&mut self, film: &Film) -> anyhow::Result<Vec<(u64, JointVector)>> {
        self.session.received.drain()?;
        let end_ns = film.first_stamp_ns + u64::from(film.frames + film.dropped) * 16_800_000;
        let joints = self.session.received.cycles.joints_between(
            film.first_stamp_ns.saturating_sub(JOINT_MARGIN_NS),
            end_ns + JOINT_MARGIN_NS,
        );
        ensure!(
            joints.len() >= 50,
            "only {} joint reports came during the film; check the arm's report port",
            joints.len()
        );
        Ok(joints)
    }

    /// Tracks the rope through the film; keypoints go out over shared memory.
    pub fn track(&mut self, film: &Film) -> anyhow::Result<RopeAppearance> {
        let stage = Stage::begin("track");
        let overlay = self.folder.file("wiggle.png").display().to_string();
        let joints = self.film_joints(film)?;
        self.session.received.keypoints.clear();
        let request = CameraRequest::Track {
            camera: Box::new(self.setup.camera.clone()),
            joints,
            pole: self.setup.settings.cell.pole,
            keypoints: KEYPOINTS,
            overlay: Some(overlay.clone()),
        };
        let tracked = match self.ask_camera(&request, 60.0, &stage)? {
            CameraEvent::Tracked {
                lost_fraction,
                appearance,
                ms_per_frame,
                unconfirmed,
                ..
            } => Tracked {
                lost_fraction,
                appearance,
                ms_per_frame,
                unconfirmed,
            },
            other => bail!("the camera process answered with {other:?}"),
        };
        self.record.stages.track_s += stage.done(&format!(
            "{:.1} ms a frame, rope lost in {:.1} %",
            tracked.ms_per_frame,
            100.0 * tracked.lost_fraction
        ));
        let (unconfirmed, appearance) = (tracked.unconfirmed.clone(), tracked.appearance);
        self.record.track = Some(tracked);
        let look = format!("look at `{overlay}`");
        confirm(&unconfirmed, self.setup.accept_unconfirmed, &look)?;
        Ok(appearance)
    }

    /// Fits the rope's parameters to the published keypoints.
    pub fn identify(
        &mut self,
        film: &Film,
        appearance: RopeAppearance,
    ) -> anyhow::Result<KnownRope> {
        let settings = &self.setup.settings;
        let (options, pole) = (settings.identify, settings.cell.pole);
        if let Some(warning) = options.method.warning_of_pole(&pole) {
            self.warn(warning);
        }
        let stage = Stage::begin("identify");
        let request = PlannerRequest::Identify(Box::new(IdentifyRequest {
            first_stamp_ns: film.first_stamp_ns,
            frames: film.frames,
            camera: self.setup.camera.clone(),
            joints: self.film_joints(film)?,
            pole,
            appearance: appearance.into(),
            options,
        }));
        let rope = match self.ask_planner(&request, PLANNING_S, &stage)? {
            PlannerEvent::Identified(estimate) => *estimate,
            other => bail!("the planner process answered with {other:?}"),
        };
        let tracked = self.record.track.as_ref();
        let unconfirmed = tracked.map_or_else(Vec::new, |tracked| tracked.unconfirmed.clone());
        self.record.stages.identify_s += stage.done(&format!(
            "length {:.3} m, residual {:.2} px, clock offset {:+.1} ms, {} simulations",
            rope.params.length_m,
            rope.residual_px,
            1e3 * rope.time_offset_s,
            rope.simulations
        ));
        self.record.arm_lag_s = self.lag_s(film);
        let rope = KnownRope::identified(rope, unconfirmed);
        self.keep_rope(&rope)?;
        Ok(rope)
    }

    /// Keeps the rope in the run's folder.
    pub fn keep_rope(&mut self, rope: &KnownRope) -> anyhow::Result<()> {
        self.record.identified = rope.estimate().cloned();
        for warning in rope.estimate().map_or(&[][..], |rope| &rope.warnings) {
            self.warn(warning);
        }
        rope.keep(&self.folder.file(files::ROPE))
    }

    /// Plans the throw with what was identified, of a rope that hangs still or, where what the
    /// arm did `before` is told, swings.
    pub(super) fn plan(
        &mut self,
        rope: &KnownRope,
        before: Option<ArmHistory>,
    ) -> anyhow::Result<Plan> {
        let stage = Stage::begin("plan");
        let options = PlanOptions {
            seed: self.record.seed,
            ..self.setup.settings.search
        };
        let Setup {
            settings,
            limits,
            robust,
            ..
        } = &self.setup;
        let target_m = self.record.target_m.context("a throw needs a target")?;
        let goal = settings.goal(self.record.task, target_m);
        let request = PlannerRequest::Plan(Box::new(PlanRequest {
            limits: limits.clone(),
            cell: settings.cell,
            ensemble: rope.ensemble(*robust, options.seed)?,
            following: self.following.clone(),
            before,
            ..PlanRequest::new(goal, &rope.params, options)
        }));
        let mut plan = match self.ask_planner(&request, PLANNING_S, &stage)? {
            PlannerEvent::Planned(plan) => *plan,
            other => bail!("the planner process answered with {other:?}"),
        };
        plan.unconfirmed.clone_from(&rope.unconfirmed);
        self.record.stages.plan_s += stage.done(&describe(&plan));
        Ok(plan)
    }

    /// Plans a throw of a rope at rest, keeps it, and refuses it if it must not be sent.
    pub fn plan_from_rest(&mut self, rope: &KnownRope) -> anyhow::Result<Plan> {
        let plan = self.plan(rope, None)?;
        self.keep_plan(&plan)?;
        self.check_throw(&plan)?;
        Ok(plan)
    }

    /// Keeps a plan in the run's folder, and says what is poor about it.
    pub fn keep_plan(&mut self, plan: &Plan) -> anyhow::Result<()> {
        files::write_json(&self.folder.file(files::PLAN), plan)?;
        let csv = self.folder.file("plan.csv");
        files::write_trajectory(&csv, &plan.trajectory, self.setup.limits.period_s())?;
        for warning in warnings(plan) {
            self.warn(&warning);
        }
        self.record.set_plan(plan);
        Ok(())
    }

    /// How late the arm followed its setpoints while it wiggled (s).
    fn lag_s(&self, film: &Film) -> Option<f64> {
        let span = [film.motion.start_ns, film.motion.end_ns];
        let cycles = &self.session.received.cycles;
        cycles.joint_lag_s(WIGGLE_JOINT, span)
    }

    /// Moves to where the next motion starts so that the rope comes to rest: by a move planned with the
    /// identified rope and begun at the instant it was planned for. It is planned once the
    /// operator has confirmed it, and holds the control where there is one.
    pub fn settle(&mut self, motions: Motions<'_>, next: &str) -> anyhow::Result<()> {
        let asks = self.setup.asks;
        let [mut planning_s, longest_s] = if asks { ASKED_S } else { UNASKED_S };
        let (settled, stage) = loop {
            let confirmed = asks.then(|| self.session.confirm(SETTLES, "MOVE"));
            let confirmed = confirmed.transpose()?.map(MonotonicNs);
            self.session.await_control()?;
            // Its line would draw over the question.
            let stage = Stage::begin("settle");
            let begin = MonotonicNs(now_ns()).plus_s(planning_s);
            let made = self.settle_at((begin, confirmed), motions, &stage)?;
            self.session.end_hold();
            match made {
                Attempt::Made(settled) => break (settled, stage),
                Attempt::Unheld => self.warn("the control was not held soon after MOVE, or let go"),
                Attempt::Late if planning_s < longest_s => planning_s *= 2.0,
                Attempt::Late => bail!("planning takes too long here; stop other programs"),
            }
        };
        let within_s = if asks { WATCHED_S } else { SETTLED_WITHIN_S };
        if !self.wait_still(&stage, within_s)? && asks {
            self.warn(&format!(
                "the rope still moves a little: see that it hangs still before {next}"
            ));
        }
        self.record.settle = Some(settled);
        self.record.stages.settle_s += stage.done(&format!(
            "swing {:.1} cm -> {:.1} cm, as simulated",
            100.0 * settled.plain_residual_m,
            100.0 * settled.residual_m
        ));
        Ok(())
    }

    /// What the arm did since the wiggle's film began, where it stands in `start_q` until `start`.
    pub(super) fn history(
        &mut self,
        film: &Film,
        start_q: JointVector,
        start: MonotonicNs,
    ) -> anyhow::Result<ArmHistory> {
        self.session.received.drain()?;
        let cycles = &self.session.received.cycles;
        let joints = cycles.joints_between(film.first_stamp_ns, u64::MAX);
        // Within a period of the joints' reports of the first frame, at which the swing is told.
        let epoch = joints.first().map_or(start, |(ns, _)| MonotonicNs(*ns));
        let since_epoch = |(ns, q): &(u64, _)| (MonotonicNs(*ns).since_s(epoch), *q);
        let (times_s, q) = joints.iter().map(since_epoch).unzip();
        let told = self.record.identified.as_ref();
        Ok(ArmHistory {
            sway: told.map_or(Sway::NONE, |rope| rope.circumstances.sway),
            times_s,
            q,
            start_s: start.since_s(epoch),
            start_q,
        })
    }

    /// Waits, without a pause in what must be heard, until a motion is to be handed over that
    /// begins at `begin`; false if that is over.
    pub(super) fn wait_for(&mut self, begin: MonotonicNs) -> anyhow::Result<bool> {
        let left_s = || begin.since_s(MonotonicNs(now_ns())) - HANDOVER_S;
        if left_s() < 0.0 {
            return Ok(false);
        }
        let idle_s = (left_s() - 0.03).max(0.0);
        self.session.idle(Duration::from_secs_f64(idle_s))?;
        std::thread::sleep(Duration::from_secs_f64(left_s().max(0.0)));
        Ok(true)
    }

    /// Plans a settling move for the instant `begin` and makes it, if it may begin then.
    fn settle_at(
        &mut self,
        (begin, confirmed): (MonotonicNs, Option<MonotonicNs>),
        (rope, film, wiggle, end_q): Motions<'_>,
        stage: &Stage,
    ) -> anyhow::Result<Attempt> {
        if confirmed.is_some_and(|at| begin.since_s(at) > CONFIRMED_S) {
            return Ok(Attempt::Unheld);
        }
        let start = begin.plus_s(self.record.arm_lag_s.unwrap_or_default());
        let before = self.history(film, wiggle.end(), start)?;
        let request = PlannerRequest::Settle(Box::new(SettleRequest {
            rope: *rope,
            before,
            end_q,
            limits: self.setup.limits.clone(),
            cell: self.setup.settings.cell,
            config: self.setup.settings.settle.clone(),
        }));
        stage.say("planning");
        let found = match self.ask_planner(&request, SETTLED_S, stage)? {
            PlannerEvent::Settled(found) => found,
            other => bail!("the planner process answered with {other:?}"),
        };
        let swing_cm = 100.0 * found.plain_residual_m;
        stage.say(format!("damping {swing_cm:.1} cm of swing"));
        let mode = OperatingMode::Wiggle;
        self.check_motion(&found.trajectory, mode)?;
        // An arming lasts some seconds only, and where planning was quick there are many left.
        self.wait_for(begin.plus_s(-1.0))?;
        if begin.0 > now_ns() {
            let confirmed_ns = confirmed.map_or_else(now_ns, |at| at.0);
            arm_for(self.session, &self.arm, mode, Some(confirmed_ns))?;
        }
        if !self.wait_for(begin)? {
            return Ok(Attempt::Late);
        }
        if !self.session.is_held() {
            return Ok(Attempt::Unheld);
        }
        let span = execute(self.session, &self.arm, &found.trajectory)?;
        Ok(Attempt::Made(Settled {
            plain_residual_m: found.plain_residual_m,
            residual_m: found.residual_m,
            late_s: MonotonicNs(span.start_ns).since_s(begin),
        }))
    }
}
