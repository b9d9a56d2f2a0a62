//! Plans on their way in: announced, uploaded, kept until they are asked to run.
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
#[derive(Default)]
pub(super) struct Uploads {
    /// Its fingerprint, until when it is awaited, and who announced it.
    announced: Option<(Hash, Instant, ControllerCall)>,
    plan: Option<(Hash, Box<JointTrajectory>)>,
}

impl Uploads {
    /// Whether the plan with this hash is here.
    fn has(&self, sha256: &Hash) -> bool {
        self.plan.as_ref().is_some_and(|(hash, _)| hash == sha256)
    }

    /// Takes the plan with this hash, if it is here: what was asked to run once runs again only
    /// when somebody uploads it again.
    pub(super) fn take(&mut self, sha256: &Hash) -> Option<Box<JointTrajectory>> {
        let its = self.plan.take_if(|(hash, _)| hash == sha256);
        its.map(|(_, plan)| plan)
    }

    /// Serves an announcement; it is answered with the plan's arrival.
    pub(super) fn serve_announcement(&mut self, call: ControllerCall, sha256: Hash) {
        if self.has(&sha256) {
            return answer(&call, &ControllerEvent::Done);
        }
        let until = Instant::now() + UPLOAD_WITHIN;
        if let Some((_, _, before)) = self.announced.replace((sha256, until, call)) {
            refuse(&before, FaultCode::WrongMode, "another plan was announced");
        }
    }

    /// Serves an upload, and whoever announced it.
    pub(super) fn serve_upload(
        &mut self,
        call: &ControllerCall,
        trajectory: &JointTrajectory,
        sha256: Hash,
    ) {
        if trajectory_hash(trajectory) != sha256 {
            return refuse(call, FaultCode::PlanHashMismatch, "");
        }
        self.plan = Some((sha256, Box::new(*trajectory)));
        answer(call, &ControllerEvent::Done);
        let its = self.announced.take_if(|(hash, _, _)| *hash == sha256);
        if let Some((_, _, announcer)) = its {
            answer(&announcer, &ControllerEvent::Done);
        }
    }

    /// Refuses an announcement whose plan did not come. Call it every turn.
    pub(super) fn settle(&mut self) {
        let now = Instant::now();
        let late = self.announced.take_if(|(_, until, _)| now > *until);
        if let Some((_, _, call)) = late {
            refuse(&call, FaultCode::UploadTimedOut, "");
        }
    }
}
