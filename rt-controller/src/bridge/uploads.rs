//! Plans on their way in: announced, uploaded, kept until they run.
//!
//! A plan travels whole in one request and is copied and hash-checked before
//! anything moves; while it runs nothing is read from whoever made it. Whoever
//! wants to run a plan that somebody else uploads announces it first, and hears
//! when it is there or that it did not come in time.

use super::answers::{ControllerCall, answer, refuse};
use arm_model::JointTrajectory;
use shared_types::FaultCode;
use shared_types::ipc::message::ControllerEvent;
use shared_types::plan::trajectory_hash;
use std::time::{Duration, Instant};

/// Longest time from an announcement to the plan.
const UPLOAD_WITHIN: Duration = Duration::from_secs(2);

/// Fingerprint of a trajectory.
type Hash = [u8; 32];

/// The announced and the uploaded plan, one of each; newer ones replace them.
/// `A` is whoever announced.
#[derive(Debug)]
pub(super) struct Uploads<A = ControllerCall> {
    announced: Option<(Hash, Instant, A)>,
    plan: Option<(Hash, Box<JointTrajectory>)>,
}

impl<A> Default for Uploads<A> {
    fn default() -> Self {
        Self {
            announced: None,
            plan: None,
        }
    }
}

impl<A> Uploads<A> {
    /// A plan with this hash will come; `who` wants to know. Whoever announced
    /// another one before is returned.
    fn await_plan(&mut self, sha256: Hash, now: Instant, who: A) -> Option<A> {
        let until = now + UPLOAD_WITHIN;
        self.announced
            .replace((sha256, until, who))
            .map(|(_, _, before)| before)
    }

    /// Keeps a plan. Returns who announced it, if somebody did.
    fn keep(&mut self, trajectory: &JointTrajectory, sha256: Hash) -> Result<Option<A>, FaultCode> {
        if trajectory_hash(trajectory) != sha256 {
            return Err(FaultCode::PlanHashMismatch);
        }
        self.plan = Some((sha256, Box::new(*trajectory)));
        let mine = self.announced.take_if(|(hash, _, _)| *hash == sha256);
        Ok(mine.map(|(_, _, who)| who))
    }

    /// Whoever announced a plan that did not come in time.
    fn overdue(&mut self, now: Instant) -> Option<A> {
        let late = self.announced.take_if(|(_, until, _)| now > *until);
        late.map(|(_, _, who)| who)
    }

    /// The plan with this hash, if it is here.
    pub(super) fn plan(&self, sha256: &Hash) -> Option<&JointTrajectory> {
        let (hash, plan) = self.plan.as_ref()?;
        (hash == sha256).then_some(plan)
    }
}

impl Uploads {
    /// Serves an announcement; it is answered with the plan's arrival.
    pub(super) fn serve_announcement(&mut self, call: ControllerCall, sha256: Hash) {
        if self.plan(&sha256).is_some() {
            return answer(&call, &ControllerEvent::Done);
        }
        if let Some(before) = self.await_plan(sha256, Instant::now(), call) {
            refuse(&before, FaultCode::WrongMode, "another plan was announced");
        }
    }

    /// Serves an upload.
    pub(super) fn serve_upload(
        &mut self,
        call: &ControllerCall,
        trajectory: &JointTrajectory,
        sha256: Hash,
    ) {
        match self.keep(trajectory, sha256) {
            Ok(announcer) => {
                answer(call, &ControllerEvent::Done);
                if let Some(announcer) = announcer {
                    answer(&announcer, &ControllerEvent::Done);
                }
            }
            Err(fault) => refuse(call, fault, ""),
        }
    }

    /// Refuses an announcement whose plan did not come. Call it every turn.
    pub(super) fn settle(&mut self) {
        if let Some(call) = self.overdue(Instant::now()) {
            refuse(&call, FaultCode::UploadTimedOut, "");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    fn plan(by_rad: f64) -> (JointTrajectory, Hash) {
        let mut end = START_POSE;
        end[0] += by_rad;
        let trajectory = JointTrajectory::new(&[0.0, 1.0], &[START_POSE, end]).unwrap();
        (trajectory, trajectory_hash(&trajectory))
    }

    #[test]
    fn an_announced_plan_is_told_when_it_comes_and_no_other_counts() {
        let (now, (trajectory, hash)) = (Instant::now(), plan(0.1));
        let (other, other_hash) = plan(0.2);
        let late = now + UPLOAD_WITHIN + Duration::from_millis(1);
        let mut uploads = Uploads::default();
        assert_eq!(uploads.await_plan(hash, now, "demo"), None);
        let damaged = uploads.keep(&other, hash);
        assert_eq!(damaged, Err(FaultCode::PlanHashMismatch));
        assert_eq!(uploads.keep(&other, other_hash), Ok(None));
        assert_eq!(uploads.overdue(now + UPLOAD_WITHIN), None);
        assert_eq!(uploads.keep(&trajectory, hash), Ok(Some("demo")));
        assert_eq!(uploads.overdue(late), None);
        assert_eq!(uploads.plan(&hash), Some(&trajectory));
        assert_eq!(uploads.plan(&other_hash), None);
        uploads.await_plan(hash, now, "demo");
        assert_eq!(uploads.overdue(late), Some("demo"));
        assert_eq!(uploads.keep(&trajectory, hash), Ok(None), "nobody waits");
    }
}
