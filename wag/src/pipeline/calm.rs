//! Taking the sway out of the rope: a move planned with the identified rope,
//! begun at the instant it was planned for.

use super::arm::{ArmLink, execute};
use super::observe::Film;
use crate::session::Session;
use anyhow::{anyhow, bail};
use arm_model::{JointTrajectory, JointVector, Limits};
use cli_output::Stage;
use rt_controller::os::now_ns;
use shared_types::ipc::message::{CalmOrder, PlannerEvent, PlannerRequest, PlannerRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::{MonotonicNs, RopeParams};
use std::time::Duration;

/// Time allowed for planning before the move begins (s); longer after a plan
/// that came too late. The rope sways down meanwhile: to wait spoils nothing.
const PLANNING_S: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// From the call to the first setpoint, on average (s): half a turn of the
/// controller's bridge and half a cycle.
const HANDOVER_S: f64 = 0.005;

/// What calming did.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Calmed {
    /// Simulated sway after a plain move (m).
    pub plain_sway_m: f64,
    /// Simulated sway after the move that was made (m).
    pub calm_sway_m: f64,
    /// How much later than planned the move began (s).
    pub late_s: f64,
}

/// What a calming move is planned from.
#[derive(Debug)]
pub struct CalmInput<'a> {
    /// The identified rope.
    pub rope: RopeParams,
    /// The film of the wiggle; the rope hung still at its first frame.
    pub film: &'a Film,
    /// Pose the arm holds (rad).
    pub start_q: JointVector,
    /// Pose to end in (rad).
    pub end_q: JointVector,
    /// Limits of the arm.
    pub limits: &'a Limits,
    /// How late the arm follows its setpoints (s).
    pub arm_lag_s: f64,
}

/// Plans a calming move and makes it.
pub fn calm(
    session: &mut Session,
    planner: &RpcClient<PlannerRpc>,
    arm: &ArmLink,
    input: &CalmInput<'_>,
    stage: &Stage,
) -> anyhow::Result<Calmed> {
    for planning_s in PLANNING_S {
        session.received.drain()?;
        let begin = MonotonicNs(now_ns()).plus_s(planning_s);
        let order = CalmOrder {
            rope: input.rope,
            joints: session
                .received
                .cycles
                .joints_between(input.film.first_stamp_ns, u64::MAX),
            start_ns: begin.plus_s(input.arm_lag_s).0,
            start_q: input.start_q,
            end_q: input.end_q,
            limits: input.limits.clone(),
        };
        stage.say("planning");
        let request = PlannerRequest::Calm(Box::new(order));
        let event = session.ask(planner, &request, Duration::from_secs(60), |_| ())?;
        let (trajectory, plain_sway_m, calm_sway_m) = match event {
            PlannerEvent::Calmed {
                trajectory,
                plain_sway_m,
                calm_sway_m,
            } => (trajectory, plain_sway_m, calm_sway_m),
            PlannerEvent::Failed { message } => bail!(message),
            other => bail!("the planner process answered with {other:?}"),
        };
        stage.say(format!("damping {:.1} cm of swing", 100.0 * plain_sway_m));
        if let Some(late_s) = begin_at(session, arm, &trajectory, begin)? {
            return Ok(Calmed {
                plain_sway_m,
                calm_sway_m,
                late_s,
            });
        }
    }
    Err(anyhow!(
        "planning a swing-damping move takes too long on this machine; stop other programs"
    ))
}

/// Streams `trajectory` from the instant `begin`; `None` when that has passed.
fn begin_at(
    session: &mut Session,
    arm: &ArmLink,
    trajectory: &JointTrajectory,
    begin: MonotonicNs,
) -> anyhow::Result<Option<f64>> {
    let left_s = begin.since_s(MonotonicNs(now_ns())) - HANDOVER_S;
    if left_s < 0.0 {
        return Ok(None);
    }
    session.idle(Duration::from_secs_f64((left_s - 0.03).max(0.0)))?;
    let left_s = (begin.since_s(MonotonicNs(now_ns())) - HANDOVER_S).max(0.0);
    std::thread::sleep(Duration::from_secs_f64(left_s));
    let span = execute(arm, trajectory)?.finish(session)?;
    Ok(Some(MonotonicNs(span.start_ns).since_s(begin)))
}
