//! Streamed setpoints: which of them are taken, and which are too fast.
//!
//! The controller takes at most 250 setpoints a second and only the newest;
//! those between are lost. It checks every one it receives. How it derives the
//! speed of a setpoint is not published; here it is the step from the setpoint
//! before, over the mean interval of the last setpoints, which is never taken
//! as less than the 4 ms cycle. Jitter of the network therefore raises no false
//! alarm on a 250 Hz stream, while a stream that is too fast is seen at once.

use super::collision::self_clearance_m;
use super::pacer::{Intake, Pacer};
use nalgebra::Vector3;
use rt_controller::xarm::ErrorCode;
use shared_types::{JOINTS, JointVector, Limits, MonotonicNs, kinematics};
use std::collections::VecDeque;

/// Time that a step counts for at least (s): 250 Hz.
const CYCLE_S: f64 = 0.004;
/// A longer gap ends the stream (s): below 30 Hz motion is not continuous.
const SILENCE_S: f64 = 1.0 / 30.0;
/// Intervals over which the rate of the stream is averaged.
const INTERVALS: usize = 25;
/// Part of a limit that rounding to the wire's f32 may exceed it by.
const ROUNDING: f64 = 1e-3;

/// How far outside its range a setpoint is still taken (rad): 0.1 deg, as in the
/// SDK's own test. The joint goes to the end of the range then.
const RANGE_TOLERANCE_RAD: f64 = core::f64::consts::PI / 1800.0;

/// What a setpoint is checked against.
#[derive(Debug, Clone, Copy)]
pub(super) struct SetpointLimits<'a> {
    pub(super) joints: &'a Limits,
    /// Tool centre point in the flange frame (m).
    pub(super) tcp_offset: Vector3<f64>,
    /// Largest speed of that point (m/s).
    pub(super) tcp_speed_max_m_s: f64,
    /// What a faster setpoint raises: C60, on old firmware C24.
    pub(super) tcp_speed_code: ErrorCode,
    /// Whether self collision is looked for.
    pub(super) self_collision: bool,
    /// Box that the point must stay in: smallest, largest coordinates (m).
    pub(super) fence_m: Option<[Vector3<f64>; 2]>,
}

impl SetpointLimits<'_> {
    /// The nearest joint position inside the range.
    fn clamp(&self, q: &JointVector) -> JointVector {
        let (min, max) = (&self.joints.position_min_rad, &self.joints.position_max_rad);
        JointVector(core::array::from_fn(|j| q[j].clamp(min[j], max[j])))
    }

    /// Whether a pose is one that the arm must not take.
    ///
    /// # Errors
    /// C22 for self collision, C35 outside the safety boundary.
    pub(super) fn check_pose(&self, q: &JointVector) -> Result<(), ErrorCode> {
        if self.self_collision && self_clearance_m(q) < 0.0 {
            return Err(ErrorCode::SELF_COLLISION);
        }
        let Some([min, max]) = self.fence_m else {
            return Ok(());
        };
        let tool = tool_position(q, &self.tcp_offset);
        if tool.sup(&min).inf(&max) == tool {
            Ok(())
        } else {
            Err(SAFETY_BOUNDARY)
        }
    }
}

/// C35: safety boundary.
const SAFETY_BOUNDARY: ErrorCode = ErrorCode(35);

/// A setpoint to execute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Setpoint {
    pub(super) at: MonotonicNs,
    pub(super) q: JointVector,
    /// Speed at which the stream moves (rad/s).
    pub(super) qd: JointVector,
}

/// State of one stream of setpoints.
#[derive(Debug, Clone, Default)]
pub(super) struct ServoStream {
    arrivals: VecDeque<MonotonicNs>,
    newest: Option<JointVector>,
    pub(super) pacer: Pacer<Setpoint>,
}

impl ServoStream {
    /// Forgets the stream; the next setpoint begins a new one.
    pub(super) fn reset(&mut self) {
        self.arrivals.clear();
        self.newest = None;
        self.pacer.clear();
    }

    /// Whether the stream has fallen silent.
    pub(super) fn is_silent(&self, now: MonotonicNs) -> bool {
        self.arrivals
            .back()
            .is_none_or(|last| now.since_s(*last) > SILENCE_S)
    }

