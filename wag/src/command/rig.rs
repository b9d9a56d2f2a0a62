//! `wag rig`: the simulated xArm 7 as a server.

use crate::cli::RigArgs;
use crate::config;
use arm_model::Cell;
use cli_output::{
    Failure, OrInput, Outcome, interrupted, is_interrupted, output, watch_interrupts, watch_parent,
};
use rig_sim::{RigConfig, run_announced};
use run_log::files;
use serde_json::{Value, json};
use shared_types::Task;
use shared_types::ipc::DomainSweep;
use std::net::IpAddr;
use std::time::Duration;
use xarm_sim::{ArmConfig, ArmPorts, FaultScript, SimulatedArm};

pub fn run(args: &RigArgs) -> Outcome<Option<Value>> {
    let faults = match &args.faults {
        Some(path) => FaultScript::read(path).or_input()?,
        None => FaultScript::default(),
    };
    let report_ports: [u16; 4] = args.report_ports.clone().try_into().map_err(
        |found: Vec<u16>| {
            bad_input!(
                "--report-ports needs four ports in the place of 30000,30001,30002,30003, found {}",
                found.len()
            )
        },
    )?;
    if args.camera.is_some() && args.rope.is_none() {
        return Err(bad_input!(
            "--camera films a rope: add --rope FILE or --rope random"
        ));
    }
    let cell = config::cell().or_input()?;
    watch_interrupts().or_failed()?;
    watch_parent(args.parent, Duration::ZERO, Duration::from_secs(2)).or_failed()?;
    match &args.rope {
        None => arm_alone(args, report_ports, faults, cell).map_err(Failure::of_server)?,
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
                cell,
                ..RigConfig::default()
            };
            config = config.seeing(args.task);
            config.camera.enabled = args.camera.is_some();
            if rope != "random" {
                config.rope = Some(files::read_rope(rope.as_ref()).or_input()?);
            }
            // Goes last: nothing of the domain stays once the rig is gone.
            let _sweep = DomainSweep::new(&config.domain);
            let camera = args.camera.as_deref();
            let films = camera.map(|domain| (args.task, domain));
            let announce = |ports| announce(config.bind, ports, films);
            run_announced(&config, interrupted(), announce).map_err(Failure::of_server)?;
        }
    }
    Ok(None)
}

/// Says where the arm listens as soon as it does: whoever starts a rig waits for
/// its ports, not for its end.
fn announce(bind: IpAddr, ports: ArmPorts, films: Option<(Task, &str)>) {
    output::object(&json!({
        "ok": true, "command": "rig", "bind": bind,
        "command_port": ports.command, "report_ports": ports.reports,
    }));
    println!(
        "simulated xArm 7 at {bind}: commands on {}, reports on {:?}; Ctrl-C ends it",
        ports.command, ports.reports
    );
    let [joints, _, status, _] = ports.reports;
    let arm = format!(
        "--arm {bind} --command-port {} --report-port {joints} --status-port {status}",
        ports.command
    );
    match films {
        Some((task, domain)) => println!(
            "from wiggle to throw: wag run {} {arm} --camera {domain}",
            task.name()
        ),
        None => println!("drive it with {arm}"),
    }
}

fn arm_alone(
    args: &RigArgs,
    report_ports: [u16; 4],
    faults: FaultScript,
    cell: Cell,
) -> anyhow::Result<()> {
    let arm = SimulatedArm::start(ArmConfig {
        bind: args.bind,
        command_port: args.command_port,
        report_ports,
        seed: args.seed,
        faults,
        cell: Some(cell),
        ..ArmConfig::default()
    })?;
    announce(args.bind, arm.ports(), None);
    while !is_interrupted() {
        std::thread::sleep(Duration::from_millis(50));
    }
    arm.stop();
    Ok(())
}
