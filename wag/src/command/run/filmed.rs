//! The two motions of a run that are filmed, and what the film of the throw tells.

use super::stages::{Run, UNNAMED_COLOURS, answered};
use crate::command::motion;
use anyhow::{Context, anyhow, bail, ensure};
use arm_model::JointTrajectory;
use camera_ingest::process::{RATE_HZ, at_another_rate};
use cli_output::Stage;
use planner::arm_response::Following;
use planner::plan::{Shortcoming, ThrowGoal, shortcoming};
use rt_controller::os::now_ns;
use run_log::{Film, files, require_same_target};
use session::Session;
use session::arm::{self, Refused, execute};
use shared_types::ipc::message::{CameraEvent, CameraRequest, RigEvent, RigRequest};
use shared_types::{MonotonicNs, OperatingMode, Plan, Task, Verdict};
use std::time::Duration;

/// Frames of a wiggle, of a fast one at most (paper: 400 at 60 Hz).
const WIGGLE_FRAMES: u32 = 400;
/// Frames of a strike: two and a half seconds.
const STRIKE_FRAMES: u32 = 150;
/// Time after the last setpoint that still belongs to a strike (s).
const AFTER_STRIKE_S: f64 = 0.6;
/// Time for putting a board or a wall in its place.
const PLACED_WITHIN: Duration = Duration::from_secs(900);
/// From the first frame of a film to the motion's begin, at most (s).
const BEFORE_THROW_S: f64 = 0.4;

