//! What a wiggle or a throw must keep before it is sent.

use super::dry_run::refuse_stopped;
use crate::config;
use crate::pipeline::ArmAddress;
use arm_model::{JOINTS, JointTrajectory, Limits};
use cli_output::{OrInput, Outcome};
use rt_controller::armed_speed::ArmedSpeed;
use rt_controller::control::{Motion, OperatingModeSpeeds};
use shared_types::OperatingMode;

/// Its name, and the word that confirms it.
pub const fn words(operating_mode: OperatingMode) -> (&'static str, &'static str) {
    match operating_mode {
        OperatingMode::Throw => ("throw", "THROW"),
        OperatingMode::Wiggle | OperatingMode::SetUp => ("wiggle", "WIGGLE"),
    }
}

/// Refuses one that breaks a limit, is too fast for what the arm is armed for, or would be
/// stopped by the arm itself.
pub fn check(
    address: Option<&ArmAddress>,
    limits: &Limits,
    trajectory: &JointTrajectory,
    operating_mode: OperatingMode,
) -> Outcome {
    let (name, _) = words(operating_mode);
    if let Some(worst) = limits.worst_violation(trajectory) {
        return Err(bad_input!(
            "the {name} breaks a limit: {}",
            worst.describe()
        ));
    }
    let pole = config::cell().or_input()?.pole;
    let armed = ArmedSpeed {
        armed: operating_mode,
        limits,
        pole: &pole,
        speeds: OperatingModeSpeeds::default(),
    };
    let slow_enough = armed.check(&Motion::Spline(*trajectory));
    slow_enough.map_err(|why| bad_input!("the {name} is too fast: {why}"))?;
    refuse_stopped(address, limits, trajectory, name)
}

/// Refuses a motion of a real arm in joints of which nobody knows how they follow.
pub fn require_measured_joints(
    address: &ArmAddress,
    trajectory: &JointTrajectory,
    operating_mode: OperatingMode,
) -> Outcome {
    let (name, _) = words(operating_mode);
    let Some((path, response)) = address.arm_response.as_ref().filter(|_| !address.simulated)
    else {
        return Ok(());
    };
    let moves = |j: usize| {
        let way = trajectory.extrema(j);
        way.q_max.value - way.q_min.value > STILL_RAD
    };
    let unknown: Vec<String> = (0..JOINTS)
        .filter(|j| moves(*j) && response.joints[*j].lag().is_none())
        .map(|j| (j + 1).to_string())
        .collect();
    if unknown.is_empty() {
        return Ok(());
    }
    Err(bad_input!(
        "the {name} moves joint {}, of which `{}` does not tell how it follows: measure it with `wag latency --arm {} --excitation FILE` in a pose where it may move fast enough",
        unknown.join(", "),
        path.display(),
        address.ip
    ))
}

/// Joints that move by less stand still to the controller's monitors (rad).
const STILL_RAD: f64 = 0.02;
