//! Starting the processes of a session and connecting to them.

use super::{ArmLink, RunFolder, STARTUP};
use crate::config;
use crate::session::{ProcessSpec, Session};
use anyhow::{Context, anyhow, bail};
use arm_model::{Cell, Limits};
use camera_ingest::calib::{VideoMode, write_camera_toml, write_factory_conf};
use camera_ingest::preview::PreviewConfig;
use camera_ingest::process::CameraConfig;
use planner::PlannerConfig;
use planner::service::{PlannerRequest, PlannerRpc};
use rig_sim::RigConfig;
use rt_controller::ControllerConfig;
use rt_controller::config::OnDifference;
use run_log::RecorderConfig;
use run_log::files;
use shared_types::StereoCamera;
use shared_types::ipc::message::{
    CameraRequest, CameraRpc, ControllerRequest, RigEvent, RigRequest, RigRpc,
};
use shared_types::ipc::rpc::{Rpc, RpcClient};
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::time::Duration;

/// The set-up of a rig that holds here, with a file of the user's over it.
pub fn shipped_rig(path: Option<&Path>) -> anyhow::Result<RigConfig> {
    config::here(path)
}

/// The demo's rig: a set-up with this run's domain and seed, free ports, a target.
pub fn rig_config(folder: &RunFolder, rig: &RigConfig, seed: u64, target_m: [f64; 3]) -> RigConfig {
    RigConfig {
        domain: folder.domain.clone(),
        seed,
        bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
        command_port: 0,
        report_ports: [0; 4],
        target_m: Some(target_m),
        ..rig.clone()
    }
}

/// Writes the camera's calibration into the run folder, as a lab's would lie
/// there.
pub fn write_calibration(folder: &RunFolder, camera: &StereoCamera) -> anyhow::Result<()> {
    write_factory_conf(&folder.file("camera.conf"), camera, VideoMode::Vga)?;
    write_camera_toml(
        &folder.file("camera.toml"),
        camera,
        VideoMode::Vga,
        Path::new("camera.conf"),
    )?;
    Ok(())
}

/// Starts the process that records the run; what `camera` and `target_m` are is told
/// in it, where there are any.
pub fn start_recorder(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    camera: Option<&StereoCamera>,
    target_m: Option<[f64; 3]>,
) -> anyhow::Result<()> {
    let cell = config::cell()?;
    folder.config("cell", &cell)?;
    let config = RecorderConfig {
        target_m,
        camera: camera.cloned(),
        ..RecorderConfig::of_run(&folder.domain, folder.path(), limits, cell)
    };
    let file = config.file.clone();
    let config = folder.config("recorder", &config)?;
    let spec = ProcessSpec {
        name: "recorder",
        config,
        holds_arm: false,
    };
    session.record_run(&spec, &file);
    Ok(())
}

/// Starts a process that holds no arm and connects to its service.
fn start<R: Rpc>(
    session: &mut Session,
    folder: &RunFolder,
    name: &'static str,
    config: &impl serde::Serialize,
    ping: &R::Request,
) -> anyhow::Result<RpcClient<R>> {
    session.start(&ProcessSpec {
        name,
        config: folder.config(name, config)?,
        holds_arm: false,
    })?;
    session.connect(ping, STARTUP)
}

/// Starts the simulated rig.
pub fn start_rig(
    session: &mut Session,
    folder: &RunFolder,
    config: &RigConfig,
) -> anyhow::Result<RpcClient<RigRpc>> {
    start(session, folder, "rig", config, &RigRequest::Ports)
}

/// Starts camera-ingest.
pub fn start_camera(
    session: &mut Session,
    folder: &RunFolder,
) -> anyhow::Result<RpcClient<CameraRpc>> {
    let config = CameraConfig {
        domain: folder.domain.clone(),
    };
    let ping = &CameraRequest::Ping;
    start(session, folder, "camera-ingest", &config, ping)
}

/// Starts the planner.
pub fn start_planner(
    session: &mut Session,
    folder: &RunFolder,
    settings: &PlannerConfig,
) -> anyhow::Result<RpcClient<PlannerRpc>> {
    let config = PlannerConfig {
        domain: folder.domain.clone(),
        ..settings.clone()
    };
    start(session, folder, "planner", &config, &PlannerRequest::Ping)
}