impl Run<'_> {
    /// Records frames; as soon as the first is kept, streams `trajectory`. A throw is
    /// finished whatever becomes of the film, of both eyes. A wiggle is made for the film's
    /// sake, of which the left eye is enough, and is braked when the process that keeps it ends.
    /// Of what is to begin at an instant there is no film if that is over: nothing moved for it.
    fn film(
        &mut self,
        frames: u32,
        trajectory: &JointTrajectory,
        (throw, begin): (bool, Option<MonotonicNs>),
        stage: &Stage,
    ) -> anyhow::Result<Option<Film>> {
        let request = CameraRequest::Record {
            frames,
            both_images: throw || self.setup.keeps_films,
        };
        let recording = self.camera.call(&request)?;
        let first_stamp_ns = match answered(self.session.next(&recording, 5.0)?)? {
            CameraEvent::Recording { first_stamp_ns } => first_stamp_ns,
            other => bail!("the camera process answered a recording with {other:?}"),
        };
        let within_s = f64::from(frames) / 15.0 + 5.0;
        if let Some(begin) = begin
            && !(self.wait_for(begin)? && self.session.is_held())
        {
            self.session.finish(&recording, within_s, |_| ())?;
            stage.failed("its instant was over, or the control let go");
            return Ok(None);
        }
        let stream = |session: &mut Session| execute(session, &self.arm, trajectory);
        let streamed = if throw {
            self.session.committed(stream)
        } else {
            stream(self.session)
        };
        let motion = match streamed {
            Err(why) if begin.is_some() && Refused::is_late(&why) => {
                self.session.finish(&recording, within_s, |_| ())?;
                stage.failed(&format!("{why:#}"));
                return Ok(None);
            }
            streamed => streamed?,
        };
        let event = self.session.finish(&recording, within_s, |event| {
            if let CameraEvent::Progress(p) = event {
                stage.progress(p);
            }
        })?;
        if let Some(why) = at_another_rate(&event) {
            ensure!(throw, "{why}");
            self.warn(&why);
        }
        let [frames, dropped] = match answered(event) {
            Ok(CameraEvent::Recorded {
                frames, dropped, ..
            }) => [frames, dropped],
            Ok(other) => bail!("the camera process answered a recording with {other:?}"),
            Err(lost) if throw => {
                self.record.set_score(Err(lost));
                [0, 0]
            }
            Err(lost) => return Err(lost),
        };
        if 10 * dropped > frames + dropped {
            self.warn(&format!(
                "the camera dropped {dropped} frames: is the machine busy?"
            ));
        }
        Ok(Some(Film {
            first_stamp_ns,
            frames,
            dropped,
            motion,
        }))
    }

    /// Keeps the film whole, if films are kept. One that cannot be written undoes nothing.
    pub fn keep_film(&mut self, name: &str) -> anyhow::Result<()> {
        if !self.setup.keeps_films {
            return Ok(());
        }
        let stage = Stage::begin("keep film");
        let name = self.folder.file(name).display().to_string();
        let request = CameraRequest::Keep { name };
        let event = self.session.ask(&self.camera, &request, 600.0, |_| ())?;
        if let CameraEvent::Failed { message } = event {
            stage.failed("the film is not kept");
            self.warn(&message);
        } else {
            stage.done("both images of every frame are in the run's folder");
        }
        Ok(())
    }

    /// Streams the wiggle and films it.
    pub fn wiggle(&mut self, wiggle: &JointTrajectory) -> anyhow::Result<Film> {
        self.arm_for(OperatingMode::Wiggle)?;
        let stage = Stage::begin("wiggle");
        let mut frames = WIGGLE_FRAMES;
        if self.setup.short_wiggle.is_some() {
            frames = frames.min((f64::from(RATE_HZ) * wiggle.duration_s()) as u32);
        }
        let film = self.film(frames, wiggle, (false, None), &stage)?;
        let film = film.context("a wiggle begins at once")?;
        self.record.set_wiggle(film);
        self.record.stages.wiggle_s += stage.done(&film.describe());
        self.keep_film(files::WIGGLE_FILM)?;
        Ok(film)
    }

    /// Refuses a motion that would break a limit, or moves joints that were not measured.
    pub fn check_motion(
        &self,
        motion: &JointTrajectory,
        mode: OperatingMode,
    ) -> anyhow::Result<()> {
        let (address, limits) = (&self.setup.address, &self.setup.limits);
        let checked = motion::check(Some(address), limits, motion, mode);
        let measured = || motion::require_measured_joints(address, motion, mode);
        checked
            .and_then(|()| measured())
            .map_err(|why| anyhow!("{why}"))
    }

    /// Refuses a throw that would break a limit, or was planned for an arm that follows otherwise;
    /// on a simulated arm that is allowed.
    pub fn check_for_arm(&self, plan: &Plan) -> anyhow::Result<()> {
        self.check_motion(&plan.trajectory, OperatingMode::Throw)?;
        let address = &self.setup.address;
        let follows = self.following.as_ref().map(Following::source);
        if plan.arm_response.as_deref() != follows && !address.simulated {
            let named = |source: Option<&str>| source.unwrap_or("none").to_owned();
            bail!(
                "the throw was planned for an arm with the response of `{}`, this one follows as `{}` tells: plan it for this arm (--from plan)",
                named(plan.arm_response.as_deref()),
                named(follows)
            );
        }
        Ok(())
    }

    /// Refuses such a throw, and one that is predicted to miss, which a simulated arm may make.
    pub fn check_throw(&self, plan: &Plan) -> anyhow::Result<()> {
        self.check_for_arm(plan)?;
        let address = &self.setup.address;
        match shortcoming(plan) {
            Some(Shortcoming { message, is_severe }) if is_severe && !address.simulated => {
                let plan = self.folder.file(files::PLAN);
                bail!(
                    "{message}; nothing is thrown (`wag throw {}` would)",
                    plan.display()
                )
            }
            _ => Ok(()),
        }
    }

    /// Puts what the throw is for in its place, where a rig can, or tells a person to. A lob's
    /// board or a drape's wall would be in the wiggle's way before.
    pub(super) fn place(&mut self, target_m: [f64; 3]) -> anyhow::Result<()> {
        let task = self.record.task;
        if let Some(rig) = &self.setup.rig {
            let place = RigRequest::PlaceTarget { task, target_m };
            return match self.session.ask(rig, &place, 5.0, |_| ())? {
                RigEvent::Done => Ok(()),
                RigEvent::Failed { message } => bail!(message),
                other => bail!("the rig answered with {other:?}"),
            };
        }
        let ([x, y, z], cell) = (target_m, self.setup.settings.cell);
        let what = match task {
            Task::Strike => return Ok(()),
            Task::Lob => format!(
                "the board of {:?} m with the middle of its upper face, and on it the domino {} m before that,",
                cell.board.size_m, cell.domino.before_target_m
            ),
            Task::Drape => format!(
                "the wall of {:?} m with the middle of its upper edge",
                cell.wall.size_m
            ),
        };
        let told = format!(
            "The arm is enabled and stands at the throw's start. Put {what} at ({x:.3}, {y:.3}, {z:.3}) m, square to the line from the arm's base, without touching the rope, and leave the area."
        );
        self.session
            .confirm_within(&told, "PLACED", PLACED_WITHIN)?;
        let stage = Stage::begin("place");
        self.wait_or_warn(&stage)?;
        stage.done("what the throw is for stands in its place");
        Ok(())
    }

    /// Throws once, open loop, filmed.
    pub fn throw(&mut self, plan: &Plan) -> anyhow::Result<Film> {
        self.place(plan.target_m)?;
        self.arm_for(OperatingMode::Throw)?;
        let film = self.throw_armed(plan, None)?;
        film.context("this throw begins at once")
    }

    /// Throws with an arm that is armed for it, at an instant if one is named; no film if the
    /// controller or the operator's control did not let it begin then: nothing moved.
    pub(super) fn throw_armed(
        &mut self,
        plan: &Plan,
        begin: Option<MonotonicNs>,
    ) -> anyhow::Result<Option<Film>> {
        let stage = Stage::begin("throw");
        // Empties the histograms, so that they hold this throw alone.
        arm::latency(self.session, &self.arm)?;
        let frames = match self.goal().and_then(|goal| goal.rests_s()) {
            None => STRIKE_FRAMES,
            Some(rests_s) => {
                let lasts_s = BEFORE_THROW_S + plan.trajectory.duration_s() + rests_s;
                (f64::from(RATE_HZ) * lasts_s).ceil() as u32
            }
        };
        self.wait_for(begin.map_or(MonotonicNs(0), |begin| begin.plus_s(-BEFORE_THROW_S)))?;
        let Some(film) = self.film(frames, &plan.trajectory, (true, begin), &stage)? else {
            return Ok(None);
        };
        self.record.set_throw(film, begin);
        let started = MonotonicNs(film.motion.start_ns);
        let strikes = started.plus_s(plan.predicted_time_s);
        self.record.enabled_to_strike_s = Some(strikes.since_s(self.enabled));
        self.record.latency = Some(arm::latency(self.session, &self.arm)?);
        self.record.stages.throw_s = stage.done(&film.describe());
        Ok(Some(film))
    }

    /// The task's values, where the target is known.
    fn goal(&self) -> Option<ThrowGoal> {
        let target_m = self.record.target_m?;
        Some(self.setup.settings.goal(self.record.task, target_m))
    }

    /// Measures by the camera what the throw was for. That it could not
    /// see the throw does not undo the throw; it is reported.
    pub fn score(&mut self, throw: &Film, plan: &Plan) {
        let tracked = self.record.track.as_ref();
        let tracked = tracked.map(|track| track.appearance.lead_rgb);
        self.record.tip_rgb = self.record.tip_rgb.or(tracked);
        if self.record.task != Task::Strike {
            let stage = Stage::begin("score");
            let judged = self.judge(throw, plan, &stage);
            self.record.stages.score_s = match &judged {
                Ok(verdict) => stage.done(&format!("by camera: {verdict}")),
                Err(_) => stage.failed("the camera could not judge the throw"),
            };
            match judged {
                Ok(verdict) => self.record.camera_verdict = Some(verdict),
                Err(why) => self.record.set_score(Err(why)),
            }
            return;
        }
        let Some((tip_rgb, target_rgb)) = self.record.tip_rgb.zip(self.record.target_rgb) else {
            return self.record.set_score(Err(anyhow!(UNNAMED_COLOURS)));
        };
        let stage = Stage::begin("score");
        let request = CameraRequest::Score {
            camera: Box::new(self.setup.camera.clone()),
            tip_rgb,
            target_rgb,
            strobe: Some(self.folder.file("throw.png").display().to_string()),
        };
        let score = match self.ask_camera(&request, 60.0, &stage) {
            Ok(CameraEvent::Scored(score)) => {
                require_same_target(score.target_m, plan.target_m).map(|()| score)
            }
            Ok(other) => Err(anyhow!("the camera process answered with {other:?}")),
            Err(reason) => Err(reason),
        };
        self.record.stages.score_s = match &score {
            Ok(s) => stage.done(&format!("by camera {:.1} cm", 100.0 * s.closest_m)),
            Err(_) => stage.failed("the camera could not measure the throw"),
        };
        self.record.set_score(score);
    }

    /// Judges a lob or drape by what the camera sees of tip and domino.
    fn judge(&mut self, throw: &Film, plan: &Plan, stage: &Stage) -> anyhow::Result<Verdict> {
        let goal = self.goal().context("a throw needs a target")?;
        let cell = self.setup.settings.cell;
        let request = CameraRequest::Look {
            camera: Box::new(self.setup.camera.clone()),
            tip_rgb: self
                .record
                .tip_rgb
                .context("name the colour of the tip with --tip-rgb")?,
            domino: self
                .record
                .target_rgb
                .and_then(|rgb| goal.domino_look(&cell, rgb)),
            span_ns: goal.span_ns(&plan.trajectory, throw.motion.start_ns),
            strobe: Some(self.folder.file("throw.png").display().to_string()),
        };
        match self.ask_camera(&request, 60.0, stage)? {
            CameraEvent::Seen(seen) => goal
                .judge_film((&plan.trajectory, &plan.rope), &cell, &seen)
                .map_err(anyhow::Error::msg),
            other => bail!("the camera process answered with {other:?}"),
        }
    }

    /// Only now a rig is asked what really happened.
    pub fn compare_with_truth(&mut self, throw: &Film, plan: &Plan) -> anyhow::Result<()> {
        if self.setup.rig.is_none() {
            return Ok(());
        }
        let goal = self.goal();
        let rests_s = goal.as_ref().and_then(ThrowGoal::rests_s);
        let after_s = rests_s.unwrap_or(AFTER_STRIKE_S);
        let to = MonotonicNs(throw.motion.end_ns).plus_s(after_s);
        let request = RigRequest::Truth {
            from_ns: throw.motion.start_ns,
            to_ns: to.0,
        };
        // Where the film was lost, what is asked for may not be over.
        let left_s = to.since_s(MonotonicNs(now_ns())).max(0.0);
        self.session.idle(Duration::from_secs_f64(left_s))?;
        let Some(rig) = &self.setup.rig else {
            return Ok(());
        };
        let truth = self.session.ask(rig, &request, 10.0, |_| ())?;
        if let (RigEvent::Truth { rope, seen, .. }, Some(goal), Some(_)) = (&truth, goal, rests_s) {
            let cell = &self.setup.settings.cell;
            let judged = goal
                .judge((&plan.trajectory, rope), cell, seen)
                .map_err(anyhow::Error::msg)?;
            self.record.set_truth(truth)?;
            self.record.true_verdict = Some(judged.verdict);
            self.record.true_tip_target_distance_m = judged.error_m;
            return Ok(());
        }
        self.record.set_truth(truth)
    }
}
