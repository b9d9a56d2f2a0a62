//! `wag wiggle --evaluate` and `--optimise`: what a wiggle can tell about ropes.

use crate::cli::WiggleArgs;
use crate::config;
use arm_model::Limits;
use cli_output::table::numbers;
use cli_output::{Failure, OrInput, Outcome, Stage, is_interrupted};
use planner::PlannerConfig;
use planner::synthetic::side_camera;
use planner::wiggle::{WiggleConfig, WiggleError, wiggle};
use planner::wiggle_design::{DesignError, JudgedWiggle, judge, optimise};
use run_log::files;
use serde_json::{Value, json};
use std::ops::ControlFlow;

/// The paper's wiggle: 25 degrees at 0.75 Hz.
fn papers(config: &WiggleConfig) -> WiggleConfig {
    WiggleConfig {
        amplitude_rad: 25.0_f64.to_radians(),
        frequency_hz: 0.75,
        ..*config
    }
}

fn classify(error: DesignError) -> Failure {
    match error {
        DesignError::Wiggle(WiggleError::Value(_) | WiggleError::BreaksLimit { .. }) => {
            Failure::input(error)
        }
        other => Failure::failed(other),
    }
}

pub fn run(args: &WiggleArgs) -> Outcome<Option<Value>> {
    if args.arm.names_arm() {
        return Err(bad_input!(
            "--evaluate and --optimise move nothing: leave --arm out, or execute the wiggle without them"
        ));
    }
    let limits = config::here::<Limits>(args.arm.limits.as_deref()).or_input()?;
    let config = config::here::<PlannerConfig>(None).or_input()?;
    let camera = side_camera();
    let threads = config.identify.threads;
    let judged = |wiggle: &WiggleConfig| {
        judge(
            wiggle,
            &limits,
            &config.cell,
            &camera,
            args.seed,
            true,
            threads,
        )
        .map_err(classify)
    };
    cli_output::watch_interrupts().or_failed()?;
    let mut rows: Vec<(&'static str, JudgedWiggle)> = vec![
        ("configured", judged(&config.wiggle)?),
        ("paper", judged(&papers(&config.wiggle))?),
    ];
    if args.optimise {
        let stage = Stage::begin("optimise");
        let best = optimise(
            &config.wiggle,
            &limits,
            &config.cell,
            &camera,
            args.seed,
            threads,
            &mut |generation, value| {
                stage.say(format!("generation {generation}, log volume {value:.3}"));
                if is_interrupted() {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        )
        .map_err(classify)?;
        stage.done("the most telling wiggle found");
        rows.push(("optimised", judged(&best)?));
        if let Some(path) = &args.csv {
            let trajectory = wiggle(&best, &limits).or_failed()?;
            files::write_trajectory(path, &trajectory, limits.period_s()).or_failed()?;
        }
    }
    print(&rows);
    let wiggles: serde_json::Map<String, Value> = rows
        .iter()
        .map(|(name, judged)| ((*name).to_owned(), json!(judged)))
        .collect();
    Ok(Some(json!({
        "ok": true, "command": "wiggle", "seed": args.seed, "csv": args.csv, "wiggles": wiggles,
    })))
}

fn print(rows: &[(&'static str, JudgedWiggle)]) {
    let lines = rows.iter().map(|(name, j)| {
        let i = &j.information;
        [
            format!(
                "{name}: {:.1} deg, {:.2} Hz, ramp {:.2} s",
                j.amplitude_rad.to_degrees(),
                j.frequency_hz,
                j.ramp_s
            ),
            format!("{:.2}", 1e3 * i.length_m),
            format!("{:.2}", 100.0 * i.bending_stiffness),
            format!("{:.2}", 100.0 * i.damping),
            format!("{:.2}", 100.0 * i.lead_mass),
            format!("{:.2}", 1e3 * i.lead_radius_m),
            format!("{:.1}", i.links),
            format!("{:.3}", j.gap_m),
        ]
    });
    let header = [
        "deviations left (median rope)",
        "length (mm)",
        "k s/mass (%)",
        "c s/mass (%)",
        "lead mass (%)",
        "lead radius (mm)",
        "links",
        "least gap (m)",
    ];
    println!("{}", numbers(header, 0, lines));
}
