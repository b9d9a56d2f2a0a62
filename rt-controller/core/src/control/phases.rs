//! Motions made of phases of constant jerk: brakes and point-to-point moves.
//!
//! Such a motion is a short list of numbers per joint, so it is computed
//! before it is needed, copied without allocation and evaluated in bounded
//! time at any instant.

use arm_model::{JOINTS, JointState, JointVector};
use serde::{Deserialize, Serialize};

/// Most phases of one joint: seven of a point-to-point profile.
pub const MAX_PHASES: usize = 7;

/// A phase of constant jerk of one joint.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Phase {
    /// Duration (s).
    pub duration_s: f64,
    /// Jerk (rad/s³).
    pub jerk_rad_s3: f64,
}

/// Position (rad), velocity (rad/s) and acceleration (rad/s²) of one joint.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AxisState {
    /// Position (rad).
    pub q: f64,
    /// Velocity (rad/s).
    pub qd: f64,
    /// Acceleration (rad/s²).
    pub qdd: f64,
}

impl AxisState {
    /// Of joint `j` (0-based).
    pub(super) fn of(state: &JointState, j: usize) -> Self {
        Self {
            q: state.q[j],
            qd: state.qd[j],
            qdd: state.qdd[j],
        }
    }

    /// State after `t_s` of constant jerk.
    fn after(self, t_s: f64, jerk_rad_s3: f64) -> Self {
        Self {
            q: self.q + t_s * (self.qd + t_s * (self.qdd / 2.0 + t_s * jerk_rad_s3 / 6.0)),
            qd: self.qd + t_s * (self.qdd + t_s * jerk_rad_s3 / 2.0),
            qdd: self.qdd + t_s * jerk_rad_s3,
        }
    }
}

/// Phases of one joint that end at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AxisPhases {
    start: AxisState,
    phases: [Phase; MAX_PHASES],
}

impl AxisPhases {
    /// Phases from `start`; missing ones have no duration.
    #[must_use]
    pub fn new(start: AxisState, phases: [Phase; MAX_PHASES]) -> Self {
        Self { start, phases }
    }

    /// Time until rest (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.phases.iter().map(|p| p.duration_s).sum()
    }

    /// State at `t_s` after the start; at rest after the end. RT-safe.
    #[must_use]
    pub fn state_at(&self, t_s: f64) -> AxisState {
        let mut state = self.start;
        let mut left_s = t_s.max(0.0);
        for phase in &self.phases {
            if left_s < phase.duration_s {
                return state.after(left_s, phase.jerk_rad_s3);
            }
            state = state.after(phase.duration_s, phase.jerk_rad_s3);
            left_s -= phase.duration_s;
        }
        AxisState {
            qd: 0.0,
            qdd: 0.0,
            ..state
        }
    }

    /// Smallest and largest position on the way (rad). RT-safe.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        let mut state = self.start;
        let mut range = (state.q, state.q);
        let include = |q: f64, range: &mut (f64, f64)| *range = (range.0.min(q), range.1.max(q));
        for phase in &self.phases {
            for t_s in turning_points(state, phase.jerk_rad_s3) {
                if t_s > 0.0 && t_s < phase.duration_s {
                    include(state.after(t_s, phase.jerk_rad_s3).q, &mut range);
                }
            }
            state = state.after(phase.duration_s, phase.jerk_rad_s3);
            include(state.q, &mut range);
        }
        range
    }
}

/// When the velocity `qd + qdd t + jerk t²/2` is zero (s); NaN where it never is.
fn turning_points(at: AxisState, jerk: f64) -> [f64; 2] {
    let root = arm_model::exact::sqrt(at.qdd * at.qdd - 2.0 * jerk * at.qd);
    let far = -(at.qdd + root.copysign(at.qdd));
    [far / jerk, 2.0 * at.qd / far]
}

/// Phases of all joints. RT-safe to copy and evaluate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PhasedMotion {
    axes: [AxisPhases; JOINTS],
}

impl PhasedMotion {
    /// From the phases of each joint, joint 1 first.
    #[must_use]
    pub const fn new(axes: [AxisPhases; JOINTS]) -> Self {
        Self { axes }
    }

    /// Calls `each` with every number that decides the motion. RT-safe.
    pub fn each_number(&self, mut each: impl FnMut(f64)) {
        for axis in &self.axes {
            [axis.start.q, axis.start.qd, axis.start.qdd]
                .into_iter()
                .for_each(&mut each);
            for phase in &axis.phases {
                each(phase.duration_s);
                each(phase.jerk_rad_s3);
            }
        }
    }

    /// Time until every joint rests (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.axes
            .iter()
            .map(AxisPhases::duration_s)
            .fold(0.0, f64::max)
    }

    /// Joint state at `t_s` after the start; at rest after the end. RT-safe.
    #[must_use]
    pub fn state_at(&self, t_s: f64) -> JointState {
        let axes = self.axes.map(|axis| axis.state_at(t_s));
        JointState {
            q: JointVector(axes.map(|a| a.q)),
            qd: JointVector(axes.map(|a| a.qd)),
            qdd: JointVector(axes.map(|a| a.qdd)),
        }
    }
}
