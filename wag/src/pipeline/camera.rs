//! What films a run: a camera that runs in a shared-memory domain, or a device that is started
//! for it; and what a laboratory knows of it.

use super::{RunFolder, start};
use crate::config;
use anyhow::bail;
use camera_ingest::calib::{load_camera, load_exposure};
use camera_ingest::live::{CameraConfig, Exposure, LiveSettings};
use camera_ingest::process::CameraConfig as IngestConfig;
use session::{ProcessSpec, Session};
use shared_types::StereoCamera;
use shared_types::ipc::message::{CameraRequest, CameraRpc, RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::RpcClient;
use std::path::Path;

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FramesFrom {
    /// Somebody publishes them in this shared-memory domain.
    Domain(String),
    /// A device of this machine.
    Device(LiveSettings),
}

/// The camera, and the colours of tip and target where a simulated rig tells them.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: StereoCamera,
    pub colours: Option<[[u8; 3]; 2]>,
}

impl Scene {
    /// The camera that a file describes: the one that is named, else that of this place; and what
    /// a device is set to that films for it.
    pub fn of_file(named: Option<&Path>) -> anyhow::Result<Option<(StereoCamera, Exposure)>> {
        let here = named.map_or_else(config::camera_file, |path| Ok(Some(path.to_owned())))?;
        let found = here.map(|path| Ok((load_camera(&path)?, load_exposure(&path)?)));
        found.transpose()
    }

    /// What a simulated rig tells.
    pub fn of_rig(session: &mut Session, rig: &RpcClient<RigRpc>) -> anyhow::Result<Self> {
        match session.ask(rig, &RigRequest::Scene, 5.0, |_| ())? {
            RigEvent::Scene {
                camera,
                tip_rgb,
                target_rgb,
            } => Ok(Self {
                camera: *camera,
                colours: Some([tip_rgb, target_rgb]),
            }),
            other => bail!("the rig answered with {other:?}"),
        }
    }
}

/// Starts the device, if one films, and what takes the frames in, unless that runs already.
pub fn start_camera(
    session: &mut Session,
    folder: &RunFolder,
    from: &FramesFrom,
) -> anyhow::Result<RpcClient<CameraRpc>> {
    let domain = folder.domain.clone();
    if let FramesFrom::Device(device) = from {
        let config = CameraConfig {
            domain: domain.clone(),
            camera: device.clone(),
        };
        session.start(&ProcessSpec {
            name: "camera",
            config: folder.config("camera", &config)?,
            holds_arm: false,
        })?;
    }
    let ping = CameraRequest::Ping;
    match session.find(&ping)? {
        Some(running) => Ok(running),
        None => start(
            session,
            folder,
            "camera-ingest",
            &IngestConfig { domain },
            &ping,
        ),
    }
}
