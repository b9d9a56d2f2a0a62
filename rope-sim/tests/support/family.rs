//! A throw whose slopes are looked at.

use arm_model::{JointTrajectory, JointVector, Pole};
use rope_sim::sensitivity::Sensitivity;
use rope_sim::{FrameTimes, PlannedArm, Precision, SimOptions, Start, Watch};
use shared_types::RopeParams;

/// Where the lead is watched (m).
pub(crate) const TARGET: [f64; 3] = [0.45, 0.1, 0.05];

/// A soft rope whose links' inertia follows from the extra scale.
pub(crate) fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 0.8])
}

/// A throw whose middle waypoint is moved by `offset` at joint 2 (rad).
pub(crate) fn throw(offset: f64) -> PlannedArm {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.2, -0.3 + offset, 0.2, 0.8, -0.2, 1.2, 0.3]),
        JointVector([0.1, -0.5, 0.1, 1.0, 0.1, 1.6, -0.2]),
    ];
    PlannedArm::new(
        JointTrajectory::new(&[0.0, 0.2137, 0.4511], &waypoints).unwrap(),
        Pole::default(),
    )
}

/// Double precision with frames, approach and final state.
pub(crate) fn options() -> SimOptions {
    SimOptions {
        step_s: 5e-4,
        precision: Precision::F64,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 0.05,
            count: 13,
        },
        watch: Watch {
            final_state: true,
            ..Watch::point(TARGET)
        },
        horizon_s: 0.6,
        threads: 1,
    }
}

/// Slopes of all nodes in one direction.
pub(crate) fn numbers(s: &Sensitivity, direction: usize) -> Vec<f64> {
    s.nodes(direction).unwrap().to_f64()
}

/// Largest magnitude.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |m, x| m.max(x.abs()))
}
