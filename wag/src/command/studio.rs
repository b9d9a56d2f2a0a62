//! `wag studio`: the page where one works.

use super::watch::announce;
use crate::cli::{Cli, StudioArgs};
use crate::config;
use arm_model::Limits;
use cli_output::{Failure, OrInput, Outcome, is_interrupted, watch_interrupts};
use planner::PlannerConfig;
use planner::wiggle::wiggle;
use serde_json::Value;
use studio::{Cell, Settings, Studio};

/// Arguments of the runs that a page begins: those that name arm and camera.
fn reached_by(args: &StudioArgs) -> Vec<String> {
    let calibration = args.camera.calibration.as_ref();
    let calibration = calibration.map(|file| file.display().to_string());
    let port = |port: u16| args.address.map(|_| port.to_string());
    let named = [
        ("--arm", args.address.map(|ip| ip.to_string())),
        ("--command-port", port(args.ports.command_port)),
        ("--report-port", port(args.ports.report_port)),
        ("--status-port", port(args.ports.status_port)),
        ("--controller", args.controller.clone()),
        ("--camera", args.camera.camera.clone()),
        ("--calibration", calibration),
        ("--operator", args.operator.clone()),
    ];
    let given = named
        .into_iter()
        .filter_map(|(option, v)| Some([option.to_owned(), v?]));
    let keeps = args.camera.keep_films.then(|| "--keep-films".to_owned());
    given.flatten().chain(keeps).collect()
}

pub fn run(cli: &Cli, args: &StudioArgs) -> Outcome<Option<Value>> {
    let here = config::cell_here().or_input()?;
    let limits = config::here::<Limits>(None).or_input()?;
    let planner: PlannerConfig = config::here(None).or_input()?;
    let is_real = args.address.is_some() || args.controller.is_some();
    if !is_real && args.camera.camera.is_some() {
        return Err(bad_input!("--camera films an arm: name it with --arm ADDR"));
    }
    run_log::ledger::make_place(&args.runs).or_input()?;
    watch_interrupts().or_failed()?;
    let (seed, task) = (args.seed, args.task);
    let camera = args
        .camera
        .camera
        .iter()
        .filter(|name| !name.starts_with('/'));
    let settings = Settings {
        cell: if is_real {
            Cell::Real {
                reached_by: reached_by(args),
                target_rgb: args.target_rgb.clone(),
                domain: camera.chain(&args.controller).next().cloned(),
            }
        } else {
            Cell::Simulated { seed, task }
        },
        cell_file: cli.cell.clone(),
        runs: args.runs.clone(),
        here,
        wiggle: wiggle(&planner.wiggle, &limits).or_failed()?,
    };
    let (mut studio, url) = Studio::start(settings, args.bind).map_err(Failure::of_server)?;
    announce("studio", &url, args.bind);
    while !is_interrupted() {
        studio.turn().or_failed()?;
    }
    Ok(None)
}