    /// Checks a setpoint and keeps it as the newest one. `present` (rad) is
    /// where a stream that begins now starts from.
    ///
    /// # Errors
    /// C23 outside the joint range, C24 too fast for a joint, C60 for the tool;
    /// C22 and C35 as in [`SetpointLimits::check_pose`].
    pub(super) fn offer(
        &mut self,
        at: MonotonicNs,
        q: JointVector,
        present: JointVector,
        limits: &SetpointLimits<'_>,
    ) -> Result<(), ErrorCode> {
        if self.is_silent(at) {
            self.arrivals.clear();
        }
        let interval_s = self.note_arrival(at);
        let inside = limits.clamp(&q);
        if (q - inside).max_abs() > RANGE_TOLERANCE_RAD {
            return Err(ErrorCode::JOINT_LIMIT);
        }
        let q = inside;
        let from = self.newest.unwrap_or(present);
        let qd = (q - from) * (1.0 / interval_s);
        let allowed = 1.0 + ROUNDING;
        if (0..JOINTS).any(|j| qd[j].abs() > limits.joints.velocity_max_rad_s[j] * allowed) {
            return Err(ErrorCode::SPEED_LIMIT);
        }
        let way = tool_position(&q, &limits.tcp_offset) - tool_position(&from, &limits.tcp_offset);
        if way.norm() > limits.tcp_speed_max_m_s * allowed * interval_s {
            return Err(limits.tcp_speed_code);
        }
        limits.check_pose(&q)?;
        self.newest = Some(q);
        self.pacer.offer(at, Setpoint { at, q, qd });
        Ok(())
    }

    /// The setpoint to execute at or before `now`, if one is due.
    pub(super) fn take(
        &mut self,
        now: MonotonicNs,
        cycle_s: f64,
        intake: Intake,
    ) -> Option<Setpoint> {
        let (at, setpoint) = self.pacer.take(now, cycle_s, intake)?;
        Some(Setpoint { at, ..setpoint })
    }

    /// Records an arrival and returns the time its step counts for (s).
    fn note_arrival(&mut self, at: MonotonicNs) -> f64 {
        let last = self.arrivals.back().map(|last| at.since_s(*last));
        self.arrivals.push_back(at);
        if self.arrivals.len() > INTERVALS + 1 {
            self.arrivals.pop_front();
        }
        let Some(last_s) = last else {
            return SILENCE_S;
        };
        let span_s = self
            .arrivals
            .front()
            .map_or(0.0, |first| at.since_s(*first));
        let mean_s = span_s / (self.arrivals.len() - 1) as f64;
        mean_s.max(last_s).clamp(CYCLE_S, SILENCE_S)
    }
}

