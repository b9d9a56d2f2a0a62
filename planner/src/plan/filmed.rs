//! A lob or drape that was filmed: what the camera looks for, until when, and the verdict.

use super::{SeenVerdict, ThrowGoal, judge_seen};
use arm_model::{Cell, JointTrajectory};
use shared_types::ipc::message::{DominoLook, SeenThrow};
use shared_types::{MonotonicNs, RopeParams, Task, Verdict};

/// By how much a film may end early (s).
const ENDS_EARLY_S: f64 = 0.1;

impl ThrowGoal {
    /// How long the rope comes to rest after the motion's end (s); of a strike it does not.
    #[must_use]
    pub fn rests_s(&self) -> Option<f64> {
        (self.kind() != Task::Strike).then(|| self.task().config().observed_s)
    }

    /// The domino to look for, by its colour; none where the task has none.
    #[must_use]
    pub fn domino_look(&self, cell: &Cell, rgb: [u8; 3]) -> Option<DominoLook> {
        let domino = self.task().scene(cell).domino?;
        Some(DominoLook {
            rgb,
            foot_m: domino.foot_m,
            height_m: domino.height_m,
        })
    }

    /// Judges a throw of this motion as it was seen, by a rig that knows it or by a camera; the
    /// rope tells how large its lead is.
    ///
    /// # Errors
    /// As [`judge_seen`].
    pub fn judge(
        &self,
        (motion, rope): (&JointTrajectory, &RopeParams),
        cell: &Cell,
        seen: &SeenThrow,
    ) -> Result<SeenVerdict, String> {
        let held_m = cell.pole.attach_pose(&motion.end()).0.into();
        judge_seen(self, (rope, held_m), cell, seen)
    }

    /// How long a throw of this motion is looked at, from its begin (s).
    #[must_use]
    pub fn observed_s(&self, motion: &JointTrajectory) -> f64 {
        motion.duration_s() + self.rests_s().unwrap_or_default()
    }

    /// The same of one that began at an instant (CLOCK_MONOTONIC, ns).
    #[must_use]
    pub fn span_ns(&self, motion: &JointTrajectory, from_ns: u64) -> [u64; 2] {
        let until = MonotonicNs(from_ns).plus_s(self.observed_s(motion));
        [from_ns, until.0]
    }

    /// Judges it by what its film shows in that time.
    ///
    /// # Errors
    /// In words: as [`judge_seen`], or the film ends too early.
    pub fn judge_film(
        &self,
        (motion, rope): (&JointTrajectory, &RopeParams),
        cell: &Cell,
        seen: &SeenThrow,
    ) -> Result<Verdict, String> {
        let until_s = self.observed_s(motion);
        if seen.end_s <= until_s - ENDS_EARLY_S {
            return Err(format!(
                "the film ends {:.1} s after the throw's begin, the rope must rest until {until_s:.1} s: is it this throw's film with its own CSV of times, and was it recorded at the rate of the camera's mode?",
                seen.end_s
            ));
        }
        let judged = self.judge((motion, rope), cell, seen)?;
        Ok(judged.verdict)
    }
}
