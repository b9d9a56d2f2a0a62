//! What an arm really does when it is sent a trajectory.
//!
//! Plans are made through it: the search chooses commands, and the rope is simulated on
//! the motion that follows from them. So whatever can be made up for within the limits
//! of the command is made up for, and what cannot is in the prediction.

use super::lag::Lag;
use super::window::Window;
use crate::OutOfRange;
use arm_model::trajectory::MAX_WAYPOINTS;
use arm_model::{ArmResponse, JOINTS, JointTrajectory, JointVector, Limits, TrajectoryError};
use serde::{Deserialize, Serialize};

/// Joints that move by less stand still (rad).
const STILL_RAD: f64 = 1e-9;
/// Spacing of the motion's knots (s); wider where it would need too many.
const KNOT_S: f64 = 0.010;

/// Why the arm's motion is not known.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FollowError {
    /// The throw moves a joint whose response was not measured.
    #[error(
        "the arm's response does not tell how joint {joint} follows, but the throw moves it: measure it with `wag latency --excitation`, or plan with `dimensions = \"planar\"`"
    )]
    Unknown {
        /// Joint, 1-based.
        joint: usize,
    },
    /// A value of a response that was sent is out of range.
    #[error("the arm's response: {0}")]
    Value(#[from] OutOfRange),
    /// The motion makes no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

/// How each joint follows the staircase of setpoints of one controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "FollowingForm")]
pub struct Following {
    joints: [Option<Lag>; JOINTS],
    source: String,
    /// Time from setpoint to setpoint (s).
    period_s: f64,
}

/// What is sent: the same, not yet checked.
#[derive(Deserialize)]
struct FollowingForm {
    joints: [Option<Lag>; JOINTS],
    source: String,
    period_s: f64,
}

/// The ranges are those of [`ArmResponse`]'s file and of the rate in [`Limits`].
impl TryFrom<FollowingForm> for Following {
    type Error = FollowError;
    fn try_from(sent: FollowingForm) -> Result<Self, FollowError> {
        const HZ: f64 = core::f64::consts::TAU;
        let within = OutOfRange::unless_within;
        let (joints, source, period_s) = (sent.joints, sent.source, sent.period_s);
        let period = [("period_s", period_s)];
        within(1.0 / 250.0..=1.0 / 30.0, "from 1/250 to 1/30 s", &period)?;
        for lag in joints.iter().flatten() {
            let dead_time_s = [("dead_time_s", lag.dead_time_s)];
            let frequency = [("natural_frequency_rad_s", lag.natural_frequency_rad_s)];
            let damping_ratio = [("damping_ratio", lag.damping_ratio)];
            within(0.0..=1.0, "from 0 to 1 s", &dead_time_s)?;
            within(0.1 * HZ..=500.0 * HZ, "0.1 to 500 Hz", &frequency)?;
            within(0.01..=10.0, "from 0.01 to 10", &damping_ratio)?;
        }
        Ok(Self {
            joints,
            source,
            period_s,
        })
    }
}

impl Following {
    /// An arm as measured, told one setpoint per cycle of the limits.
    #[must_use]
    pub fn new(response: &ArmResponse, limits: &Limits) -> Self {
        let joints = core::array::from_fn(|j| {
            response.joints[j].lag().map(|lag| Lag {
                dead_time_s: lag.dead_time_s.value,
                natural_frequency_rad_s: core::f64::consts::TAU * lag.natural_frequency_hz.value,
                damping_ratio: lag.damping_ratio.value,
            })
        });
        Self {
            joints,
            source: response.source.clone(),
            period_s: limits.period_s(),
        }
    }

    /// Arm or run the response was measured on.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The motion of an arm that is told `command`, from its first setpoint until all
    /// joints have arrived. How long that takes does not depend on the way.
    ///
    /// # Errors
    /// A joint moves that was not measured.
    pub fn motion(&self, command: &JointTrajectory) -> Result<JointTrajectory, FollowError> {
        let late_s = self.joints.iter().flatten().map(Lag::arrival_s);
        let end_s = command.duration_s() + late_s.fold(0.0, f64::max);
        let setpoints = self.setpoints(command);
        let times_s = knots_s(end_s);
        let mut q = vec![command.start(); times_s.len()];
        for joint in 0..JOINTS {
            if is_still(command, joint) {
                continue;
            }
            let lag = self.joints[joint].ok_or(FollowError::Unknown { joint: joint + 1 })?;
            let window = Window {
                setpoints: setpoints.iter().map(|(t, q)| (*t, q[joint])).collect(),
                samples: times_s.iter().map(|t| (*t, 0.0)).collect(),
            };
            let mut at = q.iter_mut();
            lag.follow(&window, |position, _| {
                if let Some(q) = at.next() {
                    q[joint] = position;
                }
            });
        }
        Ok(JointTrajectory::new(&times_s, &q)?)
    }

    /// What the arm is told, and when (s, rad).
    fn setpoints(&self, command: &JointTrajectory) -> Vec<(f64, JointVector)> {
        let cycles = (command.duration_s() / self.period_s).ceil() as u32;
        (0..=cycles)
            .map(|k| f64::from(k) * self.period_s)
            .map(|t| (t, command.state_at(t).q))
            .collect()
    }
}

fn is_still(command: &JointTrajectory, joint: usize) -> bool {
    let first = command.start()[joint];
    let mut others = command.waypoints().iter();
    others.all(|q| (q[joint] - first).abs() < STILL_RAD)
}

fn knots_s(end_s: f64) -> Vec<f64> {
    let segments = ((end_s / KNOT_S).ceil() as u32).clamp(1, MAX_WAYPOINTS as u32 - 1);
    (0..=segments)
        .map(|k| end_s * f64::from(k) / f64::from(segments))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;
    use arm_model::response::{Estimate, JointResponse, NotExcited, TrackingLag};

    fn response(joint: usize, dead_time_s: f64, hz: f64) -> ArmResponse {
        let known = |value: f64| Estimate {
            value,
            interval: [value, value],
        };
        let mut out = ArmResponse {
            version: "0".to_owned(),
            source: "a test".to_owned(),
            command_to_target_s: None,
            excitation: None,
            joints: [JointResponse::NotExcited(NotExcited::Still); JOINTS],
        };
        out.joints[joint] = JointResponse::Excited(TrackingLag {
            dead_time_s: known(dead_time_s),
            natural_frequency_hz: known(hz),
            damping_ratio: known(0.9),
            residual_rad: 0.0,
            samples: 1,
        });
        out
    }

    fn swing(joint: usize) -> JointTrajectory {
        let mut out = START_POSE;
        out[joint] += 0.4;
        JointTrajectory::new(&[0.0, 0.5, 1.0], &[START_POSE, out, START_POSE]).unwrap()
    }

    /// A slow motion is late by dead time, lag and half a cycle of the staircase.
    #[test]
    fn a_swing_comes_late_by_its_slow_delay_and_ends_where_it_should() {
        let arm = response(3, 0.020, 12.0);
        let late_s = arm.joints[3].lag().unwrap().slow_delay_s() + 0.002;
        let command = swing(3);
        let motion = Following::new(&arm, &Limits::default())
            .motion(&command)
            .unwrap();
        assert!(motion.duration_s() > command.duration_s() + late_s);
        assert!((motion.end() - command.end()).max_abs() < 1e-4);
        for k in 20..90 {
            let t = 0.01 * f64::from(k);
            let (got, want) = (motion.state_at(t + late_s).q, command.state_at(t).q);
            assert!((got - want).max_abs() < 2e-3, "{t}: {got:?} {want:?}");
        }
        let undelayed = (motion.state_at(0.3).q - command.state_at(0.3).q).max_abs();
        assert!(undelayed > 0.02, "{undelayed}");
    }

    #[test]
    fn a_response_that_is_sent_is_checked() {
        fn lag(f: &mut Following) -> &mut Lag {
            f.joints[3].as_mut().unwrap()
        }
        let good = Following::new(&response(3, 0.02, 12.0), &Limits::default());
        let sent = |following: &Following| {
            let bytes = serde_json::to_vec(following).unwrap();
            serde_json::from_slice::<Following>(&bytes)
        };
        assert_eq!(sent(&good).unwrap(), good);
        type Change = fn(&mut Following);
        let cases: [(&str, Change); 6] = [
            ("period_s", |f| f.period_s = 1e-12),
            ("period_s", |f| f.period_s = 1.0),
            ("dead_time_s", |f| lag(f).dead_time_s = 1e9),
            ("dead_time_s", |f| lag(f).dead_time_s = -0.1),
            ("natural_frequency_rad_s", |f| {
                lag(f).natural_frequency_rad_s = 0.0;
            }),
            ("damping_ratio", |f| lag(f).damping_ratio = -1.0),
        ];
        for (key, change) in cases {
            let mut wrong = good.clone();
            change(&mut wrong);
            let error = sent(&wrong).unwrap_err().to_string();
            assert!(error.contains(key), "{error}");
        }
    }

    #[test]
    fn a_joint_that_was_not_measured_may_not_move() {
        let following = Following::new(&response(3, 0.02, 12.0), &Limits::default());
        assert!(following.motion(&swing(3)).is_ok());
        assert_eq!(
            following.motion(&swing(5)).unwrap_err(),
            FollowError::Unknown { joint: 6 }
        );
    }
}
