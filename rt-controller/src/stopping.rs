//! How an arm comes to rest from full speed: the swing that is stopped, the two methods of stopping
//! it, and time and distance by its joint reports.

use crate::armed_speed::ArmedSpeed;
use crate::control::Motion;
use arm_model::joint::START_POSE;
use arm_model::kinematics::tool_speed_m_s;
use arm_model::{JointTrajectory, Pole};
use shared_types::FaultCode;
use shared_types::ipc::JointReport;
use shared_types::ipc::message::ControllerEvent;

/// How far joint 1 turns in the swing (rad).
const SWING_RAD: f64 = 0.9;
/// Waypoints of the swing.
const WAYPOINTS: usize = 13;
/// Shortest and longest swing that is tried, each 5 % longer than the one before (s).
const LASTS_S: [f64; 2] = [0.4, 12.0];
/// A joint that is slower stands still (rad/s).
const STILL_RAD_S: f64 = 1e-2;

/// How an arm is stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopMethod {
    /// The controller brakes along its setpoints.
    Brake,
    /// The arm itself is asked for state 4, as the guardian does.
    State4,
}

impl StopMethod {
    /// Whether a motion that ended so was stopped in this way, and not by something that nobody
    /// asked for.
    #[must_use]
    pub fn has_caused(self, end: &ControllerEvent) -> bool {
        match end {
            ControllerEvent::Stopped {
                fault,
                arm_error: 0,
                ..
            } => match self {
                Self::Brake => *fault == FaultCode::OperatorStop,
                Self::State4 => {
                    matches!(fault, FaultCode::ArmNotReady | FaultCode::ArmModeChanged)
                }
            },
            _ => false,
        }
    }
}

/// The shortest swing of joint 1 from the start pose that is tried and allowed; `None` where none
/// of up to 12 s is.
#[must_use]
pub fn fastest_swing(speed: &ArmedSpeed<'_>) -> Option<JointTrajectory> {
    let lasting = |duration_s: f64| {
        let at = |k: usize| {
            let fraction = k as f64 / (WAYPOINTS - 1) as f64;
            let mut q = START_POSE;
            // Speed and acceleration are zero at both ends.
            q[0] += SWING_RAD * fraction.powi(3) * (fraction * (6.0 * fraction - 15.0) + 10.0);
            (duration_s * fraction, q)
        };
        let (times_s, poses): (Vec<_>, Vec<_>) = (0..WAYPOINTS).map(at).unzip();
        let swing = JointTrajectory::new(&times_s, &poses).ok()?;
        let is_within = speed.limits.worst_violation(&swing).is_none();
        (is_within && speed.check(&Motion::Spline(swing)).is_ok()).then_some(swing)
    };
    let [shortest_s, longest_s] = LASTS_S;
    let durations = (0..).map(|k| shortest_s * 1.05_f64.powi(k));
    let mut durations = durations.take_while(|s| *s <= longest_s);
    durations.find_map(lasting)
}

/// How an arm came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    /// Speed of the pole's end in the last report before the stop was requested (m/s).
    pub speed_m_s: f64,
    /// From then until every joint stood (s).
    pub time_s: f64,
    /// Path length of the pole's end in that time (m).
    pub distance_m: f64,
}

