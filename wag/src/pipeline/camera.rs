//! What films a run: a camera that runs in a shared-memory domain, or a device that is started
//! for it; and what a laboratory knows of it.

use super::{RunFolder, start};
use crate::config;
use anyhow::{Context, anyhow, bail, ensure};
use camera_ingest::calib::{VideoMode, load_camera, write_camera_toml, write_factory_conf};
use camera_ingest::live::{CameraConfig, LiveSettings};
use camera_ingest::process::CameraConfig as IngestConfig;
use run_log::files;
use session::{ProcessSpec, Session};
use shared_types::StereoCamera;
use shared_types::ipc::message::{CameraRequest, CameraRpc, RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{Bus, DomainSweep, IpcError};
use std::path::{Path, PathBuf};

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FramesFrom {
    /// Somebody publishes them in this shared-memory domain.
    Domain(String),
    /// A device of this machine, filmed at this rate (Hz).
    Device(PathBuf, u32),
}

/// The camera, and the colours by which it measures a throw.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: StereoCamera,
    pub tip_rgb: Option<[u8; 3]>,
    pub target_rgb: Option<[u8; 3]>,
}

impl Scene {
    /// The camera that a file describes: the one that is named, else that of this place.
    pub fn of_file(named: Option<&Path>) -> anyhow::Result<Option<StereoCamera>> {
        let here = named.map_or_else(config::camera_file, |path| Ok(Some(path.to_owned())))?;
        Ok(here.map(|path| load_camera(&path)).transpose()?)
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
                tip_rgb: Some(tip_rgb),
                target_rgb: Some(target_rgb),
            }),
            other => bail!("the rig answered with {other:?}"),
        }
    }

    fn mode(&self) -> anyhow::Result<VideoMode> {
        let (width_px, height_px) = (self.camera.width_px, self.camera.height_px);
        VideoMode::of_size_px((width_px, height_px)).with_context(|| {
            format!("no camera of this system has images of {width_px}x{height_px} pixels")
        })
    }

    /// Writes the calibration into a run's folder, as a laboratory keeps it.
    pub fn keep(&self, folder: &RunFolder) -> anyhow::Result<()> {
        let (conf, mode) = (Path::new("camera.conf"), self.mode()?);
        write_factory_conf(&folder.path.join(conf), &self.camera, mode)?;
        write_camera_toml(&folder.file(files::CAMERA), &self.camera, mode, conf)?;
        Ok(())
    }
}

/// Starts the device, if one films, and what takes the frames in, unless that runs already.
pub fn start_camera(
    session: &mut Session,
    folder: &RunFolder,
    from: &FramesFrom,
    scene: &Scene,
) -> anyhow::Result<RpcClient<CameraRpc>> {
    let domain = folder.domain.clone();
    if let FramesFrom::Device(device, rate_hz) = from {
        let config = CameraConfig {
            domain: domain.clone(),
            camera: LiveSettings {
                device: device.clone(),
                mode: scene.mode()?,
                rate_hz: *rate_hz,
                gain: None,
                exposure_raw: None,
                sensor_gain_raw: None,
            },
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

/// Whether a simulated rig runs in a shared-memory domain.
///
/// # Errors
/// The name is none, or shared memory cannot be used.
pub fn has_rig(domain: &str) -> anyhow::Result<bool> {
    // Removed last: it looks for others in the domain.
    let _sweep = DomainSweep::new(domain);
    let bus = Bus::join(domain)?;
    match RpcClient::<RigRpc>::open(&bus)?.call(&RigRequest::Ports) {
        Ok(_) => Ok(true),
        Err(IpcError::Gone { .. }) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// The simulated rig whose camera publishes in the session's domain, if it is one's. Its arm must
/// be the one that moves, at `command_port`.
pub fn find_rig(
    session: &mut Session,
    (simulated, command_port): (bool, u16),
) -> anyhow::Result<Option<RpcClient<RigRpc>>> {
    let Some(rig) = session.find::<RigRpc>(&RigRequest::Ports)? else {
        return Ok(None);
    };
    ensure!(
        simulated,
        "the camera is a simulated rig's, but the arm does not prove that it is simulated: name the camera that films this arm"
    );
    match session.ask(&rig, &RigRequest::Ports, 5.0, |_| ())? {
        RigEvent::Ports { command, .. } if command == command_port => Ok(Some(rig)),
        RigEvent::Ports { command, .. } => Err(anyhow!(
            "the camera films the simulated arm with command port {command}, not the one with port {command_port}: name that port with --command-port, or the camera of the other"
        )),
        other => Err(anyhow!("the rig answered with {other:?}")),
    }
}
