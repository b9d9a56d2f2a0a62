//! Streamed setpoints: which of them are taken, and which are too fast.
//!
//! The controller takes at most 250 setpoints a second and only the newest;
//! those between are lost. It checks every one it receives. How it derives the
//! speed of a setpoint is not published; here it is the step from the setpoint
//! before, over the mean interval of the last setpoints, which is never taken
//! as less than the 4 ms cycle. Jitter of the network therefore raises no false
//! alarm on a 250 Hz stream, while a stream that is too fast is seen at once.
//! Setpoints that arrive at one instant, as those that one read brings do, may
//! also be measured from the last one that came before them.

use super::pacer::{Intake, Pacer};
use super::setpoint_check::{SetpointLimits, Step};
use arm_model::JointVector;
use rt_controller::xarm::ErrorCode;
use shared_types::MonotonicNs;
use std::collections::VecDeque;

/// Time that a step counts for at least (s): 250 Hz.
const CYCLE_S: f64 = 0.004;
/// A longer gap ends the stream (s): below 30 Hz motion is not continuous.
const SILENCE_S: f64 = 1.0 / 30.0;
/// Intervals over which the rate of the stream is averaged.
const INTERVALS: usize = 25;
/// A setpoint to execute.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    /// The step of the last setpoint that did not arrive together with another.
    last_step: Option<Step>,
    pub(super) pacer: Pacer<Setpoint>,
}

impl ServoStream {
    /// Forgets the stream; the next setpoint begins a new one.
    pub(super) fn reset(&mut self) {
        self.arrivals.clear();
        self.newest = None;
        self.last_step = None;
        self.pacer.clear();
    }

    /// Whether the stream has fallen silent.
    pub(super) fn is_silent(&self, now: MonotonicNs) -> bool {
        self.arrivals
            .back()
            .is_none_or(|last| now.since_s(*last) > SILENCE_S)
    }

