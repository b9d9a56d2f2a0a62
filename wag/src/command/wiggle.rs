//! `wag wiggle`: the probing motion, written to a file or executed.

use super::area::{limits, reach_measured};
use super::run::wiggle_alone;
use super::throw::drive;
use super::wiggle_design;
use crate::cli::WiggleArgs;
use crate::config;
use cli_output::{OrInput, Outcome};
use planner::PlannerConfig;
use planner::wiggle::wiggle;
use run_log::files;
use serde_json::{Value, json};

pub fn run(args: &WiggleArgs) -> Outcome<Option<Value>> {
    if args.evaluate || args.optimise {
        return wiggle_design::run(args);
    }
    if args.csv.is_none() && !args.arm.names_arm() && !args.arm.dry_run {
        return Err(bad_input!(
            "choose what to do with the wiggle: --csv FILE writes it, --arm ADDR or --controller NAME executes it, --evaluate reports its information"
        ));
    }
    if args.camera.camera.is_some() && !args.arm.dry_run {
        return wiggle_alone(args);
    }
    let address = reach_measured(&args.arm)?;
    let limits = limits(&args.arm, address.as_ref())?;
    let config = config::here::<PlannerConfig>(None).or_input()?.wiggle;
    let trajectory = wiggle(&config, &limits).or_failed()?;
    if let Some(path) = &args.csv {
        files::write_trajectory(path, &trajectory, limits.period_s()).or_failed()?;
        println!(
            "{:.2} s of joint positions in `{}`",
            trajectory.duration_s(),
            path.display()
        );
    }
    let run = if args.arm.names_arm() || args.arm.dry_run {
        drive(
            &args.arm,
            address,
            &limits,
            &trajectory,
            args.out.as_deref(),
            None,
        )?
    } else {
        None
    };
    Ok(Some(json!({
        "ok": true, "command": "wiggle", "csv": args.csv, "duration_s": trajectory.duration_s(), "run": run,
    })))
}
