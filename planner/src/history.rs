//! What the arm did since the rope hung still, and where that leaves the rope: measured
//! joints, a hold, then the motion that is planned.

use crate::OutOfRange;
use arm_model::kinematics::FrameMotion;
use arm_model::{Cell, JointState, JointTrajectory, JointVector};
use rope_sim::{
    AttachMotion, Candidate, MeasuredArm, MotionError, Precision, SimOptions, SimulateError,
    roll_out,
};
use serde::{Deserialize, Serialize};
use shared_types::rope_state::Sway;
use shared_types::{RopeParams, RopeState};

/// Largest distance of a joint from the commanded start pose (rad): above what
/// gravity and encoders leave, below what matters to the rope.
const START_TOLERANCE_RAD: f64 = 0.02;

/// Latest start of a motion (s): all before it is simulated again and again.
const START_MAX_S: f64 = 1800.0;

/// Longest step of the simulations that lead up to a motion (s).
const STEP_S: f64 = 1e-3;

/// What the arm did since the rope hung still, or all but still, until it stands and a motion is
/// to begin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArmHistory {
    /// How the rope swings at time 0, as the film tells; none where it hangs still.
    pub sway: Sway,
    /// Times of the measured joints (s).
    pub times_s: Vec<f64>,
    /// Measured joints (rad). After the last one the arm holds.
    pub q: Vec<JointVector>,
    /// When the arm will begin to move (s).
    pub start_s: f64,
    /// Commanded pose the arm holds until then (rad).
    pub start_q: JointVector,
}

/// Why a history leads nowhere.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// A value is out of range.
    #[error(transparent)]
    Value(#[from] OutOfRange),
    /// The measured joints make no motion.
    #[error("measured joints: {0}")]
    Joints(#[from] MotionError),
    /// The arm is not known to stand where and when the motion begins.
    #[error("{0}")]
    Start(String),
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The simulated rope blew up.
    #[error("the simulation of the rope diverged; identify the rope again")]
    Diverged,
}

/// What happened before a motion.
#[derive(Debug)]
pub(crate) struct Prelude {
    measured: MeasuredArm,
    /// Swing of the rope at time 0.
    pub(crate) sway: Sway,
    pub(crate) cell: Cell,
    /// When the motion begins (s).
    pub(crate) start_s: f64,
    /// Measured minus commanded pose at rest (rad). The arm is taken to stand as
    /// far from its command after the motion as before it.
    pub(crate) standing_error: JointVector,
}

impl Prelude {
    pub(crate) fn new(history: &ArmHistory, cell: &Cell) -> Result<Self, HistoryError> {
        let measured = MeasuredArm::new(&history.times_s, &history.q, cell.pole)?;
        let last_s = measured.duration_s();
        let start_s = history.start_s;
        if !(start_s >= last_s && start_s > 0.0 && start_s.is_finite()) {
            return Err(HistoryError::Start(format!(
                "the motion would begin {start_s:.3} s after the rope hung still, but the joints were measured until {last_s:.3} s; begin it later"
            )));
        }
        let expected = "at most half an hour (1800 s)";
        OutOfRange::check([("start_s", start_s, start_s <= START_MAX_S, expected)])?;
        let standing_error = measured.joints_at(start_s).q - history.start_q;
        for (joint, off_rad) in (1..).zip(standing_error.iter()) {
            if off_rad.is_nan() || off_rad.abs() > START_TOLERANCE_RAD {
                return Err(HistoryError::Start(format!(
                    "joint {joint} stands {off_rad:.4} rad away from the start of the motion; hold the start pose first"
                )));
            }
        }
        Ok(Self {
            measured,
            sway: history.sway,
            cell: *cell,
            start_s,
            standing_error,
        })
    }

    /// Where each rope will be when the motion begins; none for one whose simulation diverges.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub(crate) fn lead_to(
        &self,
        ropes: &[RopeParams],
        (precision, threads): (Precision, usize),
    ) -> Result<Vec<Option<RopeState>>, HistoryError> {
        let arm = &self.measured;
        let led = |rope| Candidate::new(rope, arm).with_sway(self.sway);
        let candidates: Vec<_> = ropes.iter().map(led).collect();
        // A prediction begins with a state as exact as it is.
        let step_s = match precision {
            Precision::F32 => STEP_S,
            Precision::F64 => STEP_S / 4.0,
        };
        let options = SimOptions {
            keeps_end: true,
            threads,
            ..SimOptions::new(step_s, precision, self.start_s)
        };
        let rollouts = roll_out(&candidates, &options)?;
        Ok(rollouts.into_iter().map(|r| r.end).collect())
    }

    /// The arm that makes this move after all that was.
    pub(crate) fn then<'a>(&'a self, trajectory: &'a JointTrajectory) -> ChainedArm<'a> {
        ChainedArm {
            prelude: self,
            trajectory,
        }
    }
}

/// Attach frame of an arm that did what was measured, held, and then follows a
/// planned move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChainedArm<'a> {
    prelude: &'a Prelude,
    trajectory: &'a JointTrajectory,
}

