//! The last step of a search: Gauss-Newton with the simulator's slopes.
//!
//! The miss is the vector from the target to the tip at its closest. Slopes with respect
//! to the waypoints come from neighbouring throws, the miss itself from double precision
//! at half the step, so that it ends at zero of the finest model. There are more
//! coordinates than the miss has, so a step can be made in many ways; where the shortest
//! breaks a limit of the arm, others are tried before it is cut.

use super::PlanError;
use super::setup::{Count, Setup};
use nalgebra::{DMatrix, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rope_sim::sensitivity::{Family, Perturbation, sensitivities};
use rope_sim::{Candidate, ClosestApproach, FrameTimes, PlannedArm, SimOptions};

/// Step of a coordinate for slopes (rad): it moves the tip by a hundred times the
/// rounding of single precision.
const STEP_RAD: f64 = 4e-3;
/// Misses below this are left alone (m).
const ENOUGH_M: f64 = 5e-5;
const ITERATIONS: usize = 4;
/// Ways of making a step that are tried against the limits.
const WAYS: usize = 40;
/// Fractions of a step that are tried.
const FRACTIONS: [f64; 3] = [1.0, 0.5, 0.25];
/// Damping of the least squares (m²/rad²).
const DAMPING: f64 = 1e-6;

impl Setup<'_> {
    /// Moves some points of the space towards throws that meet the target; returns them in
    /// their order, none worse than before.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub(super) fn polish(
        &self,
        mut points: Vec<Vec<f64>>,
        count: &mut Count,
    ) -> Result<Vec<Vec<f64>>, PlanError> {
        let start = self.simulator.arm(&self.space.decode(&self.start)?)?;
        let motion_s = start.trajectory().duration_s();
        let motion_s = motion_s.max(self.simulator.motion_s_min);
        let rough = self.simulator.options(motion_s, FrameTimes::NONE);
        let exact = self.simulator.exact();
        let exact = exact.options(motion_s, FrameTimes::NONE);
        count.add(points.len());
        let mut approaches = self.approaches(&points, &exact)?;
        let mut rng = ChaCha12Rng::seed_from_u64(self.request.options.seed ^ 0x9011_5400);
        let mut open: Vec<usize> = (0..points.len()).collect();
        for _ in 0..ITERATIONS {
            let misses = |a: ClosestApproach| a.distance_m > ENOUGH_M && a.distance_m.is_finite();
            open.retain(|i| approaches[*i].is_some_and(misses));
            if open.is_empty() {
                break;
            }
            let at: Vec<&[f64]> = open.iter().map(|i| points[*i].as_slice()).collect();
            let slopes = self.slopes(&at, &rough)?;
            count.add(open.len() * (1 + self.space.pose_count()));
            let (mut tried, mut owners) = (Vec::new(), Vec::new());
            for (i, slopes) in open.iter().zip(&slopes) {
                if let (Some(slopes), Some(approach)) = (slopes, &approaches[*i]) {
                    let steps = self.steps(&points[*i], slopes, approach, &mut rng);
                    owners.extend(steps.iter().map(|_| *i));
                    tried.extend(steps);
                }
            }
            count.add(tried.len());
            let found = self.approaches(&tried, &exact)?;
            let mut moved = Vec::new();
            for ((x, approach), i) in tried.into_iter().zip(found).zip(owners) {
                let before = approaches[i].map_or(f64::INFINITY, |a| a.distance_m);
                if approach.is_some_and(|a| a.distance_m < before) {
                    (points[i], approaches[i]) = (x, approach);
                    moved.push(i);
                }
            }
            open.retain(|i| moved.contains(i));
        }
        Ok(points)
    }

    fn motions(&self, points: &[impl AsRef<[f64]>]) -> Result<Vec<PlannedArm>, PlanError> {
        let motion = |x: &[f64]| self.simulator.arm(&self.space.decode(x)?);
        points.iter().map(|x| motion(x.as_ref())).collect()
    }

    /// Closest approach of each point in a simulation; `None` if it diverged.
    fn approaches(
        &self,
        points: &[Vec<f64>],
        options: &SimOptions,
    ) -> Result<Vec<Option<ClosestApproach>>, PlanError> {
        let motions = self.motions(points)?;
        let own = self.own();
        let candidates: Vec<Candidate> = motions.iter().map(|m| own.on(m)).collect();
        let rollouts = rope_sim::roll_out(&candidates, options)?;
        Ok(rollouts.into_iter().map(|r| r.watched.to_point).collect())
    }

    /// Slopes of the tip's place at its closest, one column per coordinate.
    fn slopes(
        &self,
        points: &[&[f64]],
        options: &SimOptions,
    ) -> Result<Vec<Option<DMatrix<f64>>>, PlanError> {
        // Neighbours with other times would be simulated in other steps, and differ by
        // more than the slope: the times stay as they were found.
        let (n, all_coordinates) = (self.space.pose_count(), self.space.count());
        let bases = self.motions(points)?;
        let mut moved = Vec::with_capacity(points.len() * n);
        for x in points {
            for i in 0..n {
                let mut y = x.to_vec();
                y[i] += STEP_RAD;
                moved.push(y);
            }
        }
        let moved = self.motions(&moved)?;
        let perturbations: Vec<Perturbation> = moved
            .iter()
            .map(|motion| Perturbation::Motion {
                motion,
                distance: STEP_RAD,
            })
            .collect();
        let families: Vec<Family> = bases
            .iter()
            .zip(perturbations.chunks(n))
            .map(|(motion, perturbations)| Family {
                base: self.own().on(motion),
                perturbations,
            })
            .collect();
        let all = sensitivities(&families, options)?;
        Ok(all
            .iter()
            .map(|s| {
                let columns: Vec<Option<[f64; 3]>> = (0..n).map(|i| s.closest_tip_m(i)).collect();
                // A neighbour that comes closest elsewhere says nothing.
                let known = columns.iter().any(Option::is_some);
                let slope = |row: usize, k: usize| {
                    columns.get(k).copied().flatten().map_or(0.0, |c| c[row])
                };
                known.then(|| DMatrix::from_fn(3, all_coordinates, slope))
            })
            .collect())
    }

    /// Points that the arm may execute and that should miss by less: the shortest step
    /// first, then others, then parts of them.
    fn steps(
        &self,
        x: &[f64],
        slopes: &DMatrix<f64>,
        approach: &ClosestApproach,
        rng: &mut ChaCha12Rng,
    ) -> Vec<Vec<f64>> {
        const KEPT: usize = 2;
        let target = self.simulator.watch.point_m.unwrap_or_default();
        let miss = Vector3::from(approach.tip_m) - Vector3::from(target);
        let v = Vector3::from(approach.velocity_m_s);
        // Along its way the tip only comes earlier or later.
        let across = Matrix3::identity() - v * v.transpose() / v.norm_squared().max(1e-12);
        let slopes = DMatrix::from_fn(3, x.len(), |i, k| {
            let column = slopes.column(k);
            across.row(i).transpose().dot(&column.fixed_rows::<3>(0))
        });
        let mut kept = Vec::new();
        for fraction in FRACTIONS {
            for way in 0..WAYS {
                let mut weight = || match way {
                    0 => 1.0,
                    _ => rng.random_range(0.0..1.0),
                };
                let weights: Vec<f64> = x.iter().map(|_| weight()).collect();
                let weighted = DMatrix::from_fn(3, x.len(), |i, k| slopes[(i, k)] * weights[k]);
                let normal = &weighted * slopes.transpose() + DMatrix::identity(3, 3) * DAMPING;
                let miss = DMatrix::from_column_slice(3, 1, miss.as_slice());
                let Some(pull) = normal.lu().solve(&miss) else {
                    continue;
                };
                let step = weighted.tr_mul(&pull);
                let part = x.iter().zip(step.iter());
                let y: Vec<f64> = part.map(|(x, s)| x - fraction * s).collect();
                if self.screen.accepts(&y) {
                    kept.push(y);
                    if kept.len() == KEPT {
                        return kept;
                    }
                }
            }
        }
        kept
    }
}
