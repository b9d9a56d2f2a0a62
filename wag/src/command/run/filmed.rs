//! The two motions of a run that are filmed, and what the film of the throw tells.

use super::stages::{Run, UNNAMED_COLOURS, answered};
use super::summary;
use crate::command::motion;
use crate::pipeline::{self, execute};
use anyhow::{anyhow, bail};
use arm_model::JointTrajectory;
use cli_output::{Failure, Stage};
use planner::arm_response::Following;
use planner::plan::{Shortcoming, shortcoming};
use run_log::{Film, files};
use session::Session;
use shared_types::ipc::message::{CameraEvent, CameraRequest, RigRequest};
use shared_types::{OperatingMode, Plan};

/// Frames of a wiggle (paper: 400 at 60 Hz).
const WIGGLE_FRAMES: u32 = 400;
/// Frames of a throw: two and a half seconds.
const THROW_FRAMES: u32 = 150;
/// Time after the last setpoint that still belongs to the throw (ns).
const AFTER_THROW_NS: u64 = 600_000_000;

impl Run<'_> {
    /// Records frames; as soon as the first is kept, streams `trajectory`. A throw is
    /// finished whatever becomes of the film, of both eyes. A wiggle is made for the film's
    /// sake, which needs the left eye only, and is braked when the process that keeps it ends.
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
        let [frames, dropped] = match answered(event) {
            Ok(CameraEvent::Recorded {
                frames, dropped, ..
            }) => [frames, dropped],
            Ok(other) => bail!("the camera process answered a recording with {other:?}"),
            // What was thrown was thrown.
            Err(lost) if throw => {
                self.record.set_score(Err(lost));
                [0, 0]
            }
            Err(lost) => return Err(lost),
        };
        Ok(Film {
            first_stamp_ns,
            frames,
            dropped,
            motion,
        })
    }

    /// Streams the wiggle and films it.
    pub fn wiggle(&mut self, wiggle: &JointTrajectory) -> anyhow::Result<Film> {
        self.arm_for(OperatingMode::Wiggle)?;
        let stage = Stage::begin("wiggle");
        let film = self.film(WIGGLE_FRAMES, wiggle, false, &stage)?;
        self.record.set_wiggle(film);
        self.record.stages.wiggle_s = stage.done(&summary::of_film(&film));
        Ok(film)
    }

    /// Refuses a throw that must not be sent, or that would not do what it is for: one planned for
    /// an arm that follows otherwise, or that is predicted to miss; on a simulated arm both are
    /// allowed.
    pub fn check_throw(&self, plan: &Plan) -> anyhow::Result<()> {
        let (trajectory, address) = (&plan.trajectory, &self.setup.address);
        let refused = |failure: Failure| anyhow!("{failure}");
        motion::check(
            Some(address),
            &self.setup.limits,
            trajectory,
            OperatingMode::Throw,
        )
        .map_err(refused)?;
        motion::require_measured_joints(address, trajectory, OperatingMode::Throw)
            .map_err(refused)?;
        let follows = self.following.as_ref().map(Following::source);
        if plan.arm_response.as_deref() != follows && !address.simulated {
            let named = |source: Option<&str>| source.unwrap_or("none").to_owned();
            bail!(
                "the throw was planned for an arm with the response of `{}`, this one follows as `{}` tells: plan it for this arm (--from plan)",
                named(plan.arm_response.as_deref()),
                named(follows)
            );
        }
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

    /// Throws once, open loop, filmed.
    pub fn throw(&mut self, plan: &Plan) -> anyhow::Result<Film> {
        self.arm_for(OperatingMode::Throw)?;
        let stage = Stage::begin("throw");
        // Empties the histograms, so that they hold this throw alone.
        pipeline::latency(self.session, &self.arm)?;
        let film = self.film(THROW_FRAMES, &plan.trajectory, true, &stage)?;
        self.record.set_throw(film);
        self.record.latency = Some(pipeline::latency(self.session, &self.arm)?);
        self.record.stages.throw_s = stage.done(&summary::of_film(&film));
        Ok(film)
    }

    /// Measures the closest approach of tip and target by the camera. That it could not
    /// see the throw does not undo the throw; it is reported.
    pub fn score(&mut self) {
        let tracked = self.record.track.as_ref();
        let tracked = tracked.map(|track| track.appearance.lead_rgb);
        self.record.tip_rgb = self.record.tip_rgb.or(tracked);
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

    /// Only now a rig is asked what really happened.
    pub fn compare_with_truth(&mut self, throw: &Film) -> anyhow::Result<()> {
        let Some(rig) = &self.setup.rig else {
            return Ok(());
        };
        let request = RigRequest::Truth {
            from_ns: throw.motion.start_ns,
            to_ns: throw.motion.end_ns + AFTER_THROW_NS,
        };
        let truth = self.session.ask(rig, &request, 10.0, |_| ())?;
        self.record.set_truth(truth)
    }
}