fn tool_position(q: &JointVector, offset: &Vector3<f64>) -> Vector3<f64> {
    let (p, r) = kinematics::flange_pose(q);
    p + r * offset
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    /// Flange 0.66 m from joint 1's axis.
    const STRETCHED: JointVector = JointVector([0.0, 0.8, 0.0, 2.4, 0.0, 1.6, 0.0]);

    fn checks(joints: &Limits) -> SetpointLimits<'_> {
        SetpointLimits {
            joints,
            tcp_offset: Vector3::zeros(),
            tcp_speed_max_m_s: 1.2,
            tcp_speed_code: ErrorCode::TCP_SPEED_LIMIT,
            self_collision: false,
            fence_m: None,
        }
    }

    fn take(servo: &mut ServoStream, now: MonotonicNs) -> Option<Setpoint> {
        servo.take(now, CYCLE_S, Intake::Arrival)
    }

    /// Streams joint `joint` at `speed_rad_s`, setpoints due every 4 ms, each
    /// `late_ms(k)` late. Returns the first error.
    fn stream(
        joint: usize,
        speed_rad_s: f64,
        late_ms: impl Fn(u64) -> u64,
    ) -> (Option<ErrorCode>, usize) {
        let limits = Limits::default();
        let checks = checks(&limits);
        let mut servo = ServoStream::default();
        let mut q = STRETCHED;
        let mut taken = 0;
        for k in 0..200_u64 {
            let at = MonotonicNs((4 * k + late_ms(k)) * MS);
            if let Err(code) = servo.offer(at, q, STRETCHED, &checks) {
                return (Some(code), taken);
            }
            taken += usize::from(take(&mut servo, at).is_some());
            q[joint] += speed_rad_s * 0.004;
        }
        (None, taken)
    }

    #[test]
    fn joint_speed_limit_is_180_degrees_a_second() {
        assert_eq!(stream(6, 3.13, |_| 0), (None, 200));
        assert_eq!(stream(6, 3.15, |_| 0).0, Some(ErrorCode::SPEED_LIMIT));
    }

    /// The flange turns about joint 1 on a circle whose radius comes from the
    /// pose, so the speed at the limit is known.
    #[test]
    fn tool_speed_limit_is_the_factor() {
        let radius_m = kinematics::flange_pose(&STRETCHED).0.xy().norm();
        assert_eq!(stream(0, 1.19 / radius_m, |_| 0).0, None);
        assert_eq!(
            stream(0, 1.21 / radius_m, |_| 0).0,
            Some(ErrorCode::TCP_SPEED_LIMIT)
        );
    }

    /// A host that stalls for 30 ms and then catches up at once stays within
    /// its schedule, so it raises no error; the setpoints between are lost.
    #[test]
    fn jitter_of_a_good_stream_raises_no_error() {
        let stall = |k: u64| {
            if (100..108).contains(&k) {
                4 * (108 - k)
            } else {
                0
            }
        };
        let (error, taken) = stream(6, 3.0, stall);
        assert_eq!(error, None);
        assert!((190..200).contains(&taken), "{taken}");
        assert_eq!(stream(6, 3.0, |k| k % 2).0, None);
    }

    #[test]
    fn a_jump_is_refused() {
        let limits = Limits::default();
        let checks = checks(&limits);
        let mut servo = ServoStream::default();
        let mut far = JointVector::ZERO;
        far[6] = 1.0;
        let refused = servo.offer(MonotonicNs(MS), far, JointVector::ZERO, &checks);
        assert_eq!(refused, Err(ErrorCode::SPEED_LIMIT));
        far[3] = -1.0;
        let refused = servo.offer(MonotonicNs(MS), far, JointVector::ZERO, &checks);
        assert_eq!(refused, Err(ErrorCode::JOINT_LIMIT));
    }

    #[test]
    fn poses_that_collide_or_leave_the_boundary_are_refused() {
        let limits = Limits::default();
        let mut folded = JointVector::ZERO;
        folded[5] = 3.1;
        let mut checks = checks(&limits);
        assert_eq!(checks.check_pose(&folded), Ok(()));
        checks.self_collision = true;
        assert_eq!(checks.check_pose(&folded), Err(ErrorCode::SELF_COLLISION));
        // The zero pose has its flange at 206, 0, 120.5 mm.
        let box_up_to = |z: f64| Some([Vector3::repeat(-1.0), Vector3::new(1.0, 1.0, z)]);
        checks.fence_m = box_up_to(0.13);
        assert_eq!(checks.check_pose(&JointVector::ZERO), Ok(()));
        checks.fence_m = box_up_to(0.11);
        assert_eq!(checks.check_pose(&JointVector::ZERO), Err(ErrorCode(35)));
    }

    #[test]
    fn only_the_newest_of_a_burst_is_taken() {
        let limits = Limits::default();
        let checks = checks(&limits);
        let mut servo = ServoStream::default();
        let mut taken = Vec::new();
        for k in 0..1000_u64 {
            let at = MonotonicNs(1000 * MS + k * MS);
            let q = JointVector::splat(1e-5 * k as f64);
            servo.offer(at, q, JointVector::ZERO, &checks).unwrap();
            taken.extend(take(&mut servo, at));
        }
        // One second at 1 kHz: 250 are executed.
        assert!((249..=252).contains(&taken.len()), "{}", taken.len());
        // The second may come early by the tolerated jitter, later ones may not.
        assert!(
            taken[1..]
                .windows(2)
                .all(|w| w[1].at.since_s(w[0].at) > 0.0039)
        );
        let last = taken.last().unwrap();
        assert!((last.q[0] - last.at.since_s(MonotonicNs(1000 * MS)) * 1e-2).abs() < 1.1e-5);
    }
}
