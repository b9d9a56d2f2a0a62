//! Throws: the tasks, one file each behind one trait, and what they share: the search,
//! errors, start pose and reach.

mod again;
mod assess;
mod config;
mod drape;
mod ensemble;
mod error;
mod filmed;
mod finalists;
mod library;
mod lob;
mod planning;
mod plausible;
mod pole_pose;
mod polish;
mod reach;
mod reach_map;
mod reach_picture;
mod request;
mod robust;
mod screen;
mod search;
mod seen;
mod setup;
mod strike;
mod task;
#[cfg(test)]
mod tests;
mod throw;
mod waypoints;

pub use again::{MISS_STD_M, correction, plan_again};
pub use assess::{Shortcoming, is_worth_swinging, shortcoming, warnings};
pub use config::{PlanOptions, Robustness, ThrowConfig, ThrowWeights};
pub use drape::{Drape, DrapeConfig};
pub use ensemble::{PosteriorEnsemble, TooFewRopes};
pub use error::PlanError;
pub use library::{LibraryError, LibraryOptions, ThrowLibrary};
pub use lob::{Lob, LobConfig};
pub use planning::{plan, plan_task};
pub use pole_pose::PolePose;
pub use reach::{check_reach, clear_of_arm, start_pose_for};
pub use reach_map::ReachMap;
pub use reach_picture::reach_svg;
pub use request::{PlanRequest, ThrowGoal};
pub use screen::Clearance;
pub use seen::{SeenVerdict, judge_seen};
pub use strike::Strike;
pub use task::{ThrowTask, proximity_reward, simulator_for, verdict};
pub use throw::{RopeAtStart, ThrowOutcome, ThrowSimulator};
pub use waypoints::Dimensions;
