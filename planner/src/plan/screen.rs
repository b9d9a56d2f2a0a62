//! Rejection of candidates that the arm may not execute.
//!
//! The limits are those of [`Limits`], checked on exact extrema of the spline.
//! Where the knot times are fixed, a candidate's second derivatives are one
//! small matrix times its knots; a rejected draw costs well under a microsecond.

use super::waypoints::{WAYPOINTS, WaypointSpace};
use arm_model::kinematics;
use arm_model::{Cell, JOINTS, JointState, JointTrajectory, Limits};
use nalgebra::{Matrix4, Vector3, Vector4};

/// Distances the tool keeps from the cell (m).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Clearance {
    /// Smallest distance of flange and pole end to floor and column (m).
    pub tool_m: f64,
}

impl Default for Clearance {
    fn default() -> Self {
        Self { tool_m: 0.05 }
    }
}

/// Fraction of each limit that plans use; the rest is left for the controller's
/// own filtering and for rounding.
const LIMIT_FRACTION: f64 = 0.985;
/// Steps at which tool speed and clearance are looked at: coarse first, because
/// most bad candidates already fail there (s).
const TOOL_STEPS_S: [f64; 2] = [0.06, 0.012];

/// Checks candidates of one [`WaypointSpace`] against limits and cell.
#[derive(Debug, Clone)]
pub(super) struct Screen {
    space: WaypointSpace,
    limits: Limits,
    cell: Cell,
    clearance: Clearance,
    /// Second derivatives at the knots from positions at the knots; by candidate where
    /// the times are free.
    curvature: Option<Matrix4<f64>>,
}

/// One joint of a candidate: knots and second derivatives there.
struct JointSpline {
    q: Vector4<f64>,
    m: Vector4<f64>,
}

impl Screen {
    /// A screen for candidates of `space`.
    ///
    /// # Errors
    /// Waypoint times that do not increase.
    pub(super) fn new(
        space: WaypointSpace,
        limits: Limits,
        cell: Cell,
        clearance: Clearance,
    ) -> Result<Self, arm_model::TrajectoryError> {
        let resting = space.resting();
        space.decode(&resting)?;
        let curvature =
            (!space.is_timed()).then(|| curvature_matrix(&space.knot_times_s(&resting)));
        Ok(Self {
            space,
            limits,
            cell,
            clearance,
            curvature,
        })
    }

    /// Whether the arm may execute the candidate.
    pub(super) fn accepts(&self, x: &[f64]) -> bool {
        let knots = self.space.knots(x);
        let times = self.space.knot_times_s(x);
        let curvature = self.curvature.unwrap_or_else(|| curvature_matrix(&times));
        let splines: [JointSpline; JOINTS] = core::array::from_fn(|j| {
            let q = Vector4::from_fn(|i, _| knots[i][j]);
            JointSpline {
                m: curvature * q,
                q,
            }
        });
        let mut moved = self.space.dimensions.joints().iter();
        moved.all(|&j| self.joint_within_limits(j, &splines[j], &times))
            && TOOL_STEPS_S
                .iter()
                .all(|step| self.tool_within_limits(&splines, &times, *step))
    }

    fn joint_within_limits(&self, j: usize, s: &JointSpline, times: &[f64; 4]) -> bool {
        let lo = self.limits.position_min_rad[j];
        let hi = self.limits.position_max_rad[j];
        let v_max = LIMIT_FRACTION * self.limits.velocity_max_rad_s[j];
        let a_max = LIMIT_FRACTION * self.limits.acceleration_max_rad_s2[j];
        if s.m.amax() > a_max || s.q.iter().any(|q| !(*q >= lo && *q <= hi)) {
            return false;
        }
        (0..WAYPOINTS).all(|i| {
            let h = times[i + 1] - times[i];
            let (m0, m1) = (s.m[i], s.m[i + 1]);
            let v0 = (s.q[i + 1] - s.q[i]) / h - h * (2.0 * m0 + m1) / 6.0;
            let bend = (m1 - m0) / (2.0 * h);
            let speed = |u: f64| v0 + u * (m0 + u * bend);
            let position = |u: f64| s.q[i] + u * (v0 + u * (m0 / 2.0 + u * bend / 3.0));
            let inside = |u: f64| u > 0.0 && u < h;
            let vertex = -m0 / (2.0 * bend);
            if speed(h).abs() > v_max || (inside(vertex) && speed(vertex).abs() > v_max) {
                return false;
            }
            let root = (m0 * m0 - 4.0 * bend * v0).max(0.0).sqrt();
            let pivot = -0.5 * (m0 + root.copysign(m0));
            [pivot / bend, v0 / pivot].into_iter().all(|u| {
                !inside(u) || {
                    let q = position(u);
                    q >= lo && q <= hi
                }
            })
        })
    }

    fn tool_within_limits(
        &self,
        splines: &[JointSpline; JOINTS],
        times: &[f64; 4],
        step_s: f64,
    ) -> bool {
        let offset = self.limits.tcp_offset();
        let pole_end = self.cell.pole.end_m();
        let speed_max = LIMIT_FRACTION * self.limits.tcp_speed_max_m_s;
        let mut t = step_s / 2.0;
        while t < times[WAYPOINTS] {
            let flange = kinematics::flange_motion(&state_at(splines, times, t));
            if flange.at_offset(&offset).v_m_s.norm() > speed_max
                || !self.clear(&flange.p_m)
                || !self.clear(&(flange.p_m + flange.r * pole_end))
            {
                return false;
            }
            t += step_s;
        }
        true
    }

