//! What the planner is asked, and what it answers.

use crate::identify::IdentifyOptions;
use crate::observation::Appearance;
use crate::plan::PlanRequest;
use crate::settle::{SettleMove, SettleRequest};
use arm_model::{JointVector, Pole};
use serde::{Deserialize, Serialize};
use shared_types::ipc::message::Progress;
use shared_types::ipc::rpc::Rpc;
use shared_types::{Plan, RopeEstimate, StereoCamera};

/// A rope to identify from published keypoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentifyRequest {
    /// Start of exposure of the first keypoint frame to use (CLOCK_MONOTONIC, ns).
    pub first_stamp_ns: u64,
    /// Keypoint frames to use; they come from the keypoint service.
    pub frames: u32,
    /// Calibrated camera.
    pub camera: StereoCamera,
    /// Measured joints: CLOCK_MONOTONIC ns and position (rad).
    pub joints: Vec<(u64, JointVector)>,
    /// The pole that carries the rope.
    pub pole: Pole,
    /// Sizes seen in the picture.
    pub appearance: Appearance,
    /// Method, size and rules.
    pub options: IdentifyOptions,
}

/// Asks of the planner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum PlannerRequest {
    /// Are you there?
    Ping,
    /// Fit the nine rope parameters to published keypoints.
    Identify(Box<IdentifyRequest>),
    /// Plan a throw.
    Plan(Box<PlanRequest>),
    /// Plan a move after which the rope hangs still.
    Settle(Box<SettleRequest>),
}

/// Answers of the planner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum PlannerEvent {
    /// Here I am.
    Pong,
    /// Work goes on.
    Progress(Progress),
    /// The rope is identified.
    Identified(Box<RopeEstimate>),
    /// The throw is planned.
    Planned(Box<Plan>),
    /// The settling move is planned.
    Settled(Box<SettleMove>),
    /// It did not work.
    Failed {
        /// One sentence: what happened and what to do.
        message: String,
    },
}

/// What the planner could not do, as it said.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Declined(pub String);

/// The planner's service.
#[derive(Debug)]
pub struct PlannerRpc;

impl Rpc for PlannerRpc {
    const NAME: &'static str = "wag/v3/planner/control";
    type Request = PlannerRequest;
    type Event = PlannerEvent;
    fn is_last(event: &PlannerEvent) -> bool {
        !matches!(event, PlannerEvent::Progress(_))
    }
}
