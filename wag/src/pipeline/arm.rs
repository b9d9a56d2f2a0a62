//! Asking the controller: bring-up, moves, trajectories, latencies.

use crate::session::Session;
use anyhow::{anyhow, bail, ensure};
use arm_model::{JointTrajectory, JointVector};
use shared_types::OperatingMode;
use shared_types::ipc::message::{
    ControllerEvent, ControllerRequest, ControllerRpc, LatencyReport,
};
use shared_types::ipc::rpc::{Pending, RpcClient};
use shared_types::plan::trajectory_hash;
use std::time::Duration;

/// A connection to the controller.
pub type ArmLink = RpcClient<ControllerRpc>;

/// When a motion ran (CLOCK_MONOTONIC, ns).
#[derive(Debug, Clone, Copy)]
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
        ControllerEvent::Status { .. }
        | ControllerEvent::Step { .. }
        | ControllerEvent::Started { .. }
        | ControllerEvent::Finished { .. }
        | ControllerEvent::Done
        | ControllerEvent::Latency(_) => anyhow!("the controller answered {what} with {event:?}"),
    }
}

/// Takes the operator's place, connects the arm and enables it. Returns what
/// the controller's real-time set-up could not get.
pub fn acquire(session: &mut Session, arm: &ArmLink) -> anyhow::Result<Vec<String>> {
    session.take_operator()?;
    let done = session.ask(
        arm,
        &ControllerRequest::Bringup,
        Duration::from_secs(20),
        |_| (),
    )?;
    ensure!(
        done == ControllerEvent::Done,
        refusal("to bring up the arm", &done)
    );
    let status = session.ask(
        arm,
        &ControllerRequest::Status,
        Duration::from_secs(5),
        |_| (),
    )?;
    match status {
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
    let done = session.ask(arm, &request, Duration::from_secs(5), |_| ())?;
    ensure!(done == ControllerEvent::Done, refusal("to arm", &done));
    Ok(())
}

fn span(what: &str, event: &ControllerEvent) -> anyhow::Result<MotionSpan> {
    match event {
        ControllerEvent::Finished { start_ns, end_ns } => Ok(MotionSpan {
            start_ns: *start_ns,
            end_ns: *end_ns,
        }),
        other => Err(refusal(what, other)),
    }
}

/// Moves jerk-limited to a pose.
pub fn move_to(
    session: &mut Session,
    arm: &ArmLink,
    q: JointVector,
    speed_part: f64,
) -> anyhow::Result<MotionSpan> {
    let request = ControllerRequest::MoveTo { q, speed_part };
    let event = session.ask(arm, &request, Duration::from_secs(60), |_| ())?;
    span("the move to the start pose", &event)
}

/// A trajectory being streamed.
pub struct Streaming {
    pending: Pending<ControllerRpc>,
    duration_s: f64,
}

/// Hands a trajectory over and returns as soon as the controller has it.
pub fn execute(arm: &ArmLink, trajectory: &JointTrajectory) -> anyhow::Result<Streaming> {
    let request = ControllerRequest::Execute {
        trajectory: Box::new(*trajectory),
        sha256: trajectory_hash(trajectory),
    };
    Ok(Streaming {
        pending: arm.call(&request)?,
        duration_s: trajectory.duration_s(),
    })
}

impl Streaming {
    /// Waits for the end of the motion.
    pub fn finish(self, session: &mut Session) -> anyhow::Result<MotionSpan> {
        let timeout = Duration::from_secs_f64(self.duration_s + 10.0);
        let event = session.finish(&self.pending, timeout, |_| ())?;
        span("the trajectory", &event)
    }

    /// The same for a throw: the plan lies in the controller whole, so planner and
    /// camera may die meanwhile. Their death is an error afterwards.
    pub fn finish_committed(self, session: &mut Session) -> anyhow::Result<MotionSpan> {
        let timeout = Duration::from_secs_f64(self.duration_s + 10.0);
        let event = session.finish_committed(&self.pending, timeout)?;
        span("the trajectory", &event)
    }
}

/// Latency histograms of the control loop since the last call.
pub fn latency(session: &mut Session, arm: &ArmLink) -> anyhow::Result<LatencyReport> {
    match session.ask(
        arm,
        &ControllerRequest::Latency,
        Duration::from_secs(5),
        |_| (),
    )? {
        ControllerEvent::Latency(report) => Ok(*report),
        other => bail!(refusal("to report latencies", &other)),
    }
}
