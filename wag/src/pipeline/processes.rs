//! Starting the processes of a session and connecting to them.

use super::{RunFolder, Service};
use crate::config;
use anyhow::bail;
use arm_model::{ArmResponse, Limits};
use rig_sim::RigConfig;
use rt_controller::ControllerConfig;
use rt_controller::arm_settings::ArmSettings;
use rt_controller::config::OnDifference;
use run_log::RecorderConfig;
use session::arm::ArmLink;
use session::{ProcessSpec, Session};
use shared_types::ipc::message::{ControllerRequest, ControllerRpc, RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::{Rpc, RpcClient};
use shared_types::{CommandInterface, StereoCamera};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

/// The demo's rig: a set-up with this run's domain and seed, free ports, a target.
pub fn rig_config(
    folder: &RunFolder,
    rig: &RigConfig,
    seed: u64,
    target_m: Option<[f64; 3]>,
) -> RigConfig {
    RigConfig {
        domain: folder.domain.clone(),
        seed,
        bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
        command_port: 0,
        report_ports: [0; 4],
        target_m,
        ..rig.clone()
    }
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
        ..RecorderConfig::of_run(&folder.domain, &folder.path, limits, cell)
    };
    let spec = ProcessSpec {
        name: "recorder",
        config: folder.config("recorder", &config)?,
        holds_arm: false,
    };
    session.record_run(&spec, &config.file);
    Ok(())
}

/// Starts a process that holds no arm and connects to its service.
pub fn start<R: Rpc>(
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
    session.connect(ping)
}

/// Starts the simulated rig; its arm's address too.
pub fn start_rig(
    session: &mut Session,
    folder: &RunFolder,
    config: &RigConfig,
) -> anyhow::Result<(RpcClient<RigRpc>, ArmAddress)> {
    let rig = start(session, folder, "rig", config, &RigRequest::Ports)?;
    match session.ask(&rig, &RigRequest::Ports, 5.0, |_| ())? {
        RigEvent::Ports { command, reports } => {
            let [joints, normal, rich, _] = reports;
            let address = ArmAddress {
                ip: IpAddr::V4(Ipv4Addr::LOCALHOST),
                command,
                joints,
                status: [rich, normal],
                simulated: true,
                arm_response: None,
                service: None,
            };
            Ok((rig, address))
        }
        RigEvent::Failed { message } => bail!(message),
        other => bail!("the rig answered with {other:?}"),
    }
}

#[derive(Debug, Clone)]
pub struct ArmAddress {
    pub ip: IpAddr,
    pub command: u16,
    /// Port with joint states (250 Hz).
    pub joints: u16,
    /// Ports with its status (5 Hz), in the order in which they are tried.
    pub status: [u16; 2],
    pub simulated: bool,
    /// How it follows its setpoints, where that is known, and the file that tells it.
    pub arm_response: Option<(PathBuf, ArmResponse)>,
    /// The controller that drives it, where one runs as a service.
    pub service: Option<Service>,
}

impl From<Service> for ArmAddress {
    fn from(service: Service) -> Self {
        let config = &service.config;
        Self {
            ip: config.arm,
            command: config.command_port,
            joints: config.report_port,
            status: config.status_ports,
            simulated: config.simulated,
            arm_response: None,
            service: Some(service),
        }
    }
}

/// The controller of an arm: the one that runs for it, or one that is started with its guardian.
pub fn controller(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    arm: &ArmAddress,
) -> anyhow::Result<ArmLink> {
    if let Some(service) = &arm.service {
        folder.config("rt-controller", &service.config)?;
        return session.connect(&ControllerRequest::Status);
    }
    if session
        .find::<ControllerRpc>(&ControllerRequest::Status)?
        .is_some()
    {
        let domain = &folder.domain;
        bail!(
            "a controller runs in domain `{domain}` already: use it with --controller {domain} instead of --arm, or end it"
        );
    }
    let config = folder.config("rt-controller", &controller_config(folder, limits, arm)?)?;
    for name in ["rt-controller", "guardian"] {
        session.start(&ProcessSpec {
            name,
            config: config.clone(),
            holds_arm: true,
        })?;
    }
    session.connect(&ControllerRequest::Status)
}

/// What holds here with this run's domain, arm and limits.
fn controller_config(
    folder: &RunFolder,
    limits: &Limits,
    arm: &ArmAddress,
) -> anyhow::Result<ControllerConfig> {
    let shipped: ControllerConfig = config::here(None)?;
    let mut config = ControllerConfig {
        domain: folder.domain.clone(),
        arm: arm.ip,
        command_port: arm.command,
        report_port: arm.joints,
        status_ports: arm.status,
        simulated: arm.simulated,
        pole: config::cell()?.pole,
        // It was measured by positions.
        arm_response_file: arm
            .arm_response
            .as_ref()
            .filter(|_| shipped.command_interface == CommandInterface::ServoPosition)
            .map(|(path, _)| path.clone()),
        limits: Some(limits.clone()),
        ..shipped
    };
    if arm.simulated {
        // A simulated arm shares this machine with everything else: its silence
        // says more about the machine's load than about a cable.
        config.thresholds.operator_timeout_ms = Some(2000.0);
        config.thresholds.reply_stall_ms = Some(500.0);
        config.thresholds.unanswered_max = Some(125);
        config.thresholds.report_stale_ms = Some(500.0);
        config.thresholds.tracking_window_ms = Some(250.0);
        config.thresholds.missed_cycles_max = Some(50);
        config.thresholds.late_cycles_max = Some(50);
        // Nobody configured it, so nobody needs to look.
        config.on_difference = OnDifference::Set;
        // What a laboratory wants of its own arm is not wanted of a simulated one, which has no
        // switch either.
        config.arm_settings = ArmSettings::default();
        config.enabling_input = None;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_files_say_what_the_defaults_are_and_keep_the_vendor_ranges() {
        let controller: ControllerConfig = config::built_in().unwrap();
        assert_eq!(controller, ControllerConfig::default());
        let (rig, default): (RigConfig, _) = (config::built_in().unwrap(), RigConfig::default());
        assert_eq!(rig.camera, default.camera);
        let frequency = |rig: &RigConfig| rig.lag.natural_frequency_rad_s;
        assert!((frequency(&rig) - frequency(&default)).abs() < 1e-2);
        let (shipped, vendor): (Limits, _) = (config::built_in().unwrap(), Limits::default());
        for j in 0..7 {
            assert!(shipped.position_min_rad[j] >= vendor.position_min_rad[j] - 1e-6);
            assert!(shipped.position_max_rad[j] <= vendor.position_max_rad[j] + 1e-6);
            assert!(shipped.velocity_max_rad_s[j] <= vendor.velocity_max_rad_s[j] + 1e-6);
        }
    }
}