    /// Whether a point keeps its distance to floor and column.
    fn clear(&self, p: &Vector3<f64>) -> bool {
        let (cell, tool_m) = (&self.cell, self.clearance.tool_m);
        let beside = cell.column_half_width_m + tool_m;
        p.z > cell.floor_z_m + tool_m && (p.z > tool_m || p.x.abs() > beside || p.y.abs() > beside)
    }

    /// Sum over joints of the speed above its limit (rad/s), the paper's
    /// `P_vel`; 0 for every candidate this screen accepts.
    pub(super) fn speed_excess_rad_s(&self, trajectory: &JointTrajectory) -> f64 {
        (0..JOINTS)
            .map(|j| {
                let peak = trajectory.extrema(j).qd.value.abs();
                (peak - self.limits.velocity_max_rad_s[j]).max(0.0)
            })
            .sum()
    }
}

fn state_at(splines: &[JointSpline; JOINTS], times: &[f64; 4], t: f64) -> JointState {
    let i = (1..WAYPOINTS).filter(|&i| t >= times[i]).count();
    let h = times[i + 1] - times[i];
    let (a, b) = (times[i + 1] - t, t - times[i]);
    let mut out = JointState::default();
    for (j, s) in splines.iter().enumerate() {
        let (m0, m1) = (s.m[i], s.m[i + 1]);
        let (c0, c1) = (s.q[i] / h - m0 * h / 6.0, s.q[i + 1] / h - m1 * h / 6.0);
        out.q[j] = (m0 * a * a * a + m1 * b * b * b) / (6.0 * h) + c0 * a + c1 * b;
        out.qd[j] = (m1 * b * b - m0 * a * a) / (2.0 * h) + c1 - c0;
    }
    out
}

/// Matrix from knot positions to second derivatives of the clamped spline.
fn curvature_matrix(times: &[f64; 4]) -> Matrix4<f64> {
    let h: [f64; 3] = core::array::from_fn(|i| times[i + 1] - times[i]);
    let mut system = Matrix4::zeros();
    let mut slopes = Matrix4::zeros();
    for i in 0..3 {
        let (a, b) = (i, i + 1);
        system[(a, a)] += 2.0 * h[i];
        system[(a, b)] += h[i];
        system[(b, a)] += h[i];
        system[(b, b)] += 2.0 * h[i];
        slopes[(a, a)] -= 6.0 / h[i];
        slopes[(a, b)] += 6.0 / h[i];
        slopes[(b, a)] += 6.0 / h[i];
        slopes[(b, b)] -= 6.0 / h[i];
    }
    // Diagonally dominant, hence never singular for increasing times.
    system.lu().solve(&slopes).unwrap_or_else(Matrix4::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Dimensions;
    use arm_model::joint::START_POSE;
    use arm_model::limits::{LimitKind, LimitsSpec, Margin};
    use rand::{RngExt, SeedableRng};

    fn screen(tcp_speed: f64, stretch_max: f64) -> Screen {
        let mut spec = LimitsSpec::from(Limits::default());
        spec.tcp_speed_max_m_s = tcp_speed;
        let space = WaypointSpace {
            start: START_POSE,
            dimensions: Dimensions::Full,
            turn_max_rad: 0.0,
            stands: false,
            times_s: [0.45, 0.80, 1.15],
            stretch_max,
        };
        let limits = Limits::try_from(spec).unwrap();
        Screen::new(space, limits, Cell::default(), Clearance::default()).unwrap()
    }

    /// The verdict on random candidates against the extrema and margins that
    /// shared-types computes from the finished trajectory.
    #[test]
    fn agrees_with_the_margins_of_the_limits() {
        let is_range = |k| matches!(k, LimitKind::PositionMin | LimitKind::PositionMax);
        let is_roomy = |m: &Margin| m.left > 0.03 || is_range(m.kind);
        let mut rng = rand_chacha::ChaCha12Rng::seed_from_u64(4);
        let mut seen = [0; 2];
        for round in 0..3000 {
            let stretch_max = if round % 3 == 0 { 1.4 } else { 1.0 };
            let s = screen(if round % 2 == 0 { 1.2 } else { 9.0 }, stretch_max);
            let mut x = s.space.resting();
            let spread = rng.random_range(0.05..0.8);
            let waypoints = s.space.dimensions.count();
            for (i, v) in x.iter_mut().enumerate() {
                let stretch = stretch_max.ln();
                let most = if i < waypoints { spread } else { stretch };
                *v += most * rng.random_range(-1.0..1.0);
            }
            let trajectory = s.space.decode(&x).unwrap();
            let worst = s.limits.worst_violation(&trajectory);
            if s.accepts(&x) {
                seen[0] += 1;
                assert!(worst.is_none(), "accepted {worst:?}");
                assert_eq!(s.speed_excess_rad_s(&trajectory), 0.0);
            } else if worst.is_none() && s.limits.margins(&trajectory).iter().all(is_roomy) {
                // Only the scene can be the reason.
                let low = (0..=200).any(|k| {
                    let t = f64::from(k) * trajectory.duration_s() / 200.0;
                    let (p, r) = kinematics::flange_pose(&trajectory.state_at(t).q);
                    !s.clear(&p) || !s.clear(&(p + r * s.cell.pole.end_m()))
                });
                assert!(low, "refused without a reason");
            } else {
                seen[1] += 1;
            }
        }
        assert!(seen[0] > 50 && seen[1] > 50, "{seen:?}");
    }

    #[test]
    fn floor_and_column_are_kept_clear() {
        let s = screen(9.0, 1.0);
        assert!(!s.clear(&Vector3::new(0.5, 0.0, -0.72)));
        assert!(!s.clear(&Vector3::new(0.12, 0.0, -0.2)));
        assert!(s.clear(&Vector3::new(0.2, 0.0, -0.2)));
        assert!(s.clear(&Vector3::new(0.0, 0.0, 0.3)));
    }
}
