//! What an arm will make of a plan before it is sent: every rule it judges streamed
//! motion by, with what is left of it, where and when.
//!
//! The limits of [`Limits`] bound the curve itself, and the controller refuses a plan
//! that breaks one. The arm sees setpoints only, one per cycle, and has rules of its own:
//! joint range (C23), joint speed (C24), tool speed (C60), self collision (C22), safety
//! boundary (C35). They are judged here on the setpoints as they will stand on the wire,
//! or, by velocities, on the motion that follows from them.

mod contact;
mod rules;
mod setpoints;
mod velocity;

pub use contact::tool_contact_s;
pub use rules::{Fence, FenceError, JudgedArm, Rule, RuleMargin};

use arm_model::{JointTrajectory, Limits};
use rules::Step;
use setpoints::setpoints;
use shared_types::CommandInterface;

/// Everything the arm judges, in the order in which it does.
#[must_use]
pub fn arm_margins(
    trajectory: &JointTrajectory,
    limits: &Limits,
    arm: &JudgedArm,
) -> Vec<RuleMargin> {
    let mut margins = arm.rules(limits);
    let mut before = None;
    let mut judge = |time_s: f64, step: &mut Step| {
        step.before = before.replace(step.setpoint).unwrap_or(step.setpoint);
        for margin in &mut margins {
            let found = margin.rule.value(step, limits, arm);
            margin.meet(found, time_s);
        }
    };
    match arm.interface {
        CommandInterface::ServoPosition => {
            for (time_s, setpoint) in setpoints(trajectory, limits.period_s()) {
                judge(time_s, &mut Step::at(setpoint));
            }
        }
        CommandInterface::JointVelocity => {
            for cycle in velocity::cycles(trajectory, limits) {
                let mut step = Step {
                    q: cycle.q,
                    astray_rad: cycle.astray_rad,
                    ..Step::at(cycle.planned)
                };
                judge(cycle.time_s, &mut step);
            }
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

#[cfg(test)]
mod tests;
