//! What an arm will make of a plan before it is sent: every rule it judges streamed
//! motion by, with what is left of it, where and when.
//!
//! The limits of [`Limits`] bound the curve itself, and the controller refuses a plan
//! that breaks one. The arm sees setpoints only, one per cycle, and has rules of its own:
//! joint range (C23), joint speed (C24), tool speed (C60), self collision (C22), safety
//! boundary (C35). They are judged here on the setpoints as they will stand on the wire,
//! or, by velocities, on the motion that follows from them.

mod rules;
mod velocity;

pub use rules::{Fence, FenceError, JudgedArm, Rule, RuleMargin};

use crate::collide::{ArmShape, tool_contacts};
use arm_model::{Cell, JointTrajectory, Limits};
use rules::Step;
use shared_types::CommandInterface;

/// One instant per cycle (s): the first is the start of a trajectory, the last its end.
fn cycles_s(trajectory: &JointTrajectory, period_s: f64) -> impl Iterator<Item = f64> {
    let cycles = (trajectory.duration_s() / period_s).ceil() as u32;
    (0..=cycles).map(move |k| f64::from(k) * period_s)
}

/// Everything the arm judges, in the order in which it does.
#[must_use]
pub fn arm_margins(
    trajectory: &JointTrajectory,
    limits: &Limits,
    arm: &JudgedArm,
) -> Vec<RuleMargin> {
    let steps = match arm.interface {
        CommandInterface::ServoPosition => cycles_s(trajectory, limits.period_s())
            .map(|time_s| {
                // The wire holds single precision.
                let setpoint = trajectory.state_at(time_s).q.map(|v| f64::from(v as f32));
                (time_s, Step::at(setpoint))
            })
            .collect(),
        CommandInterface::JointVelocity => velocity::steps(trajectory, limits),
    };
    let mut margins = arm.rules(limits);
    let mut before = None;
    for (time_s, mut step) in steps {
        step.before = before.replace(step.setpoint).unwrap_or(step.setpoint);
        for margin in &mut margins {
            let found = margin.rule.value(&step, limits, arm);
            margin.meet(found, time_s);
        }
    }
    margins
}

/// The rule that stops the arm first, if any does.
#[must_use]
pub fn first_stop(margins: &[RuleMargin]) -> Option<&RuleMargin> {
    let broken = margins.iter().filter(|m| m.broken_s.is_some());
    // Of rules broken by one setpoint the arm finds the earlier one.
    broken.min_by(|a, b| {
        let at = |m: &RuleMargin| m.broken_s.unwrap_or(f64::INFINITY);
        at(a).total_cmp(&at(b))
    })
}

/// When pole or wrist first come to arm, column or floor (s), which the arm's own rules do not
/// know of; looked at once per `period_s`.
#[must_use]
pub fn tool_contact_s(trajectory: &JointTrajectory, cell: &Cell, period_s: f64) -> Option<f64> {
    cycles_s(trajectory, period_s).find(|t| {
        let arm = ArmShape::at(&trajectory.state_at(*t).q, &cell.pole);
        !tool_contacts(&arm, cell).none()
    })
}

#[cfg(test)]
mod tests;
