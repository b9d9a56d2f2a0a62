//! Damping the rope's swing: a move planned with the identified rope,
//! begun at the instant it was planned for.

use super::arm::{ArmLink, execute};
use super::observe::Film;
use super::stages::{ask_planner, unexpected};
use crate::session::Session;
use anyhow::anyhow;
use arm_model::{Cell, JointTrajectory, JointVector, Limits};
use cli_output::Stage;
use planner::service::{PlannerEvent, PlannerRequest, PlannerRpc};
use planner::settle::{SettleConfig, SettleRequest};
use rt_controller::os::now_ns;
use shared_types::ipc::rpc::RpcClient;
use shared_types::{MonotonicNs, RopeParams};
use std::time::Duration;

/// Time allowed for planning before the move begins (s); longer after a plan
/// that came too late. The swing decays meanwhile: to wait spoils nothing.
const PLANNING_S: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// Time after which the planner's answer is not waited for any longer (s).
const ANSWER_S: f64 = 60.0;
/// From the call to the first setpoint, on average (s): half a turn of the
/// controller's bridge and half a cycle.
const HANDOVER_S: f64 = 0.005;

/// What the settling move did.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Settled {
    /// Simulated residual vibration of the tip after a plain move (m).
    pub plain_residual_m: f64,
    /// The same after the move that was made (m).
    pub residual_m: f64,
    /// How much later than planned the move began (s).
    pub late_s: f64,
}

/// What a settling move is planned from.
#[derive(Debug)]
pub struct SettleInput<'a> {
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
    /// The pole, and what stands around the arm.
    pub cell: Cell,
    /// Size of the move and of the search for it.
    pub config: &'a SettleConfig,
    /// How late the arm follows its setpoints (s).
    pub arm_lag_s: f64,
}

/// Plans a settling move and makes it.
pub fn settle(
    session: &mut Session,
    planner: &RpcClient<PlannerRpc>,
    arm: &ArmLink,
    input: &SettleInput<'_>,
    stage: &Stage,
) -> anyhow::Result<Settled> {
    for planning_s in PLANNING_S {
        session.received.drain()?;
        let begin = MonotonicNs(now_ns()).plus_s(planning_s);
        let joints = session
            .received
            .cycles
            .joints_between(input.film.first_stamp_ns, u64::MAX);
        let start = begin.plus_s(input.arm_lag_s);
        // The rope hangs still at the first joint sample.
        let epoch = joints
            .first()
            .map_or(start, |(stamp_ns, _)| MonotonicNs(*stamp_ns));
        let (times_s, q) = joints
            .iter()
            .map(|(stamp_ns, q)| (MonotonicNs(*stamp_ns).since_s(epoch), *q))
            .unzip();
        let request = SettleRequest {
            rope: input.rope,
            times_s,
            q,
            start_s: start.since_s(epoch),
            start_q: input.start_q,
            end_q: input.end_q,
            limits: input.limits.clone(),
            cell: input.cell,
            config: input.config.clone(),
        };
        stage.say("planning");
        let request = PlannerRequest::Settle(Box::new(request));
        let found = match ask_planner(session, planner, &request, ANSWER_S, stage)? {
            PlannerEvent::Settled(found) => found,
            other => return Err(unexpected("planner", &other)),
        };
        stage.say(format!(
            "damping {:.1} cm of swing",
            100.0 * found.plain_residual_m
        ));
        if let Some(late_s) = begin_at(session, arm, &found.trajectory, begin)? {
            return Ok(Settled {
                plain_residual_m: found.plain_residual_m,
                residual_m: found.residual_m,
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