impl AttachMotion for ChainedArm<'_> {
    fn at(&self, t_s: f64) -> FrameMotion {
        let since_start_s = t_s - self.prelude.start_s;
        let state = if since_start_s <= 0.0 {
            self.prelude.measured.joints_at(t_s)
        } else {
            let commanded = self.trajectory.state_at(since_start_s);
            JointState {
                q: commanded.q + self.prelude.standing_error,
                ..commanded
            }
        };
        self.prelude.cell.pole.attach_motion(&state)
    }

    fn duration_s(&self) -> f64 {
        self.prelude.start_s + self.trajectory.duration_s()
    }

    /// Both ends of the move: a clamped spline starts and stops with an
    /// acceleration.
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![self.prelude.start_s, self.duration_s()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerConfig;
    use crate::plan::{PlanRequest, plan, plan_again, start_pose_for};
    use crate::ropes::{random_strike_target, trial_rope};
    use crate::wiggle::{WiggleConfig, wiggle};
    use arm_model::{Limits, Pole};
    use rope_sim::{FrameTimes, Watch};
    use shared_types::{Plan, Task};
    use std::ops::ControlFlow;

    /// Time from the wiggle's end to the throw's begin (s).
    const WAITED_S: f64 = 2.0;

    fn samples(duration_s: f64, at: impl Fn(f64) -> JointVector) -> (Vec<f64>, Vec<JointVector>) {
        let times = (0..).map(|i| f64::from(i) * 0.004);
        let times = times.take_while(|t| *t <= duration_s);
        times.map(|t| (t, at(t))).unzip()
    }

    /// A strike out of the swing that a short wiggle leaves.
    fn request(index: u64) -> (PlanRequest, JointTrajectory) {
        let target_m = random_strike_target(index);
        let short = WiggleConfig::default().short(start_pose_for(target_m));
        let motion = wiggle(&short, &Limits::default()).unwrap();
        let (times_s, q) = samples(motion.duration_s(), |t| motion.state_at(t).q);
        let config = PlannerConfig::default();
        let before = ArmHistory {
            sway: Sway::NONE,
            times_s,
            q,
            start_s: motion.duration_s() + WAITED_S,
            start_q: motion.end(),
        };
        let goal = config.goal(Task::Strike, target_m);
        let request = PlanRequest {
            before: Some(before),
            ..PlanRequest::new(goal, &trial_rope(9_301, index), config.search)
        };
        (request, motion)
    }

    fn planned(request: &PlanRequest) -> Plan {
        plan(request, &mut |_| ControlFlow::Continue(())).unwrap()
    }

    /// Distance of tip and target where wiggle, wait and throw are one measured motion.
    fn error_m(request: &PlanRequest, wiggle: &JointTrajectory, throw: &JointTrajectory) -> f64 {
        let start_s = wiggle.duration_s() + WAITED_S;
        let (times_s, q) = samples(start_s + throw.duration_s() + 0.3, |t| {
            if t < start_s {
                wiggle.state_at(t).q
            } else {
                throw.state_at(t - start_s).q
            }
        });
        let arm = MeasuredArm::new(&times_s, &q, Pole::default()).unwrap();
        let goal = request.goal.task().target_m();
        let options = SimOptions {
            frames: FrameTimes::NONE,
            watch: Watch::point(goal),
            ..SimOptions::new(2.5e-4, Precision::F64, start_s + throw.duration_s() + 0.2)
        };
        let rollouts = roll_out(&[Candidate::new(&request.rope, &arm)], &options).unwrap();
        rollouts[0].watched.to_point.unwrap().distance_m
    }

    #[test]
    fn a_strike_out_of_a_swing_meets_its_target_as_one_motion() {
        for index in 0..4 {
            let (request, motion) = request(index);
            let moving = planned(&request);
            assert!(moving.start.is_some() && moving.predicted_error_m < 1e-3);
            assert!(moving.simulations < 250, "{}", moving.simulations);
            let true_m = error_m(&request, &motion, &moving.trajectory);
            assert!(true_m < 4e-3, "{index}: {true_m}");
            // The arm stands where the throw begins.
            assert_eq!(moving.trajectory.start(), motion.end());
            // The same throw for a rope at rest would miss.
            let resting = PlanRequest {
                before: None,
                ..request.clone()
            };
            let resting_m = error_m(&request, &motion, &planned(&resting).trajectory);
            assert!(resting_m > 4.0 * true_m, "{index}: {resting_m} {true_m}");
            let one = PlanRequest {
                options: crate::plan::PlanOptions {
                    threads: 1,
                    ..request.options
                },
                ..request.clone()
            };
            assert_eq!(planned(&one), moving);
        }
    }

    #[test]
    fn what_leads_nowhere_or_elsewhere_is_refused() {
        type Change = fn(&mut ArmHistory);
        let cases: [(Change, &str); 4] = [
            (|h| h.start_q[0] += 0.1, "stands elsewhere"),
            (|h| h.start_s = 1.0, "would begin 1.000 s"),
            (|h| h.q[3][2] = f64::NAN, "measured joints: "),
            (|h| h.start_s = 1e6, "`start_s`"),
        ];
        for (change, said) in cases {
            let (mut request, _) = request(0);
            change(request.before.as_mut().unwrap());
            let error = plan(&request, &mut |_| ControlFlow::Continue(()));
            let error = error.unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    #[test]
    fn a_throw_out_of_a_swing_is_not_corrected() {
        let (request, _) = request(1);
        let last = planned(&request);
        let again = PlanRequest {
            before: None,
            ..request
        };
        let error = plan_again(&again, &last, [0.01, 0.0, 0.0]).unwrap_err();
        assert!(error.to_string().contains("still swung"), "{error}");
    }
}
