//! Asking camera and planner: stillness, tracking, identification, planning,
//! scoring.

use super::observe::Film;
use crate::session::Session;
use anyhow::{anyhow, bail};
use arm_model::Pole;
use cli_output::Stage;
use planner::PlannerConfig;
use planner::plan::PlanRequest;
use planner::service::{IdentifyRequest, PlannerEvent, PlannerRequest, PlannerRpc};
use shared_types::ipc::message::{
    CameraEvent, CameraRequest, CameraRpc, RopeAppearance, ScoreResult,
};
use shared_types::ipc::rpc::RpcClient;
use shared_types::{Plan, RopeEstimate, StereoCamera};
use std::path::Path;
use std::time::Duration;

/// Joint reports this much before and after a film are given along (s).
const JOINT_MARGIN_NS: u64 = 300_000_000;
/// Time allowed for an identification or a plan (s).
const PLANNING_S: f64 = 300.0;
/// Keypoints per frame.
pub const KEYPOINTS: u32 = 24;

type Camera = RpcClient<CameraRpc>;
type Planner = RpcClient<PlannerRpc>;

/// Asks the camera; its last event, unless that is a failure.
fn ask_camera(
    session: &mut Session,
    camera: &Camera,
    request: &CameraRequest,
    timeout_s: f64,
    stage: Option<&Stage>,
) -> anyhow::Result<CameraEvent> {
    let timeout = Duration::from_secs_f64(timeout_s);
    let event = session.ask(camera, request, timeout, |event| {
        if let (CameraEvent::Progress(p), Some(stage)) = (event, stage) {
            stage.progress(p);
        }
    })?;
    match event {
        CameraEvent::Failed { message } => bail!(message),
        event => Ok(event),
    }
}

/// Asks the planner; its last event, unless that is a failure.
pub(super) fn ask_planner(
    session: &mut Session,
    planner: &Planner,
    request: &PlannerRequest,
    timeout_s: f64,
    stage: &Stage,
) -> anyhow::Result<PlannerEvent> {
    let timeout = Duration::from_secs_f64(timeout_s);
    let event = session.ask(planner, request, timeout, |event| {
        if let PlannerEvent::Progress(p) = event {
            stage.progress(p);
        }
    })?;
    match event {
        PlannerEvent::Failed { message } => bail!(message),
        event => Ok(event),
    }
}

/// An answer to another question.
pub(super) fn unexpected(process: &str, event: &impl std::fmt::Debug) -> anyhow::Error {
    anyhow!("the {process} process answered with {event:?}")
}

/// Waits until nothing moves in the picture, at most `timeout_s`.
pub fn wait_still(session: &mut Session, camera: &Camera, timeout_s: f64) -> anyhow::Result<bool> {
    let request = CameraRequest::WaitStill { timeout_s };
    match ask_camera(session, camera, &request, timeout_s + 5.0, None)? {
        CameraEvent::Still { still } => Ok(still),
        other => Err(unexpected("camera", &other)),
    }
}

/// What tracking found.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Tracked {
    /// Part of the frames in which the rope was lost (0 to 1).
    pub lost_fraction: f64,
    /// Sizes of rope and lead.
    #[serde(flatten)]
    pub appearance: RopeAppearance,
    /// Processing time per frame (ms).
    pub ms_per_frame: f64,
    /// Why the track should not be relied on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
}

/// Tracks the rope through the film; keypoints go out over shared memory.
pub fn track(
    session: &mut Session,
    camera: &Camera,
    calibration: &StereoCamera,
    film: &Film,
    pole: Pole,
    overlay: &Path,
    stage: &Stage,
) -> anyhow::Result<Tracked> {
    let joints = film_joints(session, film)?;
    session.received.keypoints.clear();
    let request = CameraRequest::Track {
        camera: Box::new(calibration.clone()),
        joints,
        pole,
        keypoints: KEYPOINTS,
        overlay: Some(overlay.display().to_string()),
    };
    match ask_camera(session, camera, &request, 60.0, Some(stage))? {
        CameraEvent::Tracked {
            lost_fraction,
            appearance,
            ms_per_frame,
            doubts,
            ..
        } => Ok(Tracked {
            lost_fraction,
            appearance,
            ms_per_frame,
            doubts,
        }),
        other => Err(unexpected("camera", &other)),
    }
}

/// Measured joints around a film.
fn film_joints(
    session: &mut Session,
    film: &Film,
) -> anyhow::Result<Vec<(u64, arm_model::JointVector)>> {
    session.received.drain()?;
    let end_ns = film.first_stamp_ns + u64::from(film.frames + film.dropped) * 16_800_000;
    let joints = session.received.cycles.joints_between(
        film.first_stamp_ns.saturating_sub(JOINT_MARGIN_NS),
        end_ns + JOINT_MARGIN_NS,
    );
    if joints.len() < 50 {
        bail!(
            "only {} joint reports came during the film; check the arm's report port",
            joints.len()
        );
    }
    Ok(joints)
}

/// Fits the rope parameters to the published keypoints.
pub fn identify(
    session: &mut Session,
    planner: &Planner,
    calibration: &StereoCamera,
    film: &Film,
    appearance: RopeAppearance,
    settings: &PlannerConfig,
    stage: &Stage,
) -> anyhow::Result<RopeEstimate> {
    let request = PlannerRequest::Identify(Box::new(IdentifyRequest {
        first_stamp_ns: film.first_stamp_ns,
        frames: film.frames,
        camera: calibration.clone(),
        joints: film_joints(session, film)?,
        pole: settings.cell.pole,
        appearance: appearance.into(),
        options: settings.identify,
    }));
    match ask_planner(session, planner, &request, PLANNING_S, stage)? {
        PlannerEvent::Identified(estimate) => Ok(*estimate),
        other => Err(unexpected("planner", &other)),
    }
}

/// Plans a throw.
pub fn plan(
    session: &mut Session,
    planner: &Planner,
    request: PlanRequest,
    stage: &Stage,
) -> anyhow::Result<Plan> {
    let request = PlannerRequest::Plan(Box::new(request));
    match ask_planner(session, planner, &request, PLANNING_S, stage)? {
        PlannerEvent::Planned(plan) => Ok(*plan),
        other => Err(unexpected("planner", &other)),
    }
}

/// Measures the closest approach of tip and target in the filmed throw.
pub fn score(
    session: &mut Session,
    camera: &Camera,
    calibration: &StereoCamera,
    tip_rgb: [u8; 3],
    target_rgb: [u8; 3],
    strobe: &Path,
) -> anyhow::Result<ScoreResult> {
    let request = CameraRequest::Score {
        camera: Box::new(calibration.clone()),
        tip_rgb,
        target_rgb,
        strobe: Some(strobe.display().to_string()),
    };
    match ask_camera(session, camera, &request, 60.0, None)? {
        CameraEvent::Scored(result) => Ok(result),
        other => Err(unexpected("camera", &other)),
    }
}