impl Stopping {
    /// From the reports of an arm whose stop was requested at `requested_ns` (`CLOCK_MONOTONIC`).
    ///
    /// # Errors
    /// In words: nothing was reported before, the arm stood already, or it still moved in the last
    /// report.
    pub fn measured(
        reports: &[JointReport],
        requested_ns: u64,
        pole: &Pole,
    ) -> Result<Self, &'static str> {
        let (before, after): (Vec<&JointReport>, Vec<_>) =
            reports.iter().partition(|r| r.stamp_ns <= requested_ns);
        let before = before.last();
        let before = *before.ok_or("the arm reported no joints before it was stopped")?;
        let first = *after.first().ok_or("the arm did not come to rest")?;
        if before.qd.max_abs() <= STILL_RAD_S {
            return Err("the arm stood still when it was stopped");
        }
        // Where it was in between: no path from before the request counts.
        let since_ns = (requested_ns - before.stamp_ns) as f64;
        let fraction = since_ns / (first.stamp_ns - before.stamp_ns) as f64;
        let q = before.q + (first.q - before.q) * fraction;
        let moves = |r: &&JointReport| r.qd.max_abs() > STILL_RAD_S;
        let moving = after.iter().rposition(moves).map_or(0, |last| last + 1);
        let rest = after.get(moving).ok_or("the arm did not come to rest")?;
        let poses = core::iter::once(&q).chain(after[..=moving].iter().map(|r| &r.q));
        let ends_m: Vec<_> = poses.map(|q| pole.attach_pose(q).0).collect();
        let lengths_m = ends_m.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        Ok(Self {
            speed_m_s: tool_speed_m_s(&q, &before.qd, &pole.end_m()),
            time_s: 1e-9 * (rest.stamp_ns - requested_ns) as f64,
            distance_m: lengths_m.sum(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::PAYLOAD_VERSION;

    #[test]
    fn only_the_stop_that_was_asked_for_is_measured() {
        let ended = |fault, arm_error| ControllerEvent::Stopped {
            fault,
            cycle: 1,
            arm_error,
            message: String::new(),
        };
        let caused = |end: &ControllerEvent| {
            [StopMethod::Brake, StopMethod::State4].map(|method| method.has_caused(end))
        };
        assert_eq!(caused(&ended(FaultCode::OperatorStop, 0)), [true, false]);
        assert_eq!(caused(&ended(FaultCode::ArmModeChanged, 0)), [false, true]);
        assert_eq!(caused(&ended(FaultCode::ArmNotReady, 0)), [false, true]);
        for end in [
            ended(FaultCode::DeadManReleased, 0),
            ended(FaultCode::JointStuck, 0),
            ended(FaultCode::OperatorStop, 31),
            ended(FaultCode::ArmNotReady, 31),
            ControllerEvent::Done,
        ] {
            assert_eq!(caused(&end), [false, false], "{end:?}");
        }
    }

    /// Joint 1 turns at a constant rate; its stop is requested between two reports and it brakes evenly.
    #[test]
    fn an_even_stop_takes_its_time_and_half_the_path() {
        let (rate_rad_s, requested_s, braking_s) = (0.8, 0.103, 0.2);
        let report = |k: u32| {
            let time_s = 0.004 * f64::from(k);
            let braked_s = (time_s - requested_s).clamp(0.0, braking_s);
            let (mut q, mut qd) = (START_POSE, arm_model::JointVector::ZERO);
            let turned_s =
                time_s.min(requested_s) + braked_s - braked_s.powi(2) / (2.0 * braking_s);
            q[0] += rate_rad_s * turned_s;
            qd[0] = rate_rad_s * (1.0 - braked_s / braking_s);
            JointReport {
                version: PAYLOAD_VERSION,
                arm_state: 1,
                arm_mode: 1,
                arm_clock: 1,
                stamp_ns: (1e9 * time_s) as u64,
                arrival_ns: (1e9 * time_s) as u64,
                q,
                qd,
                q_target: q,
            }
        };
        let reports: Vec<_> = (0..200).map(report).collect();
        let (requested_ns, pole) = ((1e9 * requested_s) as u64, Pole::default());
        let stopping = Stopping::measured(&reports, requested_ns, &pole).unwrap();
        let radius_m = pole.attach_pose(&START_POSE).0.xy().norm();
        assert!(
            (stopping.speed_m_s - rate_rad_s * radius_m).abs() < 1e-3,
            "{stopping:?}"
        );
        assert!((stopping.time_s - braking_s).abs() < 0.005, "{stopping:?}");
        let path_m = 0.5 * stopping.speed_m_s * braking_s;
        assert!(
            (stopping.distance_m - path_m).abs() < 1e-3,
            "{stopping:?}, {path_m} m"
        );
        let moving = Stopping::measured(&reports[..60], requested_ns, &pole);
        assert_eq!(moving, Err("the arm did not come to rest"));
        let still = Stopping::measured(&reports, 500_000_000, &pole);
        assert_eq!(still, Err("the arm stood still when it was stopped"));
        let untold = Stopping::measured(&reports[30..], requested_ns, &pole);
        assert!(untold.is_err_and(|why| why.contains("before")));
    }
}
