//! The one type that says what the arm may do.
//!
//! Planner, preflight, controller and simulated arm check against the same
//! [`Limits`], so that they cannot disagree. Values come from a file under
//! `configs/robot/`, where each number names its source.

use crate::joint::{JOINTS, JointVector};
use crate::kinematics;
use crate::trajectory::JointTrajectory;
use crate::unit::unit_hint;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Longest path of the tool from one setpoint to the next (m): the vendor's advice, at
/// which the controller stops.
pub const STEP_MAX_M: f64 = 0.010;

/// Ranges (rad), speed (rad/s), acceleration (rad/s²) and jerk (rad/s³) of the arm's joints
/// (vendor manual), rounded up: no limit beyond them makes sense.
const RATED: [f64; 4] = [6.29, 3.15, 20.01, 500.0];
/// Speed of the tool at full reach, 0.7 m, while one joint turns as fast as it can (m/s).
pub const TOOL_SPEED_RATED_M_S: f64 = 2.2;
/// Longest tool that makes sense (m).
const TOOL_MAX_M: f64 = 1.0;

/// Limits as written in a file; unchecked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsSpec {
    /// Smallest joint positions (rad).
    pub position_min_rad: JointVector,
    /// Largest joint positions (rad).
    pub position_max_rad: JointVector,
    /// Largest joint speeds (rad/s).
    pub velocity_max_rad_s: JointVector,
    /// Largest joint accelerations (rad/s²).
    pub acceleration_max_rad_s2: JointVector,
    /// Largest joint jerks of motions the controller makes itself: moves to a
    /// start pose and stops (rad/s³).
    pub jerk_max_rad_s3: JointVector,
    /// Largest speed of the tool centre point (m/s). In servo mode the arm
    /// itself stops with C60 above 1 m/s times its factor.
    pub tcp_speed_max_m_s: f64,
    /// Tool centre point in the flange frame, as configured in the arm (m).
    pub tcp_offset_m: [f64; 3],
    /// Setpoints per second on the wire (Hz).
    pub rate_hz: f64,
}

/// Why limits are refused: which key, and what it must be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct LimitsError(String);

/// Checked limits. RT-safe to use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LimitsSpec", into = "LimitsSpec")]
pub struct Limits(LimitsSpec);

impl TryFrom<LimitsSpec> for Limits {
    type Error = LimitsError;
    fn try_from(spec: LimitsSpec) -> Result<Self, LimitsError> {
        let tcp_speed = JointVector::splat(spec.tcp_speed_max_m_s);
        for (key, values) in [
            ("velocity_max_rad_s", &spec.velocity_max_rad_s),
            ("acceleration_max_rad_s2", &spec.acceleration_max_rad_s2),
            ("jerk_max_rad_s3", &spec.jerk_max_rad_s3),
            ("tcp_speed_max_m_s", &tcp_speed),
        ] {
            if !values.iter().all(|x| x.is_finite() && *x > 0.0) {
                return Err(LimitsError(format!(
                    "limit `{key}` must be finite and above zero for every joint"
                )));
            }
        }
        if spec.tcp_offset_m.iter().any(|v| !v.is_finite()) {
            return Err(LimitsError("limit `tcp_offset_m` must be finite".into()));
        }
        let ranges = spec
            .position_min_rad
            .iter()
            .zip(spec.position_max_rad.iter());
        for (joint, (lo, hi)) in (1..).zip(ranges) {
            if !(lo.is_finite() && hi.is_finite() && lo < hi) {
                return Err(LimitsError(format!(
                    "`position_min_rad` is not below `position_max_rad` for joint {joint}"
                )));
            }
        }
        let rate_hz = spec.rate_hz;
        if !(30.0..=250.0).contains(&rate_hz) {
            return Err(LimitsError(format!(
                "`rate_hz` is {rate_hz}, but the arm takes 30 to 250 setpoints a second"
            )));
        }
        Ok(Self(spec))
    }
}

impl From<Limits> for LimitsSpec {
    fn from(limits: Limits) -> Self {
        limits.0
    }
}

impl core::ops::Deref for Limits {
    type Target = LimitsSpec;
    fn deref(&self) -> &LimitsSpec {
        &self.0
    }
}

/// What a limit is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitKind {
    /// Lower end of a joint's range.
    PositionMin,
    /// Upper end of a joint's range.
    PositionMax,
    /// Joint speed.
    Velocity,
    /// Joint acceleration.
    Acceleration,
    /// Speed of the tool centre point.
    TcpSpeed,
}

/// How close a trajectory comes to one limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Margin {
    /// Which limit.
    pub kind: LimitKind,
    /// Joint 1..=7; 0 for the tool.
    pub joint: u8,
    /// Extreme value along the trajectory (SI).
    pub value: f64,
    /// The limit (SI).
    pub limit: f64,
    /// When the extreme occurs (s).
    pub time_s: f64,
    /// Part of the limit left, negative when broken. For positions: distance to
    /// the end of the range as a part of the range.
    pub left: f64,
}

