//! The setpoints of a plan as they stand on the wire.

use arm_model::{JointTrajectory, JointVector};

/// One setpoint per cycle (s, rad): the first is the start, the last the end.
pub(super) fn setpoints(
    trajectory: &JointTrajectory,
    period_s: f64,
) -> impl Iterator<Item = (f64, JointVector)> + '_ {
    let cycles = (trajectory.duration_s() / period_s).ceil() as u32;
    (0..=cycles).map(move |k| {
        let time_s = f64::from(k) * period_s;
        (time_s, on_the_wire(trajectory.state_at(time_s).q))
    })
}

/// The wire holds single precision.
fn on_the_wire(q: JointVector) -> JointVector {
    q.map(|v| f64::from(v as f32))
}
