//! Starting the processes of a session and connecting to them.

use super::{ArmLink, RunFolder, STARTUP};
use crate::session::{ProcessSpec, Session};
use camera_ingest::calib::{VideoMode, write_camera_toml, write_factory_conf};
use camera_ingest::process::CameraConfig;
use hil_tests::rig::RigConfig;
use planner::process::PlannerConfig;
use rt_controller::ControllerConfig;
use shared_types::ipc::message::{
    CameraRequest, CameraRpc, ControllerRequest, PlannerRequest, PlannerRpc, RigRequest, RigRpc,
};
use shared_types::ipc::rpc::RpcClient;
use shared_types::{Limits, StereoCamera};
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;

const CONTROLLER: &str = include_str!("../../../configs/rt/controller.toml");
const RIG: &str = include_str!("../../../configs/rig/demo.toml");

/// The demo's rig: the shipped file, this run's domain and seed, free ports.
pub fn rig_config(folder: &RunFolder, seed: u64, target_m: [f64; 3]) -> anyhow::Result<RigConfig> {
    let shipped: RigConfig = toml::from_str(RIG)?;
    Ok(RigConfig {
        domain: folder.domain.clone(),
        seed,
        command_port: 0,
        report_ports: [0; 4],
        target_m: Some(target_m),
        ..shipped
    })
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

/// Starts the simulated rig.
pub fn start_rig(
    session: &mut Session,
    folder: &RunFolder,
    config: &RigConfig,
) -> anyhow::Result<RpcClient<RigRpc>> {
    let config = folder.config("rig", config)?;
    session.start(&ProcessSpec {
        name: "rig",
        config,
    })?;
    session.connect(&RigRequest::Ports, STARTUP)
}

/// Starts camera-ingest.
pub fn start_camera(
    session: &mut Session,
    folder: &RunFolder,
) -> anyhow::Result<RpcClient<CameraRpc>> {
    let config = folder.config(
        "camera-ingest",
        &CameraConfig {
            domain: folder.domain.clone(),
        },
    )?;
    session.start(&ProcessSpec {
        name: "camera-ingest",
        config,
    })?;
    session.connect(&CameraRequest::Ping, STARTUP)
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
    let config = folder.config("planner", &config)?;
    session.start(&ProcessSpec {
        name: "planner",
        config,
    })?;
    session.connect(&PlannerRequest::Ping, STARTUP)
}

/// Starts the controller for an arm on this machine.
pub fn start_controller(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    ports: (u16, u16),
) -> anyhow::Result<ArmLink> {
    start_controller_at(
        session,
        folder,
        limits,
        IpAddr::V4(Ipv4Addr::LOCALHOST),
        ports,
    )
}

/// Starts the controller for an arm anywhere; `ports` are those of commands and
/// of the real-time report.
pub fn start_controller_at(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    arm: IpAddr,
    ports: (u16, u16),
) -> anyhow::Result<ArmLink> {
    let shipped: ControllerConfig = toml::from_str(CONTROLLER)?;
    let mut config = ControllerConfig {
        domain: folder.domain.clone(),
        arm,
        command_port: ports.0,
        report_port: ports.1,
        limits: Some(limits.clone()),
        ..shipped
    };
    if arm.is_loopback() {
        // A simulated arm shares this machine with everything else: its silence
        // says more about the machine's load than about a cable.
        config.thresholds.reply_stall_ms = Some(500.0);
        config.thresholds.report_stale_ms = Some(500.0);
        config.thresholds.tracking_window_ms = Some(500.0);
        config.thresholds.missed_cycles_max = Some(50);
        config.thresholds.late_cycles_max = Some(50);
    } else {
        config.real_time.require = true;
    }
    let config = folder.config("rt-controller", &config)?;
    session.start(&ProcessSpec {
        name: "rt-controller",
        config,
    })?;
    session.connect(&ControllerRequest::Status, STARTUP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_files_say_what_the_defaults_are() {
        let controller: ControllerConfig = toml::from_str(CONTROLLER).unwrap();
        assert_eq!(controller, ControllerConfig::default());
        let rig: RigConfig = toml::from_str(RIG).unwrap();
        let default = RigConfig::default();
        assert_eq!(rig.camera, default.camera);
        assert!(
            (rig.lag.natural_frequency_rad_s - default.lag.natural_frequency_rad_s).abs() < 1e-2
        );
    }
}