impl Limits {
    /// Refuses what this arm cannot be limited to: a slip of the unit, mostly.
    ///
    /// # Errors
    /// A limit beyond what the arm is rated for.
    pub fn check_rating(&self) -> Result<(), LimitsError> {
        let farther = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
        let farthest = |values: &[f64]| values.iter().fold(0.0, farther);
        let [range, speed, accel, jerk] = RATED;
        let spec = &self.0;
        let of_joints = [
            ("position_min_rad", spec.position_min_rad, range),
            ("position_max_rad", spec.position_max_rad, range),
            ("velocity_max_rad_s", spec.velocity_max_rad_s, speed),
            (
                "acceleration_max_rad_s2",
                spec.acceleration_max_rad_s2,
                accel,
            ),
            ("jerk_max_rad_s3", spec.jerk_max_rad_s3, jerk),
        ];
        let tcp_speed = spec.tcp_speed_max_m_s;
        let of_tool = [
            ("tcp_speed_max_m_s", tcp_speed, TOOL_SPEED_RATED_M_S),
            ("tcp_offset_m", farthest(&spec.tcp_offset_m), TOOL_MAX_M),
        ];
        let of_joints = of_joints.map(|(key, values, most)| (key, farthest(&values.0), most));
        let mut rules = of_joints.into_iter().chain(of_tool);
        match rules.find(|(_, value, most)| value.abs() > *most) {
            Some((key, value, most)) => Err(LimitsError(format!(
                "`{key}` is {value}, but the arm reaches at most {most}{}",
                unit_hint(key, value, most)
            ))),
            None => Ok(()),
        }
    }

    /// Duration of one cycle (s).
    #[must_use]
    pub fn period_s(&self) -> f64 {
        1.0 / self.0.rate_hz
    }

    /// Joint (0-based) whose position is outside its range, if any. RT-safe.
    #[must_use]
    pub fn position_violation(&self, q: &JointVector) -> Option<usize> {
        (0..JOINTS)
            .find(|&j| !(q[j] >= self.0.position_min_rad[j] && q[j] <= self.0.position_max_rad[j]))
    }

    /// Tool centre point in the flange frame (m).
    #[must_use]
    pub fn tcp_offset(&self) -> Vector3<f64> {
        Vector3::from(self.0.tcp_offset_m)
    }

    /// All margins of a trajectory: those of the joints from the exact extrema of the
    /// spline, then that of the tool's speed.
    #[must_use]
    pub fn margins(&self, trajectory: &JointTrajectory) -> Vec<Margin> {
        use LimitKind::{Acceleration, PositionMax, PositionMin, Velocity};
        let mut out = Vec::with_capacity(4 * JOINTS + 1);
        for j in 0..JOINTS {
            let e = trajectory.extrema(j);
            let (lo, hi) = (self.0.position_min_rad[j], self.0.position_max_rad[j]);
            let v = self.0.velocity_max_rad_s[j];
            let a = self.0.acceleration_max_rad_s2[j];
            let (span, joint) = (hi - lo, u8::try_from(j + 1).unwrap_or(u8::MAX));
            let found = [
                (PositionMin, e.q_min, lo, (e.q_min.value - lo) / span),
                (PositionMax, e.q_max, hi, (hi - e.q_max.value) / span),
                (Velocity, e.qd, v, 1.0 - e.qd.value.abs() / v),
                (Acceleration, e.qdd, a, 1.0 - e.qdd.value.abs() / a),
            ];
            out.extend(found.map(|(kind, extreme, limit, left)| Margin {
                kind,
                joint,
                value: extreme.value,
                limit,
                time_s: extreme.time_s,
                left,
            }));
        }
        out.push(self.tcp_margin(trajectory));
        out
    }

    /// Tool centre point of an arm at `q` (m, base frame). RT-safe.
    #[must_use]
    pub fn tool_centre_point_m(&self, q: &JointVector) -> Vector3<f64> {
        let (p, r) = kinematics::flange_pose(q);
        p + r * self.tcp_offset()
    }

