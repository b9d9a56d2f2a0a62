//! Where a rope's tip gets to at all, in the vertical plane of a throw.
//!
//! Varied throws that the arm may execute are simulated; every cell that the tip passes
//! before the rope meets the arm remembers a throw that led there. New throws are made by
//! changing those that came to rarely visited cells, so the edge moves outwards (the
//! archive of J.-B. Mouret and J. Clune, "Illuminating search spaces by mapping elites").

use super::screen::Screen;
use super::waypoints::{Dimensions, WAYPOINTS, WaypointSpace};
use super::{PlanError, ThrowConfig, start_pose_for};
use crate::collide::{ArmShape, RopeShape, rope_contacts};
use arm_model::{Cell, JointTrajectory, JointVector, Limits};
use nalgebra::Vector3;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use rope_sim::{Candidate, FrameTimes, PlannedArm, Precision, Rollout, SimOptions, roll_out};
use shared_types::RopeParams;
use std::collections::BTreeMap;

/// Edge of a cell (m).
pub(super) const CELL_M: f64 = 0.05;
/// Throws of one round, and rounds.
const THROWS: usize = 192;
const ROUNDS: usize = 14;
/// Draws of one throw before it is given up.
const DRAWS_MAX: usize = 400;
/// Period at which tip and contacts are looked at (s).
const PERIOD_S: f64 = 0.010;
const STEP_S: f64 = 1e-3;
/// Distance to a cell that was reached within which a target counts as in reach (m).
const NEAR_M: f64 = 0.10;

/// A cell: columns outwards from the base axis, rows upwards from the base.
pub(super) type GridCell = (i32, i32);

/// What the throws reached.
#[derive(Debug, Clone, PartialEq)]
pub struct ReachMap {
    /// Throws that passed each cell that was reached.
    pub(super) cells: BTreeMap<GridCell, u32>,
    /// Throws simulated.
    pub throws: u32,
}

/// Each cell's throw, and how many passed the cell.
type Archive = BTreeMap<GridCell, (Vec<f64>, u32)>;

impl ReachMap {
    /// Explores the reach of a rope; about a second. Deterministic for a seed, whatever
    /// the threads.
    ///
    /// # Errors
    /// A rope that is not physical, a value out of range, limits under which nothing moves.
    pub fn explore(
        rope: &RopeParams,
        limits: &Limits,
        cell: &Cell,
        config: &ThrowConfig,
        seed: u64,
        threads: usize,
    ) -> Result<Self, PlanError> {
        rope.validate()?;
        config.check()?;
        let space = WaypointSpace {
            start: start_pose_for([1.0, 0.0, 0.0]),
            dimensions: Dimensions::Planar,
            turn_max_rad: 0.0,
            stands: false,
            times_s: config.waypoint_times_s,
            stretch_max: 1.0,
        };
        let screen = Screen::new(space.clone(), limits.clone(), *cell, config.clearance)?;
        let std_dev = space.std_dev(&JointVector(config.std_dev_rad));
        let mut rng = ChaCha12Rng::seed_from_u64(seed ^ 0x4ea_c400);
        let mut archive = Archive::new();
        let mut throws = 0;
        for _ in 0..ROUNDS {
            let points: Vec<Vec<f64>> = (0..THROWS)
                .filter_map(|_| draw(&space, &screen, &std_dev, &archive, &mut rng))
                .collect();
            let paths = tip_paths(rope, &space, cell, config, &points, threads)?;
            throws += u32::try_from(points.len()).unwrap_or(u32::MAX);
            for (x, path) in points.into_iter().zip(paths) {
                for passed in path {
                    archive.entry(passed).or_insert_with(|| (x.clone(), 0)).1 += 1;
                }
            }
        }
        let cells = archive
            .into_iter()
            .map(|(cell, (_, passed))| (cell, passed));
        Ok(Self {
            cells: cells.collect(),
            throws,
        })
    }

    /// Middle of a cell: distance from the base axis and height (m).
    pub(super) fn middle_m((column, row): GridCell) -> [f64; 2] {
        [column, row].map(|i| (f64::from(i) + 0.5) * CELL_M)
    }

    /// Refuses a target far from everything that was reached.
    ///
    /// # Errors
    /// [`PlanError::Unreachable`] with the middle of the nearest cell, on the target's
    /// bearing.
    pub fn check(&self, target_m: [f64; 3]) -> Result<(), PlanError> {
        let [x, y, z] = target_m;
        let rho_m = x.hypot(y);
        let away_m = |cell: GridCell| {
            let [rho, up] = Self::middle_m(cell);
            (rho - rho_m).hypot(up - z)
        };
        let nearest = self.cells.keys().copied();
        let nearest = nearest.min_by(|a, b| away_m(*a).total_cmp(&away_m(*b)));
        let Some(cell) = nearest.filter(|cell| away_m(*cell) > NEAR_M) else {
            return Ok(());
        };
        let [rho, up] = Self::middle_m(cell);
        let (sin, cos) = y.atan2(x).sin_cos();
        Err(PlanError::Unreachable {
            target_m,
            nearest_m: [rho * cos, rho * sin, up],
            reason: format!(
                "of {} varied throws of this rope none came within {:.0} cm of it",
                self.throws,
                100.0 * away_m(cell)
            ),
        })
    }
}

