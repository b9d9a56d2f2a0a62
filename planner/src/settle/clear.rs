//! Room around rope and tool during a move.

use super::residual::{Residual, ResidualSimulator};
use crate::collide::{ArmShape, RopeShape, rope_clearance_m, tool_contacts};
use arm_model::JointTrajectory;
use nalgebra::Vector3;
use shared_types::RopeParams;

/// Nearest approaches during a move and the swing after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// Smallest gap between rope and arm or column (m).
    pub(super) rope_gap_m: f64,
    /// Whether the tool side of the arm touches anything.
    pub(super) tool_touches: bool,
}

/// Looks at every frame of the simulated rope.
pub(super) fn room(
    rope: &RopeParams,
    simulator: &ResidualSimulator<'_>,
    trajectory: &JointTrajectory,
    residual: &Residual,
) -> Room {
    let cell = &simulator.prelude.cell;
    let shape = RopeShape::from(rope);
    let mut out = Room {
        rope_gap_m: f64::INFINITY,
        tool_touches: false,
    };
    for frame in 0..residual.nodes.frames() {
        let q = trajectory.state_at(Residual::time_s(frame)).q + simulator.prelude.standing_error;
        let arm = ArmShape::at(&q, &cell.pole);
        let nodes: Vec<Vector3<f64>> = (0..residual.nodes.nodes())
            .map(|n| residual.nodes.position(frame, n))
            .collect();
        out.rope_gap_m = out
            .rope_gap_m
            .min(rope_clearance_m(&arm, cell, &shape, &nodes));
        out.tool_touches |= !tool_contacts(&arm, cell).none();
    }
    out
}