    /// Margin to the tool speed limit. The speed is no polynomial: it is
    /// sampled four times per cycle and its peak refined by a parabola.
    #[must_use]
    pub fn tcp_margin(&self, trajectory: &JointTrajectory) -> Margin {
        let offset = self.tcp_offset();
        let speed = |t: f64| {
            let s = trajectory.state_at(t);
            kinematics::tool_speed_m_s(&s.q, &s.qd, &offset)
        };
        let step = self.period_s() / 4.0;
        let mut best = (0.0, 0.0);
        let mut t = 0.0;
        while t <= trajectory.duration_s() {
            let v = speed(t);
            if v > best.0 {
                best = (v, t);
            }
            t += step;
        }
        let (before, after) = (speed(best.1 - step), speed(best.1 + step));
        let bend = before - 2.0 * best.0 + after;
        if bend < 0.0 {
            let t = best.1 + 0.5 * step * (before - after) / bend;
            let v = speed(t);
            if v > best.0 {
                best = (v, t);
            }
        }
        Margin {
            kind: LimitKind::TcpSpeed,
            joint: 0,
            value: best.0,
            limit: self.0.tcp_speed_max_m_s,
            time_s: best.1,
            left: 1.0 - best.0 / self.0.tcp_speed_max_m_s,
        }
    }

    /// The limit a trajectory breaks most, if it breaks any.
    #[must_use]
    pub fn worst_violation(&self, trajectory: &JointTrajectory) -> Option<Margin> {
        self.margins(trajectory)
            .into_iter()
            .filter(|m| m.left.is_nan() || m.left < 0.0)
            .min_by(|a, b| a.left.total_cmp(&b.left))
    }
}

impl Margin {
    /// One line for people: what, value, limit and when.
    #[must_use]
    pub fn describe(&self) -> String {
        let (what, unit) = match self.kind {
            LimitKind::PositionMin | LimitKind::PositionMax => ("position", "rad"),
            LimitKind::Velocity => ("speed", "rad/s"),
            LimitKind::Acceleration => ("acceleration", "rad/s²"),
            LimitKind::TcpSpeed => ("speed", "m/s"),
        };
        let who = if self.joint == 0 {
            String::from("tool")
        } else {
            format!("joint {}", self.joint)
        };
        format!(
            "{who} {what} {:.3} {unit} against a limit of {:.3} {unit} at {:.3} s",
            self.value, self.limit, self.time_s
        )
    }
}

#[cfg(feature = "std")]
impl Default for Limits {
    /// Those of `configs/robot/xarm7.toml`.
    fn default() -> Self {
        #[allow(clippy::expect_used, reason = "a file of this crate's own sources")]
        static XARM7: std::sync::LazyLock<Limits> = std::sync::LazyLock::new(|| {
            toml::from_str(include_str!("../../configs/robot/xarm7.toml"))
                .expect("configs/robot/xarm7.toml are limits")
        });
        XARM7.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_point(joint: usize, by_rad: f64, in_s: f64) -> JointTrajectory {
        let start = JointVector([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        let mut end = start;
        end[joint] += by_rad;
        JointTrajectory::new(&[0.0, in_s], &[start, end]).unwrap()
    }

    #[test]
    fn reports_the_broken_limit_with_joint_and_time() {
        let limits = Limits::default();
        assert!(limits.worst_violation(&two_point(0, 0.2, 1.0)).is_none());
        // A single clamped segment peaks at 1.5 times its mean speed, half way.
        let m = limits.worst_violation(&two_point(6, 2.5, 1.0)).unwrap();
        assert_eq!((m.kind, m.joint), (LimitKind::Velocity, 7));
        assert!((m.value - 3.75).abs() < 1e-9 && (m.time_s - 0.5).abs() < 1e-9);
        let m = limits.worst_violation(&two_point(3, -1.2, 4.0)).unwrap();
        assert_eq!((m.kind, m.joint), (LimitKind::PositionMin, 4));
    }

    #[test]
    fn tool_speed_is_flange_speed_for_zero_offset() {
        let start = JointVector([0.0, 0.5, 0.0, 0.3, 0.0, 0.0, 0.0]);
        let mut end = start;
        end[0] += 1.0;
        let t = JointTrajectory::new(&[0.0, 1.0], &[start, end]).unwrap();
        let p = kinematics::flange_pose(&start).0;
        let m = Limits::default().tcp_margin(&t);
        assert!((m.value - 1.5 * p.xy().norm()).abs() < 1e-9);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |change: fn(&mut LimitsSpec)| {
            let mut spec = LimitsSpec::from(Limits::default());
            change(&mut spec);
            let checked = Limits::try_from(spec).and_then(|limits| limits.check_rating());
            checked.unwrap_err().to_string()
        };
        assert_eq!(Limits::default().check_rating(), Ok(()));
        let said = refused(|spec| spec.velocity_max_rad_s[3] = f64::NAN);
        assert!(said.contains("`velocity_max_rad_s`"), "{said}");
        let said = refused(|spec| spec.rate_hz = 1000.0);
        assert!(said.contains("`rate_hz`"), "{said}");
        let said = refused(|spec| spec.tcp_speed_max_m_s = 900.0);
        assert!(said.contains("2.2") && said.contains("in mm/s?"), "{said}");
        let said = refused(|spec| spec.position_min_rad[6] = -360.0);
        assert!(
            said.contains("-360") && said.contains("in degrees?"),
            "{said}"
        );
    }
}
