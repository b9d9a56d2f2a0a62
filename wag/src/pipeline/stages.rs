//! Asking camera and planner: stillness, tracking, identification, planning,
//! scoring.

use super::observe::Film;
use crate::session::Session;
use anyhow::{anyhow, bail};
use cli_output::Stage;
use shared_types::ipc::message::{
    CameraEvent, CameraRequest, CameraRpc, IdentifyRequest, PlannerEvent, PlannerRequest,
    PlannerRpc, RopeAppearance, ScoreResult, StrikeOrder,
};
use shared_types::ipc::rpc::RpcClient;
use shared_types::{Plan, RopeEstimate, StereoCamera};
use std::path::Path;
use std::time::Duration;

/// Joint reports this much before and after a film are given along (s).
const JOINT_MARGIN_NS: u64 = 300_000_000;
/// Keypoints per frame.
pub const KEYPOINTS: u32 = 24;

type Camera = RpcClient<CameraRpc>;
type Planner = RpcClient<PlannerRpc>;

fn camera_error(event: CameraEvent) -> anyhow::Error {
    match event {
        CameraEvent::Failed { message } => anyhow!(message),
        other => anyhow!("the camera process answered with {other:?}"),
    }
}

fn planner_error(event: PlannerEvent) -> anyhow::Error {
    match event {
        PlannerEvent::Failed { message } => anyhow!(message),
        other => anyhow!("the planner process answered with {other:?}"),
    }
}

/// Waits until nothing moves in the picture, at most `timeout_s`.
pub fn wait_still(session: &mut Session, camera: &Camera, timeout_s: f64) -> anyhow::Result<bool> {
    let request = CameraRequest::WaitStill { timeout_s };
    let timeout = Duration::from_secs_f64(timeout_s + 5.0);
    match session.ask(camera, &request, timeout, |_| ())? {
        CameraEvent::Still { still } => Ok(still),
        other => Err(camera_error(other)),
    }
}

/// What tracking found.
#[derive(Debug, Clone, Copy)]
pub struct Tracked {
    /// Part of the frames in which the rope was lost (0 to 1).
    pub lost_part: f64,
    /// Sizes and colours of rope and lead.
    pub appearance: RopeAppearance,
    /// Processing time per frame (ms).
    pub ms_per_frame: f64,
}

/// Tracks the rope through the film; keypoints go out over shared memory.
pub fn track(
    session: &mut Session,
    camera: &Camera,
    calibration: &StereoCamera,
    film: &Film,
    overlay: &Path,
    stage: &Stage,
) -> anyhow::Result<Tracked> {
    let joints = film_joints(session, film)?;
    session.received.keypoints.clear();
    let request = CameraRequest::Track {
        camera: Box::new(calibration.clone()),
        joints,
        keypoints: KEYPOINTS,
        overlay: Some(overlay.display().to_string()),
    };
    let event = session.ask(camera, &request, Duration::from_secs(60), |event| {
        if let CameraEvent::Progress(p) = event {
            stage.progress(p);
        }
    })?;
    match event {
        CameraEvent::Tracked {
            lost_part,
            appearance,
            ms_per_frame,
            ..
        } => Ok(Tracked {
            lost_part,
            appearance,
            ms_per_frame,
        }),
        other => Err(camera_error(other)),
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
    seed: u64,
    stage: &Stage,
) -> anyhow::Result<RopeEstimate> {
    let request = PlannerRequest::Identify(Box::new(IdentifyRequest {
        first_stamp_ns: film.first_stamp_ns,
        frames: film.frames,
        camera: Box::new(calibration.clone()),
        joints: film_joints(session, film)?,
        appearance: Some(appearance),
        lead_mass_kg: None,
        seed,
    }));
    let event = session.ask(planner, &request, Duration::from_secs(300), |event| {
        if let PlannerEvent::Progress(p) = event {
            stage.progress(p);
        }
    })?;
    match event {
        PlannerEvent::Identified(estimate) => Ok(*estimate),
        other => Err(planner_error(other)),
    }
}

/// Plans a strike.
pub fn plan_strike(
    session: &mut Session,
    planner: &Planner,
    order: StrikeOrder,
    stage: &Stage,
) -> anyhow::Result<Plan> {
    let request = PlannerRequest::Strike(Box::new(order));
    let event = session.ask(planner, &request, Duration::from_secs(300), |event| {
        if let PlannerEvent::Progress(p) = event {
            stage.progress(p);
        }
    })?;
    match event {
        PlannerEvent::Planned(plan) => Ok(*plan),
        other => Err(planner_error(other)),
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
    match session.ask(camera, &request, Duration::from_secs(60), |_| ())? {
        CameraEvent::Scored(result) => Ok(result),
        other => Err(camera_error(other)),
    }
}
