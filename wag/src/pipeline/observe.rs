//! Filming a motion: the camera records while the arm streams.

use super::arm::{ArmLink, MotionSpan, execute};
use crate::session::Session;
use anyhow::{anyhow, bail};
use arm_model::JointTrajectory;
use cli_output::Stage;
use shared_types::ipc::message::{CameraEvent, CameraRequest, CameraRpc};
use shared_types::ipc::rpc::RpcClient;
use std::time::Duration;

/// A filmed motion.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Film {
    /// Start of exposure of the first frame (CLOCK_MONOTONIC, ns).
    pub first_stamp_ns: u64,
    /// Frames kept.
    pub frames: u32,
    /// Frames the camera dropped.
    pub dropped: u32,
    /// When the motion ran.
    #[serde(skip)]
    pub motion: MotionSpan,
}

/// What to film, and whether the motion goes on without the camera.
#[derive(Debug, Clone, Copy)]
pub struct Shot {
    /// Frames to keep.
    pub frames: u32,
    /// Keep the right eye too.
    pub both_eyes: bool,
    /// The motion is a throw: it is finished whatever becomes of the film. Others
    /// are made for the film's sake and braked when it is lost.
    pub throw: bool,
}

/// Records the frames of `shot`; as soon as the first is kept, streams
/// `trajectory`.
pub fn film_during(
    session: &mut Session,
    camera: &RpcClient<CameraRpc>,
    arm: &ArmLink,
    trajectory: &JointTrajectory,
    shot: Shot,
    stage: &Stage,
) -> anyhow::Result<Film> {
    let Shot {
        frames, both_eyes, ..
    } = shot;
    let recording = camera.call(&CameraRequest::Record { frames, both_eyes })?;
    let first_stamp_ns = match session.next(&recording, Duration::from_secs(5))? {
        CameraEvent::Recording { first_stamp_ns } => first_stamp_ns,
        CameraEvent::Failed { message } => bail!(message),
        other => bail!("the camera process answered a recording with {other:?}"),
    };
    let streaming = execute(arm, trajectory)?;
    let motion = if shot.throw {
        streaming.finish_committed(session)?
    } else {
        streaming.finish(session)?
    };
    let timeout = Duration::from_secs_f64(f64::from(frames) / 15.0 + 5.0);
    let event = session.finish(&recording, timeout, |event| {
        if let CameraEvent::Progress(p) = event {
            stage.progress(p);
        }
    })?;
    match event {
        CameraEvent::Recorded {
            frames, dropped, ..
        } => Ok(Film {
            first_stamp_ns,
            frames,
            dropped,
            motion,
        }),
        CameraEvent::Failed { message } => Err(anyhow!(message)),
        other => Err(anyhow!(
            "the camera process answered a recording with {other:?}"
        )),
    }
}
