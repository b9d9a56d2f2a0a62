//! A throw out of the swing that the wiggle leaves: the rope is not calmed, and the arm does
//! not move in between. Where the rope will be is simulated with what was identified.

use super::rope::CONFIRMED_S;
use super::stages::Run;
use crate::command::known_rope::KnownRope;
use crate::pipeline::arm_for;
use arm_model::JointTrajectory;
use planner::plan::is_worth_swinging;
use rt_controller::os::now_ns;
use run_log::Film;
use shared_types::{MonotonicNs, OperatingMode, Plan};

/// What an operator is asked once the rope is identified.
const QUESTION: (&str, &str) = (
    "The arm stands at the start, and the rope swings. Unless that leaves too much open, it will throw within ten seconds of your word.",
    "THROW",
);
/// Time allowed for planning before the throw begins, and the longest after plans that came too
/// late, each twice as long (s).
const PLANNING_S: [f64; 2] = [0.45, 1.8];
/// Least of it that must be left to arm and to begin the film (s).
const LEFT_MIN_S: f64 = 0.1;
impl Run<'_> {
    /// Throws out of the swing, if the run is to be fast: plan and film. Where that promises too
    /// little, or there is no time for it, nothing is thrown, and the rope is to be calmed.
    pub fn throw_out_of_swing(
        &mut self,
        rope: &KnownRope,
        film: &Film,
        wiggle: &JointTrajectory,
    ) -> anyhow::Result<Option<(Plan, Film)>> {
        if !self.setup.fast {
            return Ok(None);
        }
        if let Some(target_m) = self.record.target_m {
            self.place(target_m)?;
        }
        let asked = self.setup.asks.then_some(QUESTION);
        let confirmed_ns = self.session.confirm_and_hold(asked)?;
        let [mut planning_s, longest_s] = PLANNING_S;
        let mut is_worth = false;
        let why = loop {
            let begin = MonotonicNs(now_ns()).plus_s(planning_s);
            if begin.since_s(MonotonicNs(confirmed_ns)) > CONFIRMED_S {
                break "the confirmation is too old".to_owned();
            }
            // A response that is known begins with the arm's delay.
            let lag_s = self.record.arm_lag_s.filter(|_| self.following.is_none());
            let start = begin.plus_s(lag_s.unwrap_or_default());
            let before = self.history(film, wiggle.end(), start)?;
            let plan = self.plan(rope, Some(before))?;
            // What is as uncertain of a rope at rest, calming does not mend.
            is_worth = is_worth || is_worth_swinging(&plan, || self.plan(rope, None))?;
            if !is_worth {
                break format!(
                    "the forecast reaches up to {:.1} cm",
                    100.0 * plan.reaches_m()
                );
            }
            if begin.since_s(MonotonicNs(now_ns())) > LEFT_MIN_S {
                // The one from rest may lie there.
                self.keep_plan(&plan)?;
                let (session, mode) = (&mut *self.session, OperatingMode::Throw);
                arm_for(session, &self.arm, mode, Some(confirmed_ns))?;
                if let Some(throw) = self.throw_armed(&plan, Some(begin))? {
                    return Ok(Some((plan, throw)));
                }
            }
            if planning_s >= longest_s {
                break "planning takes too long here".to_owned();
            }
            planning_s *= 2.0;
        };
        self.warn(&format!("the rope is calmed before the throw: {why}"));
        self.setup.fast = false;
        Ok(None)
    }
}
