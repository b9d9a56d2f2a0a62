//! Asking the controller: bring-up, moves, trajectories, latencies.

use crate::session::Session;
use anyhow::{anyhow, ensure};
use arm_model::{JointTrajectory, JointVector};
use shared_types::OperatingMode;
use shared_types::ipc::message::{
    ControllerEvent, ControllerRequest, ControllerRpc, LatencyReport,
};
use shared_types::ipc::rpc::RpcClient;
use shared_types::plan::trajectory_hash;

pub type ArmLink = RpcClient<ControllerRpc>;

/// When a motion ran (CLOCK_MONOTONIC, ns).
#[derive(Debug, Clone, Copy, Default)]
pub struct MotionSpan {
    /// Deadline of the first setpoint.
    pub start_ns: u64,
    /// Deadline of the last setpoint.
    pub end_ns: u64,
}

/// The error of an event that ends a request badly.
fn refusal(what: &str, event: &ControllerEvent) -> anyhow::Error {
    match event {
        ControllerEvent::Refused { fault, message } => {
            anyhow!("the controller refused {what} ({fault:?}): {message}")
        }
        ControllerEvent::Stopped {
            fault,
            cycle,
            arm_error,
            message,
        } => {
            let arm = if *arm_error == 0 {
                String::new()
            } else {
                format!(", arm error C{arm_error}")
            };
            anyhow!("the controller stopped {what} in cycle {cycle} ({fault:?}{arm}): {message}")
        }
        other => anyhow!("the controller answered {what} with {other:?}"),
    }
}

/// Asks for what is simply done.
fn command(
    session: &mut Session,
    arm: &ArmLink,
    what: &str,
    request: &ControllerRequest,
    within_s: f64,
) -> anyhow::Result<()> {
    let event = session.ask(arm, request, within_s, |_| ())?;
    ensure!(event == ControllerEvent::Done, refusal(what, &event));
    Ok(())
}

/// Asks for a motion and waits for its end.
fn motion(
    session: &mut Session,
    arm: &ArmLink,
    what: &str,
    request: &ControllerRequest,
    within_s: f64,
) -> anyhow::Result<MotionSpan> {
    match session.ask(arm, request, within_s, |_| ())? {
        ControllerEvent::Finished { start_ns, end_ns } => Ok(MotionSpan { start_ns, end_ns }),
        other => Err(refusal(what, &other)),
    }
}

/// Takes the operator's place, connects the arm and enables it. Returns what
/// the controller's real-time set-up could not get.
pub fn acquire(session: &mut Session, arm: &ArmLink) -> anyhow::Result<Vec<String>> {
    session.take_operator()?;
    let bring_up = ControllerRequest::Bringup;
    command(session, arm, "to bring up the arm", &bring_up, 20.0)?;
    match session.ask(arm, &ControllerRequest::Status, 5.0, |_| ())? {
        ControllerEvent::Status { warnings, .. } => Ok(warnings),
        other => Err(refusal("to report its state", &other)),
    }
}

/// Arms the controller for motions of an operating mode. Whoever calls this has made sure
/// that the area is clear, or that the arm is simulated.
pub fn arm_for(
    session: &mut Session,
    arm: &ArmLink,
    operating_mode: OperatingMode,
) -> anyhow::Result<()> {
    let request = ControllerRequest::Arm {
        operating_mode,
        area_clear: true,
    };
    command(session, arm, "to arm", &request, 5.0)
}

/// Moves jerk-limited to a pose.
pub fn move_to(
    session: &mut Session,
    arm: &ArmLink,
    q: JointVector,
    speed_fraction: f64,
) -> anyhow::Result<MotionSpan> {
    let request = ControllerRequest::MoveTo { q, speed_fraction };
    motion(session, arm, "the move to the start pose", &request, 60.0)
}

/// Streams a trajectory to its end.
pub fn execute(
    session: &mut Session,
    arm: &ArmLink,
    trajectory: &JointTrajectory,
) -> anyhow::Result<MotionSpan> {
    let request = ControllerRequest::Execute {
        trajectory: Box::new(*trajectory),
        sha256: trajectory_hash(trajectory),
    };
    let within_s = trajectory.duration_s() + 10.0;
    motion(session, arm, "the trajectory", &request, within_s)
}

/// Latency histograms of the control loop since the last call.
pub fn latency(session: &mut Session, arm: &ArmLink) -> anyhow::Result<LatencyReport> {
    match session.ask(arm, &ControllerRequest::Latency, 5.0, |_| ())? {
        ControllerEvent::Latency(report) => Ok(*report),
        other => Err(refusal("to report latencies", &other)),
    }
}
