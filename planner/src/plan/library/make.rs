//! Makes a library: the throws that searches for random ropes and targets try on their way.

use super::super::planning::check;
use super::super::setup::Setup;
use super::super::{
    Dimensions, PlanError, PlanOptions, PlanRequest, Strike, ThrowConfig, ThrowGoal,
};
use super::{StoredThrow, ThrowLibrary};
use crate::ropes::{random_rope, random_strike_target};
use arm_model::JointTrajectory;
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};
use shared_types::ipc::message::Progress;
use shared_types::{RopeParams, VERSION};
use std::cell::RefCell;
use std::ops::ControlFlow;

/// Size of a library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LibraryOptions {
    /// Seed of ropes, targets and searches.
    pub seed: u64,
    /// Searches, each for a rope and a target of its own.
    pub searches: u32,
    /// Throws kept of each.
    pub kept: usize,
}

/// Keeps ropes and targets apart from those of trials.
const SALT: u64 = 0x11b4_0000_0000_0000;
/// Of the instants at which contacts are looked for, every so many is kept.
const EVERY: usize = 2;

impl ThrowLibrary {
    /// Makes a library. Deterministic, whatever the threads; `progress` is told of every search,
    /// and interrupting it leaves those before.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub fn make(
        options: LibraryOptions,
        threads: usize,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Self, PlanError> {
        let config = ThrowConfig::default();
        let mut throws = Vec::new();
        for index in 0..options.searches {
            throws.extend(kept_of(&options, u64::from(index), &config, threads)?);
            let went = Progress {
                done: index + 1,
                total: options.searches,
                value: throws.len() as f64,
                label: "throws".to_owned(),
            };
            if progress(went).is_break() {
                break;
            }
        }
        Ok(Self {
            version: VERSION.to_owned(),
            options,
            times_s: config.waypoint_times_s,
            period_s: EVERY as f64 * config.contact_period_s,
            throws,
        })
    }
}

/// Throws that one search tried; none where it has no target.
fn kept_of(
    options: &LibraryOptions,
    index: u64,
    config: &ThrowConfig,
    threads: usize,
) -> Result<Vec<StoredThrow>, PlanError> {
    let seed = SALT ^ (options.seed << 32) ^ index;
    let rope = random_rope(seed);
    let [x, y, z] = random_strike_target(seed);
    let strike = Strike {
        target_m: [x.hypot(y), 0.0, z],
        config: config.clone(),
    };
    let search = PlanOptions {
        seed,
        threads,
        ..PlanOptions::default()
    };
    let request = PlanRequest::new(ThrowGoal::Strike(strike), &rope, search);
    let task = request.goal.task();
    if check(task, &request).is_err() {
        return Ok(Vec::new());
    }
    let mut setup = Setup::new(task, &request)?;
    setup.searching.keeps_tip = true;
    let tried = RefCell::new(Vec::new());
    let value = |trajectories: &[JointTrajectory]| {
        let outcomes = setup.thrown(trajectories)?;
        let valued = setup.valued(trajectories, &outcomes);
        let free = trajectories.iter().zip(outcomes);
        let free = free.filter(|(_, o)| o.finite && o.contacts.none());
        let kept = free.map(|(t, o)| StoredThrow::new(&request.rope, t, &o.tip_m));
        tried.borrow_mut().extend(kept);
        Ok(valued)
    };
    setup.explore(&setup.search_of(0), value, &mut |_| {
        ControlFlow::Continue(())
    })?;
    let tried = tried.into_inner();
    let count = options.kept.min(tried.len());
    let kept = sample(&mut ChaCha12Rng::seed_from_u64(seed), tried.len(), count);
    Ok(kept.into_iter().map(|i| tried[i].clone()).collect())
}

impl StoredThrow {
    fn new(rope: &RopeParams, throw: &JointTrajectory, tip_m: &[[f64; 3]]) -> Self {
        let (knots, joints) = (throw.waypoints(), Dimensions::Planar.joints());
        let mm = |m: f64| (m * 1e3).round() as i16;
        let tip_mm = |[x, _, z]: &[f64; 3]| [mm(*x), mm(*z)];
        Self {
            rope: rope.to_array().map(|v| v as f32),
            waypoints_rad: core::array::from_fn(|i| {
                core::array::from_fn(|k| knots[i + 1][joints[k]] as f32)
            }),
            tip_mm: tip_m.iter().step_by(EVERY).map(tip_mm).collect(),
        }
    }
}