    /// Checks a setpoint that arrived at `arrived` and keeps it as the newest
    /// one, to be executed from `at` on. `present` (rad) is where a stream that
    /// begins now starts from.
    ///
    /// # Errors
    /// C23 outside the joint range, C24 too fast for a joint, C60 for the tool,
    /// C22 and C35 as in [`SetpointLimits::check_pose`].
    pub(super) fn offer(
        &mut self,
        arrived: MonotonicNs,
        at: MonotonicNs,
        q: JointVector,
        present: JointVector,
        limits: &SetpointLimits<'_>,
    ) -> Result<(), ErrorCode> {
        let (single, together) = self.note_arrival(arrived, present);
        let q = limits.in_range(&q)?;
        let qd = single.speed(&q, limits).or_else(|error| {
            let together = together.ok_or(error)?;
            together.speed(&q, limits)
        })?;
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

    /// Records an arrival, never before the last one: from where and over which
    /// time its step counts, and what counts besides if it arrived together with
    /// the setpoint before.
    fn note_arrival(&mut self, arrived: MonotonicNs, present: JointVector) -> (Step, Option<Step>) {
        if self.is_silent(arrived) {
            self.arrivals.clear();
        }
        let last = self.arrivals.back().copied();
        let arrived = last.map_or(arrived, |last| arrived.max(last));
        self.arrivals.push_back(arrived);
        if self.arrivals.len() > INTERVALS + 1 {
            self.arrivals.pop_front();
        }
        let step = Step {
            from: self.newest.unwrap_or(present),
            interval_s: last.map_or(SILENCE_S, |last| self.interval_s(arrived, last)),
        };
        if last == Some(arrived) {
            return (step, self.last_step);
        }
        self.last_step = Some(step);
        (step, None)
    }

    /// What the way since the arrival at `last` is measured by (s).
    fn interval_s(&self, arrived: MonotonicNs, last: MonotonicNs) -> f64 {
        let span_s = self
            .arrivals
            .front()
            .map_or(0.0, |first| arrived.since_s(*first));
        let mean_s = span_s / (self.arrivals.len() - 1) as f64;
        mean_s.max(arrived.since_s(last)).clamp(CYCLE_S, SILENCE_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Limits;

    const MS: u64 = 1_000_000;

    fn take(servo: &mut ServoStream, now: MonotonicNs) -> Option<Setpoint> {
        servo.take(now, CYCLE_S, Intake::Arrival)
    }

    /// Streams joint 7 at `speed_rad_s`, setpoints due every 4 ms, each `late_ms(k)` late.
    /// Returns the first error.
    fn stream(speed_rad_s: f64, late_ms: impl Fn(u64) -> u64) -> (Option<ErrorCode>, usize) {
        let limits = Limits::default();
        let checks = SetpointLimits::of_joints(&limits);
        let mut servo = ServoStream::default();
        let mut q = JointVector::ZERO;
        let mut taken = 0;
        for k in 0..200_u64 {
            let at = MonotonicNs((4 * k + late_ms(k)) * MS);
            if let Err(code) = servo.offer(at, at, q, JointVector::ZERO, &checks) {
                return (Some(code), taken);
            }
            taken += usize::from(take(&mut servo, at).is_some());
            q[6] += speed_rad_s * 0.004;
        }
        (None, taken)
    }

    #[test]
    fn joint_speed_limit_is_180_degrees_a_second() {
        assert_eq!(stream(3.13, |_| 0), (None, 200));
        assert_eq!(stream(3.15, |_| 0).0, Some(ErrorCode::SPEED_LIMIT));
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
        let (error, taken) = stream(3.0, stall);
        assert_eq!(error, None);
        assert!((190..200).contains(&taken), "{taken}");
        assert_eq!(stream(3.0, |k| k % 2).0, None);
    }

    /// A reader held up takes up two setpoints at once, the second of them sent
    /// 2 ms late: no error. A stream that is too fast is none the less.
    #[test]
    fn setpoints_of_one_read_count_from_the_one_before_them() {
        let limits = Limits::default();
        let checks = SetpointLimits::of_joints(&limits);
        let send = |speed_rad_s: f64| {
            let mut servo = ServoStream::default();
            let mut offer = |arrived_ms: u64, path_ms: u64| {
                let at = MonotonicNs((1000 + arrived_ms) * MS);
                let mut q = JointVector::ZERO;
                q[6] = speed_rad_s * path_ms as f64 * 1e-3;
                servo.offer(at, at, q, JointVector::ZERO, &checks)
            };
            (0..25).try_for_each(|k| offer(4 * k, 4 * k))?;
            offer(106, 100)?;
            offer(106, 106)?;
            offer(108, 108)
        };
        assert_eq!(send(3.0), Ok(()));
        assert_eq!(send(3.2), Err(ErrorCode::SPEED_LIMIT));
        let mut servo = ServoStream::default();
        let mut offer = |ms: u64, q6: f64| {
            let mut q = JointVector::ZERO;
            q[6] = q6;
            servo.offer(MonotonicNs(ms * MS), MonotonicNs(ms * MS), q, q, &checks)
        };
        assert_eq!((offer(4, 0.0), offer(8, 0.0)), (Ok(()), Ok(())));
        assert_eq!(
            (offer(16, 0.01), offer(16, 0.026)),
            (Ok(()), Err(ErrorCode::SPEED_LIMIT))
        );
    }

    #[test]
    fn only_the_newest_of_a_burst_is_taken() {
        let limits = Limits::default();
        let checks = SetpointLimits::of_joints(&limits);
        let mut servo = ServoStream::default();
        let mut taken = Vec::new();
        for k in 0..1000_u64 {
            let at = MonotonicNs(1000 * MS + k * MS);
            let q = JointVector::splat(1e-5 * k as f64);
            servo.offer(at, at, q, JointVector::ZERO, &checks).unwrap();
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
