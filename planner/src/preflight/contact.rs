//! Contacts that the arm's own rules do not know of.

use crate::collide::{ArmShape, tool_contacts};
use arm_model::{Cell, JointTrajectory};

/// When pole or wrist first come to arm, column or floor (s), which the arm would only
/// feel; looked at once per `period_s`.
#[must_use]
pub fn tool_contact_s(trajectory: &JointTrajectory, cell: &Cell, period_s: f64) -> Option<f64> {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a trajectory lasts at most ten minutes"
    )]
    let cycles = (trajectory.duration_s() / period_s).ceil() as u32;
    (0..=cycles).map(|k| f64::from(k) * period_s).find(|t| {
        let arm = ArmShape::at(&trajectory.state_at(*t).q, &cell.pole);
        !tool_contacts(&arm, cell).none()
    })
}
