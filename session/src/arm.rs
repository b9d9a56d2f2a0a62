//! Asking the controller: bring-up, moves, trajectories, latencies.

use crate::Session;
use anyhow::{anyhow, ensure};
use arm_model::{JointTrajectory, JointVector};
use rt_controller::os::now_ns;
use run_log::MotionSpan;
use serde_json::{Value, json};
use shared_types::ipc::ControllerMode;
use shared_types::ipc::message::{
    ControllerEvent, ControllerRequest, ControllerRpc, LatencyReport,
};
use shared_types::ipc::rpc::RpcClient;
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, MonotonicNs, OperatingMode};

/// Longest move to a start pose: at set-up speed a far one takes its time.
const MOVED_WITHIN_S: f64 = 600.0;

/// The controller, to be asked.
pub type ArmLink = RpcClient<ControllerRpc>;

/// What the controller did not begin.
#[derive(Debug, thiserror::Error)]
#[error("the controller refused {what} ({fault:?}): {message}")]
pub struct Refused {
    what: String,
    fault: FaultCode,
    message: String,
}

impl Refused {
    /// Whether an error is one of a motion that would have begun too late.
    #[must_use]
    pub fn is_late(error: &anyhow::Error) -> bool {
        let refused = error.downcast_ref::<Self>();
        refused.is_some_and(|refused| refused.fault == FaultCode::ArmingExpired)
    }
}

/// The error of an event that ends a request badly; a [`Refused`] where nothing moved for it.
pub fn refusal(what: &str, event: &ControllerEvent) -> anyhow::Error {
    match event {
        ControllerEvent::Refused { fault, message } => anyhow::Error::new(Refused {
            what: what.to_owned(),
            fault: *fault,
            message: message.clone(),
        }),
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

/// Asks for a motion and waits for its end.
fn motion(
    session: &mut Session,
    arm: &ArmLink,
    what: &str,
    request: &ControllerRequest,
    within_s: f64,
) -> anyhow::Result<MotionSpan> {
    session.await_hold()?;
    let event = session.ask(arm, request, within_s, |_| ());
    session.end_hold();
    match event? {
        ControllerEvent::Finished { start_ns, end_ns } => Ok(MotionSpan { start_ns, end_ns }),
        other => Err(refusal(what, &other)),
    }
}

/// What a bring-up found.
#[derive(Debug, Default)]
pub struct BringUp {
    /// Each step and its result: versions, settings as read, errors that were cleared.
    pub steps: Vec<(String, String)>,
    /// What the operator should know: real-time properties that could not be had, settings of
    /// the arm that are allowed but unwise.
    pub warnings: Vec<String>,
}

impl BringUp {
    /// The steps as a summary contains them.
    pub fn steps_json(&self) -> Vec<Value> {
        let step = |(step, result): &(String, String)| json!({ "step": step, "result": result });
        self.steps.iter().map(step).collect()
    }
}

/// Takes the operator's place, connects the arm and enables it; what was `found` on the way,
/// also when it is refused.
pub fn acquire(session: &mut Session, arm: &ArmLink, found: &mut BringUp) -> anyhow::Result<()> {
    session.take_operator()?;
    enable(session, arm, false, found)
}

/// Enables the arm; after a stop only where the operator `acknowledges` it.
pub fn enable(
    session: &mut Session,
    arm: &ArmLink,
    acknowledges: bool,
    found: &mut BringUp,
) -> anyhow::Result<()> {
    let bring_up = match session.ask(arm, &ControllerRequest::Status, 5.0, |_| ())? {
        ControllerEvent::Status {
            mode: ControllerMode::Faulted,
            fault,
            ..
        } => {
            ensure!(acknowledges, crate::has_stopped(fault));
            ControllerRequest::Acknowledge
        }
        _ => ControllerRequest::Bringup,
    };
    let done = session.ask(arm, &bring_up, 20.0, |event| {
        if let ControllerEvent::Step { name, result } = event {
            found.steps.push((name.clone(), result.clone()));
        }
    })?;
    let is_done = done == ControllerEvent::Done;
    ensure!(is_done, refusal("to bring up the arm", &done));
    match session.ask(arm, &ControllerRequest::Status, 5.0, |_| ())? {
        ControllerEvent::Status { warnings, .. } => {
            found.warnings = warnings;
            Ok(())
        }
        other => Err(refusal("to report its state", &other)),
    }
}

/// Arms the controller for motions of an operating mode. For a wiggle or a throw the operator
/// has confirmed at `confirmed_ns` that the area is clear, or the arm is simulated.
pub fn arm_for(
    session: &mut Session,
    arm: &ArmLink,
    operating_mode: OperatingMode,
    confirmed_ns: Option<u64>,
) -> anyhow::Result<()> {
    arm_with(
        session,
        arm,
        &ControllerRequest::Arm {
            operating_mode,
            confirmed_ns,
            begins_by_ns: None,
        },
    )
}

/// Arms for a throw that begins by an instant or not at all.
pub fn arm_to_throw_by(
    session: &mut Session,
    arm: &ArmLink,
    confirmed_ns: u64,
    begins_by: MonotonicNs,
) -> anyhow::Result<()> {
    arm_with(
        session,
        arm,
        &ControllerRequest::Arm {
            operating_mode: OperatingMode::Throw,
            confirmed_ns: Some(confirmed_ns),
            begins_by_ns: Some(begins_by.0),
        },
    )
}

fn arm_with(
    session: &mut Session,
    arm: &ArmLink,
    request: &ControllerRequest,
) -> anyhow::Result<()> {
    let event = session.ask(arm, request, 5.0, |_| ())?;
    ensure!(event == ControllerEvent::Done, refusal("to arm", &event));
    Ok(())
}

/// The same for a simulated arm, which is in nobody's way.
pub fn arm_simulated(
    session: &mut Session,
    arm: &ArmLink,
    operating_mode: OperatingMode,
) -> anyhow::Result<()> {
    arm_for(session, arm, operating_mode, Some(now_ns()))
}

/// Moves jerk-limited to a pose.
pub fn move_to(
    session: &mut Session,
    arm: &ArmLink,
    q: JointVector,
    speed_fraction: f64,
) -> anyhow::Result<MotionSpan> {
    let request = ControllerRequest::MoveTo { q, speed_fraction };
    let what = "the move to the start pose";
    motion(session, arm, what, &request, MOVED_WITHIN_S)
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