/// The live preview of a domain's rope, to be started by whoever shows it; its
/// configuration goes into `folder`.
pub fn preview_spec(
    folder: &Path,
    domain: &str,
    camera: &Path,
    cell: Cell,
) -> anyhow::Result<ProcessSpec> {
    let config = PreviewConfig::new(domain, camera.to_owned(), cell);
    let path = folder.join("preview.toml");
    let text = toml::to_string(&config).context("configuration of preview")?;
    files::write_atomic(&path, text.as_bytes())?;
    Ok(ProcessSpec {
        name: "preview",
        config: path,
        holds_arm: false,
    })
}

/// Where an arm listens.
#[derive(Debug, Clone, Copy)]
pub struct ArmAddress {
    /// Its address.
    pub ip: IpAddr,
    /// Command port.
    pub command: u16,
    /// Port with joint states (250 Hz).
    pub joints: u16,
    /// Ports with its status (5 Hz), in the order in which they are tried.
    pub status: [u16; 2],
}

impl ArmAddress {
    /// The simulated arm of a rig on this machine; `reports` stand for ports
    /// 30000 to 30003.
    pub fn of_rig(command: u16, reports: [u16; 4]) -> Self {
        let [joints, normal, rich, _] = reports;
        Self {
            ip: IpAddr::V4(Ipv4Addr::LOCALHOST),
            command,
            joints,
            status: [rich, normal],
        }
    }
}

/// Where the arm of a rig listens.
pub fn arm_ports(session: &mut Session, rig: &RpcClient<RigRpc>) -> anyhow::Result<ArmAddress> {
    match session.ask(rig, &RigRequest::Ports, Duration::from_secs(5), |_| ())? {
        RigEvent::Ports { command, reports } => Ok(ArmAddress::of_rig(command, reports)),
        RigEvent::Failed { message } => Err(anyhow!(message)),
        other => bail!("the rig answered with {other:?}"),
    }
}

/// Starts the controller for an arm, and its guardian.
pub fn start_controller(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    arm: ArmAddress,
) -> anyhow::Result<ArmLink> {
    let config = folder.config("rt-controller", &controller_config(folder, limits, arm)?)?;
    for name in ["rt-controller", "guardian"] {
        session.start(&ProcessSpec {
            name,
            config: config.clone(),
            holds_arm: true,
        })?;
    }
    session.connect(&ControllerRequest::Status, STARTUP)
}

/// What holds here with this run's domain, arm and limits.
fn controller_config(
    folder: &RunFolder,
    limits: &Limits,
    arm: ArmAddress,
) -> anyhow::Result<ControllerConfig> {
    let shipped: ControllerConfig = config::here(None)?;
    let mut config = ControllerConfig {
        domain: folder.domain.clone(),
        arm: arm.ip,
        command_port: arm.command,
        report_port: arm.joints,
        status_ports: arm.status,
        limits: Some(limits.clone()),
        ..shipped
    };
    if arm.ip.is_loopback() {
        // A simulated arm shares this machine with everything else: its silence
        // says more about the machine's load than about a cable.
        config.thresholds.reply_stall_ms = Some(500.0);
        config.thresholds.unanswered_max = Some(125);
        config.thresholds.report_stale_ms = Some(500.0);
        config.thresholds.tracking_window_ms = Some(250.0);
        config.thresholds.missed_cycles_max = Some(50);
        config.thresholds.late_cycles_max = Some(50);
        config.guardian.silence_ms = 500.0;
        // Nobody configured it, so nobody needs to look.
        config.on_difference = OnDifference::Set;
    } else {
        config.real_time.require = true;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_files_say_what_the_defaults_are() {
        let controller: ControllerConfig = config::built_in().unwrap();
        assert_eq!(controller, ControllerConfig::default());
        let rig: RigConfig = config::built_in().unwrap();
        let default = RigConfig::default();
        assert_eq!(rig.camera, default.camera);
        assert!(
            (rig.lag.natural_frequency_rad_s - default.lag.natural_frequency_rad_s).abs() < 1e-2
        );
    }

    #[test]
    fn the_shipped_limits_keep_the_vendor_ranges() {
        let (shipped, vendor): (Limits, _) = (config::built_in().unwrap(), Limits::default());
        for j in 0..7 {
            assert!(shipped.position_min_rad[j] >= vendor.position_min_rad[j] - 1e-6);
            assert!(shipped.position_max_rad[j] <= vendor.position_max_rad[j] + 1e-6);
            assert!(shipped.velocity_max_rad_s[j] <= vendor.velocity_max_rad_s[j] + 1e-6);
        }
    }
}
