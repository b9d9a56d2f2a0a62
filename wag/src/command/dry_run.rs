//! What a motion on an arm would do, told without one.

use super::check::print_tightest;
use crate::cli::ArmArgs;
use crate::config;
use crate::pipeline::ArmAddress;
use arm_model::limits::TOOL_SPEED_RATED_M_S;
use arm_model::{JointTrajectory, Limits};
use cli_output::{OrInput, Outcome};
use planner::preflight::{JudgedArm, arm_margins, first_stop};
use rt_controller::ControllerConfig;
use serde_json::{Value, json};
use shared_types::CommandInterface;

/// The command interface by which a motion would reach the arm.
pub fn interface_to(address: Option<&ArmAddress>) -> Outcome<CommandInterface> {
    match address.and_then(|address| address.service.as_ref()) {
        Some(service) => Ok(service.config.command_interface),
        None => {
            let config = config::here::<ControllerConfig>(None).or_input()?;
            Ok(config.command_interface)
        }
    }
}

/// Refuses a trajectory that keeps the limits but that the arm would stop by a rule of its own,
/// set up as a bring-up requires: its tool may be as fast as the limits allow.
pub fn refuse_stopped(
    address: Option<&ArmAddress>,
    limits: &Limits,
    trajectory: &JointTrajectory,
    name: &str,
) -> Outcome {
    let delivered = JudgedArm::default();
    let set_up = delivered.speed_factor.max(limits.tcp_speed_max_m_s);
    let judge = JudgedArm {
        interface: interface_to(address)?,
        speed_factor: set_up.min(TOOL_SPEED_RATED_M_S),
        ..delivered
    };
    let judged = arm_margins(trajectory, limits, &judge);
    if let Some(stop) = first_stop(&judged) {
        let by = stop.rule.code().map_or_else(
            || "the controller".to_owned(),
            |code| format!("the arm, with C{code}"),
        );
        return Err(failed!(
            "the {name} keeps the limits but would be stopped by {by}: {}",
            stop.describe()
        ));
    }
    Ok(())
}

/// Tells step by step what `wag` would do with a trajectory that may be sent.
pub fn tell(
    arm: &ArmArgs,
    limits: &Limits,
    trajectory: &JointTrajectory,
    name: &str,
) -> Outcome<Value> {
    let margins = limits.margins(trajectory);
    let duration_s = trajectory.duration_s();
    let address = arm
        .address
        .map_or_else(|| "the arm named with --arm".to_owned(), |a| a.to_string());
    let start = trajectory.start();
    let start: Vec<String> = start.iter().map(|q| format!("{q:.3}")).collect();
    println!(
        "dry run: nothing is connected, nothing moves. Without --dry-run wag would\n  \
             1. ask whether the area is clear, unless --yes says so or the arm is simulated\n  \
             2. connect to {address} (ports {}, {}, {}), read its settings and compare them with the limits; a real arm must have been measured (`wag latency`)\n  \
             3. move it at set-up speed to the start pose {} rad\n  \
             4. ask again, unless the arm is simulated: a word typed in the start pose confirms\n  \
             5. arm it for one {name} and send it for {duration_s:.2} s, {:.0} setpoints a second\n  \
             6. disarm it, and keep the record of every cycle in the run's folder",
        arm.ports.command_port,
        arm.ports.report_port,
        arm.ports.status_port,
        start.join(", "),
        1.0 / limits.period_s(),
    );
    let tightest = print_tightest(&margins);
    Ok(json!({
        "dry_run": true, "duration_s": duration_s, "start_rad": trajectory.start(), "interface": interface_to(None)?,
        "tightest": tightest,
    }))
}