/// A throw near one that came to a rarely visited cell, or any throw.
fn draw(
    space: &WaypointSpace,
    screen: &Screen,
    std_dev: &[f64],
    archive: &Archive,
    rng: &mut ChaCha12Rng,
) -> Option<Vec<f64>> {
    let kept: Vec<&(Vec<f64>, u32)> = archive.values().collect();
    let parent = kept
        .choose_weighted(rng, |(_, passed)| 1.0 / f64::from((*passed).max(1)))
        .ok()
        .filter(|_| rng.random_bool(0.9));
    let (middle, spread) = match parent {
        Some((x, _)) => (x.clone(), rng.random_range(0.1..0.6)),
        None => (space.resting(), 1.0),
    };
    (0..DRAWS_MAX)
        .map(|_| {
            let moved =
                |(m, s): (&f64, &f64)| m + spread * s * rng.sample::<f64, _>(StandardNormal);
            middle.iter().zip(std_dev).map(moved).collect::<Vec<f64>>()
        })
        .find(|x| screen.accepts(x))
}

/// The cells each throw's tip passes before its rope meets arm, column or floor.
fn tip_paths(
    rope: &RopeParams,
    space: &WaypointSpace,
    cell: &Cell,
    config: &ThrowConfig,
    points: &[Vec<f64>],
    threads: usize,
) -> Result<Vec<Vec<GridCell>>, PlanError> {
    let motions = points
        .iter()
        .map(|x| Ok(PlannedArm::new(space.decode(x)?, cell.pole)))
        .collect::<Result<Vec<_>, PlanError>>()?;
    let candidates: Vec<Candidate> = motions.iter().map(|m| Candidate::new(rope, m)).collect();
    let horizon_s = space.times_s[WAYPOINTS - 1] + config.tail_s;
    let count = (horizon_s / PERIOD_S).floor() as usize + 1;
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: PERIOD_S,
            count,
        },
        threads,
        ..SimOptions::new(STEP_S, Precision::F32, horizon_s)
    };
    let rollouts = roll_out(&candidates, &options)?;
    let path =
        |(motion, rollout): (&PlannedArm, _)| passed(rope, motion.trajectory(), rollout, cell);
    Ok(motions.iter().zip(&rollouts).map(path).collect())
}

fn passed(
    rope: &RopeParams,
    motion: &JointTrajectory,
    rollout: &Rollout,
    cell: &Cell,
) -> Vec<GridCell> {
    let shape = RopeShape::from(rope);
    let track = &rollout.nodes;
    let mut cells = Vec::new();
    for (frame, k) in (0..track.frames()).zip(0_u32..) {
        let nodes: Vec<Vector3<f64>> = (0..track.nodes())
            .map(|node| track.position(frame, node))
            .collect();
        let arm = ArmShape::at(&motion.state_at(f64::from(k) * PERIOD_S).q, &cell.pole);
        let free = rope_contacts(&arm, cell, &shape, &nodes).none();
        let Some(tip) = nodes.last().filter(|tip| free && tip.x.is_finite()) else {
            break;
        };
        let at = |v: f64| (v / CELL_M).floor() as i32;
        cells.push((at(tip.x), at(tip.z)));
    }
    cells.sort_unstable();
    cells.dedup();
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The densely covered region of the task's facts is reached, what is further from the
    /// shoulder than arm, pole and rope together is not, and the nearest point named is in
    /// reach itself.
    #[test]
    fn the_map_has_the_known_reach() {
        let mut rope = crate::ropes::random_rope(4);
        rope.length_m = 0.45;
        let config = ThrowConfig::default();
        let (limits, cell) = (Limits::default(), Cell::default());
        let explore =
            |threads| ReachMap::explore(&rope, &limits, &cell, &config, 1, threads).unwrap();
        let map = explore(2);
        assert_eq!(map, explore(1));
        for (rho, z) in [(0.6, 0.0), (0.9, 0.3), (1.0, 0.0), (1.1, 0.2)] {
            assert!(map.check([rho, 0.0, z]).is_ok(), "({rho}, {z})");
            let turned = [rho * 0.8, rho * 0.6, z];
            assert!(map.check(turned).is_ok(), "{turned:?}");
        }
        for far in [[1.60, 0.0, 0.2], [1.0, -1.0, 1.0]] {
            let Err(PlanError::Unreachable { nearest_m, .. }) = map.check(far) else {
                panic!("{far:?} is said to be in reach");
            };
            assert!(map.check(nearest_m).is_ok(), "{nearest_m:?}");
            let bearing = |p: [f64; 3]| p[1].atan2(p[0]);
            assert!((bearing(nearest_m) - bearing(far)).abs() < 1e-9);
        }
    }
}
