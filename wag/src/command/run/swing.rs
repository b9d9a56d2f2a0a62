//! A throw out of the swing that the wiggle leaves: the rope is not calmed, and the arm does
//! not move in between. Where the rope will be is simulated with what was identified.

use super::rope::CONFIRMED_S;
use super::stages::Run;
use crate::command::known_rope::KnownRope;
use arm_model::JointTrajectory;
use planner::plan::is_worth_swinging;
use rt_controller::os::now_ns;
use run_log::Film;
use session::arm::arm_until;
use shared_types::ipc::message::ControllerRequest;
use shared_types::{MonotonicNs, OperatingMode, Plan};

/// Time allowed for planning before the throw begins, and the longest after plans that came too
/// late, each twice as long (s).
const PLANNING_S: [f64; 2] = [0.45, 1.8];
/// Longest swing, from the wiggle's end to the throw, that is predicted (s).
const SWINGS_S: f64 = 15.0;
/// Least of it that must be left to arm and to begin the film (s).
const LEFT_MIN_S: f64 = 0.1;
/// Latest begin of a throw after its instant (s); the controller refuses it later.
const LATE_MAX_S: f64 = 0.02;
/// What an operator confirms before it.
const SWINGS: &str =
    "The arm stands at the throw's start, which is planned next and begins within seconds.";

impl Run<'_> {
    /// Throws out of the swing, if the run is to be fast: plan and film. Where that promises too
    /// little, or there is no time for it, nothing is thrown, and the rope is to be calmed. Where
    /// an operator must confirm the throw, that is before it is planned.
    pub fn throw_out_of_swing(
        &mut self,
        rope: &KnownRope,
        film: &Film,
        wiggle: &JointTrajectory,
    ) -> anyhow::Result<Option<(Plan, Film)>> {
        if self.setup.short_wiggle.is_none() {
            return Ok(None);
        }
        if let Some(target_m) = self.record.target_m {
            self.place(target_m)?;
        }
        let asked = self.setup.asks.then_some((SWINGS, "THROW"));
        let confirmed = asked.map(|_| self.session.confirm_and_hold(asked));
        let confirmed = confirmed.transpose()?;
        let [mut planning_s, longest_s] = PLANNING_S;
        let (mut resting_m, told) = (None, self.record.warnings.len());
        let why = loop {
            let begin = MonotonicNs(now_ns()).plus_s(planning_s);
            if planning_s > longest_s || begin.since_s(MonotonicNs(film.motion.end_ns)) > SWINGS_S {
                break "planning takes too long here".to_owned();
            }
            if confirmed.is_some_and(|at| begin.since_s(MonotonicNs(at)) > CONFIRMED_S) {
                break "it was confirmed too long before".to_owned();
            }
            if !self.session.is_held() {
                break "the control was let go".to_owned();
            }
            planning_s *= 2.0;
            // A response that is known begins with the arm's delay.
            let known = self.following.as_ref().map(|_| 0.0);
            let Some(lag_s) = known.or(self.record.arm_lag_s) else {
                break "how late the arm follows is not known".to_owned();
            };
            let before = self.history(film, wiggle.end(), begin.plus_s(lag_s))?;
            let plan = match self.plan(rope, Some(before)) {
                Ok(plan) => plan,
                Err(refusal) => break format!("{refusal:#}"),
            };
            // What is as uncertain of a rope at rest, calming does not mend.
            if !is_worth_swinging(&plan, &mut resting_m, || self.plan(rope, None))? {
                break format!(
                    "the forecast reaches up to {:.1} cm",
                    100.0 * plan.reaches_m()
                );
            }
            if let Err(refusal) = self.check_throw(&plan) {
                break format!("{refusal:#}");
            }
            if begin.since_s(MonotonicNs(now_ns())) < LEFT_MIN_S {
                continue;
            }
            self.keep_plan(&plan)?;
            let word = (
                confirmed.or_else(|| Some(now_ns())),
                Some(begin.plus_s(LATE_MAX_S)),
            );
            if let Err(refusal) = arm_until(self.session, &self.arm, OperatingMode::Throw, word) {
                break format!("{refusal:#}");
            }
            if let Some(throw) = self.throw_armed(&plan, Some(begin))? {
                return Ok(Some((plan, throw)));
            }
            self.session
                .ask(&self.arm, &ControllerRequest::Disarm, 5.0, |_| ())?;
            // Of a plan that is not thrown.
            self.record.warnings.truncate(told);
        };
        self.session.end_hold();
        self.record.warnings.truncate(told);
        self.warn(&format!("the rope is calmed before the throw: {why}"));
        self.setup.short_wiggle = None;
        Ok(None)
    }
}
