//! Identifies rope parameters from one filmed wiggle and plans throws: [`identify`](fn@identify),
//! [`plan`](fn@plan) and [`settle`](fn@settle), called in this process or asked of
//! [`service`] with the same requests.
//!
//! Two searches share one strategy, [`cmaes`]: [`mod@identify`] fits the rope's
//! parameters to keypoints (the paper's Φ-CMA-ES), [`mod@plan`] finds the joint
//! waypoints of a throw (CMA-ES-traj) clear of what [`collide`] knows, and
//! [`mod@settle`] the move between wiggle and throw after which the rope hangs still.
//! [`wiggle`] makes the motion that is filmed. [`arm_response`] finds how
//! the arm follows its setpoints, and [`preflight`] what it will make of a plan.
//! [`synthetic`] makes recordings of known ropes with
//! the errors of real ones. The physics is that of `rope-sim`.
//!
//! ```no_run
//! use planner::plan::PlanRequest;
//! use planner::{PlannerConfig, ropes::random_rope};
//! use shared_types::Task;
//! use std::ops::ControlFlow;
//!
//! let config = PlannerConfig::default();
//! let goal = config.goal(Task::Strike, [0.95, 0.0, 0.2]);
//! let request = PlanRequest::new(goal, &random_rope(1), config.search);
//! let plan = planner::plan(&request, &mut |_| ControlFlow::Continue(()))?;
//! println!("{:.1} mm off", 1e3 * plan.predicted_error_m);
//! # Ok::<(), planner::plan::PlanError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod arm_response;
pub mod collide;
mod config;
pub mod features;
pub mod history;
pub mod identify;
pub mod observation;
mod out_of_range;
pub mod phi;
pub mod plan;
pub mod preflight;
pub mod ropes;
pub mod service;
pub mod settle;
pub mod synthetic;
pub mod wiggle;
pub mod wiggle_design;
pub mod workers;

pub use config::PlannerConfig;
pub use identify::identify;
pub use out_of_range::{OutOfRange, Rule};
pub use plan::plan;
pub use settle::settle;
