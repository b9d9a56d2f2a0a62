//! A throw out of the swing that the wiggle leaves: the rope is not calmed, and the arm does
//! not move in between. Where the rope will be is simulated with what was identified.

use super::rope::CONFIRMED_S;
use super::stages::Run;
use crate::command::known_rope::KnownRope;
use anyhow::bail;
use arm_model::JointTrajectory;
use planner::plan::is_worth_swinging;
use planner::service::Declined;
use rt_controller::os::now_ns;
use run_log::{Film, LATE_MAX_S};
use session::arm::{Refused, arm_to_throw_by};
use shared_types::ipc::message::ControllerRequest;
use shared_types::{MonotonicNs, Plan};

/// Time allowed for planning before the throw begins, and the longest after plans that came too
/// late, each twice as long (s).
const PLANNING_S: [f64; 2] = [0.45, 1.8];
/// Longest swing, from the wiggle's end to the throw, that is predicted (s).
const SWINGS_S: f64 = 15.0;
/// Least of it that must be left to arm and to begin the film (s).
const LEFT_MIN_S: f64 = 0.1;
/// What an operator confirms before it.
const SWINGS: &str = "The arm stands where the throw begins. It is planned once you confirm, and made a second later.";

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
        // A response that is known begins with the arm's delay.
        let known = self.following.as_ref().map(|_| 0.0);
        let Some(lag_s) = known.or(self.record.arm_lag_s) else {
            return self.calm_instead("how late the arm follows is not known");
        };
        let end = MonotonicNs(film.motion.end_ns);
        let swings = |begin: MonotonicNs| begin.since_s(end) < SWINGS_S;
        let asked = self.setup.asks.then_some((SWINGS, "THROW"));
        let asked = asked.filter(|_| swings(MonotonicNs(now_ns())));
        let confirmed = asked.map(|_| self.session.confirm_and_hold(asked));
        let confirmed = confirmed.transpose()?;
        self.session.await_control()?;
        let [mut planning_s, longest_s] = PLANNING_S;
        let (mut resting_m, told) = (None, self.record.warnings.len());
        let why = loop {
            // Of a plan that was not thrown.
            self.record.warnings.truncate(told);
            let begin = MonotonicNs(now_ns()).plus_s(planning_s);
            if planning_s > longest_s {
                break "planning takes too long here".to_owned();
            }
            if !swings(begin) {
                break format!("more than {SWINGS_S:.0} s are over since the wiggle");
            }
            if confirmed.is_some_and(|at| begin.since_s(MonotonicNs(at)) > CONFIRMED_S) {
                break "it was confirmed too long before".to_owned();
            }
            if self.session.is_let_go() {
                bail!("the control was let go before the throw; nothing moved for it");
            }
            if !self.session.is_held() {
                break "the control was let go".to_owned();
            }
            planning_s *= 2.0;
            let before = self.history(film, wiggle.end(), begin.plus_s(lag_s))?;
            let plan = match self.plan(rope, Some(before)) {
                Ok(plan) => plan,
                Err(why) if why.is::<Declined>() => break format!("{why:#}"),
                Err(why) => return Err(why),
            };
            // What is as uncertain of a rope at rest, calming does not mend.
            if !is_worth_swinging(&plan, &mut resting_m, || self.plan(rope, None))? {
                break format!(
                    "the forecast reaches up to {:.1} cm",
                    100.0 * plan.reaches_m()
                );
            }
            if let Err(refusal) = self.check_for_arm(&plan) {
                break format!("{refusal:#}");
            }
            if begin.since_s(MonotonicNs(now_ns())) < LEFT_MIN_S {
                continue;
            }
            self.keep_plan(&plan)?;
            let (confirmed_ns, by) = (confirmed.unwrap_or_else(now_ns), begin.plus_s(LATE_MAX_S));
            match arm_to_throw_by(self.session, &self.arm, confirmed_ns, by) {
                Ok(()) => {}
                Err(why) if Refused::is_late(&why) => continue,
                Err(why) => return Err(why),
            }
            if let Some(throw) = self.throw_armed(&plan, Some(begin))? {
                return Ok(Some((plan, throw)));
            }
            self.session
                .ask(&self.arm, &ControllerRequest::Disarm, 5.0, |_| ())?;
        };
        self.session.end_hold();
        self.record.warnings.truncate(told);
        self.calm_instead(&why)
    }

    /// Goes on as a run that is not to be fast.
    fn calm_instead(&mut self, why: &str) -> anyhow::Result<Option<(Plan, Film)>> {
        self.warn(&format!("the rope is calmed before the throw: {why}"));
        self.setup.short_wiggle = None;
        Ok(None)
    }
}
