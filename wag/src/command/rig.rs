//! `wag rig`: the simulated xArm 7 as a server.

use crate::cli::RigArgs;
use crate::failure::{Failure, OrInput, Outcome};
use crate::files;
use crate::session::{Session, interrupted, watch_interrupts};
use anyhow::{Context, anyhow, bail};
use hil_tests::arm::{ArmConfig, FaultScript, SimulatedArm};
use hil_tests::rig::RigConfig;
use serde_json::{Value, json};
use shared_types::ipc::message::{RigEvent, RigRequest, RigRpc};
use std::net::IpAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

pub fn run(args: &RigArgs, quiet: bool) -> Outcome<Option<Value>> {
    let faults = match &args.faults {
        Some(path) => FaultScript::read(path).or_input()?,
        None => FaultScript::default(),
    };
    let report_ports: [u16; 4] = args.report_ports.clone().try_into().map_err(
        |found: Vec<u16>| {
            Failure::input(anyhow!(
                "--report-ports needs four ports in the place of 30000,30001,30002,30003, found {}",
                found.len()
            ))
        },
    )?;
    if args.camera.is_some() && args.rope.is_none() {
        return Err(Failure::input(anyhow!(
            "--camera films a rope: add --rope FILE or --rope random"
        )));
    }
    watch_interrupts().or_failed()?;
    let value = match &args.rope {
        None => arm_alone(args, report_ports, faults, quiet),
        Some(rope) => {
            let mut config = RigConfig {
                domain: args
                    .camera
                    .clone()
                    .unwrap_or_else(|| format!("rig-{}", std::process::id())),
                seed: args.seed,
                bind: args.bind,
                command_port: args.command_port,
                report_ports,
                faults,
                ..RigConfig::default()
            };
            config.camera.enabled = args.camera.is_some();
            if rope != "random" {
                config.rope = Some(files::read_rope(rope.as_ref()).or_input()?);
            }
            whole_rig(&config, quiet)
        }
    };
    value.or_failed().map(Some)
}

fn announce(bind: IpAddr, command: u16, reports: [u16; 4], quiet: bool) {
    if !quiet {
        println!(
            "simulated xArm 7 at {bind}: commands on {command}, reports on {reports:?}; Ctrl-C ends it"
        );
    }
}

fn arm_alone(
    args: &RigArgs,
    report_ports: [u16; 4],
    faults: FaultScript,
    quiet: bool,
) -> anyhow::Result<Value> {
    let arm = SimulatedArm::start(ArmConfig {
        bind: args.bind,
        command_port: args.command_port,
        report_ports,
        seed: args.seed,
        faults,
        ..ArmConfig::default()
    })?;
    let ports = arm.ports();
    announce(args.bind, ports.command, ports.reports, quiet);
    while !interrupted().load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(50));
    }
    arm.stop();
    Ok(
        json!({ "ok": true, "command": "rig", "command_port": ports.command, "report_ports": ports.reports }),
    )
}

/// Arm, rope and perhaps camera; the rig runs in a thread of its own.
fn whole_rig(config: &RigConfig, quiet: bool) -> anyhow::Result<Value> {
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let rig = scope.spawn(|| {
            let outcome = hil_tests::rig::run(config, interrupted());
            ended.store(true, Ordering::SeqCst);
            outcome
        });
        let ports = rig_ports(config, &ended);
        if let Ok((command, reports)) = &ports {
            announce(config.bind, *command, *reports, quiet);
        }
        match rig.join() {
            Ok(outcome) => outcome?,
            Err(_) => bail!("the rig ended by a defect; see the messages above"),
        }
        let (command, reports) = ports?;
        Ok(
            json!({ "ok": true, "command": "rig", "command_port": command, "report_ports": reports }),
        )
    })
}

/// Asks the rig for its ports as soon as it serves.
fn rig_ports(config: &RigConfig, ended: &AtomicBool) -> anyhow::Result<(u16, [u16; 4])> {
    // The rig needs a moment to open its services; it may also fail at once.
    let folder = std::env::temp_dir();
    let mut session = Session::new(&config.domain, &folder)?;
    for _ in 0..200 {
        if ended.load(Ordering::SeqCst) {
            break;
        }
        if let Ok(rig) = session.connect::<RigRpc>(&RigRequest::Ports, Duration::from_millis(50)) {
            let event = session.ask(&rig, &RigRequest::Ports, Duration::from_secs(5), |_| ())?;
            return match event {
                RigEvent::Ports { command, reports } => Ok((command, reports)),
                other => Err(anyhow!("the rig answered with {other:?}")),
            };
        }
    }
    None.context("the rig did not come up")
}
