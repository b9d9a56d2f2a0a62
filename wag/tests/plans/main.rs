//! Plans on the simulated arm in virtual time: it does what the preflight says, and
//! throws planned through its response meet their targets.
#![cfg(test)]

mod preflight;
mod response;

use arm_model::{JointTrajectory, Limits};
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlSettings, Motion};
use xarm_sim::{ArmConfig, ArmEvent, FaultScript};

/// Runs longer checks.
fn long_tests() -> bool {
    std::env::var_os("WAG_LONG_TESTS").is_some()
}

/// A rig whose arm stands at the start of a plan and has run it.
fn run(
    plan: &JointTrajectory,
    limits: &Limits,
    settings: ControlSettings,
    arm: ArmConfig,
) -> VirtualRig {
    let mut rig = VirtualRig::new(VirtualRigConfig {
        limits: limits.clone(),
        settings,
        arm: ArmConfig {
            initial_q: plan.start(),
            ..arm
        },
        ..VirtualRigConfig::new(settings, FaultScript::default())
    });
    rig.bring_up().unwrap();
    // The encoders tell the start in steps of 10 µrad.
    let off = rig.commanded() - plan.start();
    let waypoints: Vec<_> = plan.waypoints().iter().map(|q| *q + off).collect();
    let plan = JointTrajectory::new(plan.times_s(), &waypoints).unwrap();
    rig.start(Motion::Spline(plan));
    rig.run_for(plan.duration_s() + 0.3);
    rig
}

/// The first error code the arm raised.
fn arm_error(rig: &VirtualRig) -> Option<u8> {
    rig.log.arm_events.iter().find_map(|e| match e.event {
        ArmEvent::Error(code) => Some(code.0),
        _ => None,
    })
}
