//! The last step of a search: Gauss-Newton with the simulator's slopes.
//!
//! The miss is the vector from the target to the tip at its closest. Slopes with respect
//! to the waypoints come from neighbouring throws, the miss itself from double precision
//! at half the step, so that it ends at zero of the finest model. There are more
//! coordinates than the miss has, so a step can be made in many ways; where the shortest
//! breaks a limit of the arm, others are tried before it is cut.

use super::super::error::PlanError;
use super::decode::WaypointSpace;
use super::screen::Screen;
use crate::arm_response::Following;
use arm_model::{JointTrajectory, Pole};
use nalgebra::{DMatrix, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rope_sim::sensitivity::{Family, Perturbation, sensitivities};
use rope_sim::{Candidate, ClosestApproach, PlannedArm, SimOptions};
use shared_types::RopeParams;

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

/// One polished candidate.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polished {
    /// Its point in the space.
    pub x: Vec<f64>,
    /// Smallest distance of tip and target in double precision (m).
    pub miss_m: f64,
}

/// What [`polish`] works on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polish<'a> {
    /// Where candidates live.
    pub space: &'a WaypointSpace,
    /// What the arm may execute.
    pub screen: &'a Screen,
    /// The rope.
    pub rope: &'a RopeParams,
    /// The pole on the arm.
    pub pole: Pole,
    /// How the arm follows what it is told.
    pub following: Option<&'a Following>,
    /// Rope simulation for slopes, and for the miss itself.
    pub slopes: &'a SimOptions,
    /// The finer one.
    pub exact: &'a SimOptions,
    /// Seed of the ways.
    pub seed: u64,
}

/// Polishes some candidates; returns them in their order, none worse than before, and
/// the number of throws simulated.
///
/// # Errors
/// What the simulator refuses.
pub(crate) fn polish(
    work: &Polish<'_>,
    points: &[Vec<f64>],
) -> Result<(Vec<Polished>, usize), PlanError> {
    let mut simulations = points.len();
    let mut approaches = work.approaches(points)?;
    let mut out: Vec<Polished> = points
        .iter()
        .zip(&approaches)
        .map(|(x, a)| Polished {
            x: x.clone(),
            miss_m: a.map_or(f64::INFINITY, |a| a.distance_m),
        })
        .collect();
    let mut rng = ChaCha12Rng::seed_from_u64(work.seed ^ 0x9011_5400);
    let mut open: Vec<usize> = (0..out.len()).collect();
    for _ in 0..ITERATIONS {
        open.retain(|i| out[*i].miss_m > ENOUGH_M && out[*i].miss_m.is_finite());
        if open.is_empty() {
            break;
        }
        let at: Vec<&[f64]> = open.iter().map(|i| out[*i].x.as_slice()).collect();
        let slopes = work.slopes(&at)?;
        simulations += open.len() * (1 + work.space.dimensions.count());
        let mut tried = Vec::new();
        let mut owners = Vec::new();
        for (i, slopes) in open.iter().zip(&slopes) {
            let (Some(slopes), Some(approach)) = (slopes, approaches[*i]) else {
                continue;
            };
            let miss = miss_of(work, &approach);
            for x in work.steps(&out[*i].x, slopes, miss, &approach, &mut rng) {
                tried.push(x);
                owners.push(*i);
            }
        }
        simulations += tried.len();
        let found = work.approaches(&tried)?;
        let mut moved = Vec::new();
        for ((x, approach), i) in tried.into_iter().zip(found).zip(owners) {
            if let Some(a) = approach.filter(|a| a.distance_m < out[i].miss_m) {
                out[i] = Polished {
                    x,
                    miss_m: a.distance_m,
                };
                approaches[i] = Some(a);
                moved.push(i);
            }
        }
        open.retain(|i| moved.contains(i));
    }
    Ok((out, simulations))
}

/// From the target to the tip (m).
fn miss_of(work: &Polish<'_>, approach: &ClosestApproach) -> Vector3<f64> {
    let target = work.exact.watch.point_m.unwrap_or_default();
    Vector3::from(approach.tip_m) - Vector3::from(target)
}

impl Polish<'_> {
    fn motions(&self, points: &[impl AsRef<[f64]>]) -> Result<Vec<PlannedArm>, PlanError> {
        let decode = |x: &[f64]| -> Result<JointTrajectory, PlanError> {
            let command = self.space.decode(x)?;
            Ok(match self.following {
                None => command,
                Some(following) => following.motion(&command)?,
            })
        };
        points
            .iter()
            .map(|x| Ok(PlannedArm::new(decode(x.as_ref())?, self.pole)))
            .collect()
    }

    /// Closest approach of each point in the exact simulation; `None` if it diverged.
    fn approaches(&self, points: &[Vec<f64>]) -> Result<Vec<Option<ClosestApproach>>, PlanError> {
        let motions = self.motions(points)?;
        let candidates: Vec<Candidate> = motions
            .iter()
            .map(|m| Candidate::new(self.rope, m))
            .collect();
        let rollouts = rope_sim::roll_out(&candidates, self.exact)?;
        Ok(rollouts.into_iter().map(|r| r.watched.to_point).collect())
    }

    /// Slopes of the tip's place at its closest, one column per coordinate.
    fn slopes(&self, points: &[&[f64]]) -> Result<Vec<Option<DMatrix<f64>>>, PlanError> {
        // Neighbours with other times would be simulated in other steps, and differ by
        // more than the slope: the times stay as they were found.
        let (n, all_coordinates) = (self.space.dimensions.count(), self.space.count());
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
                base: Candidate::new(self.rope, motion),
                perturbations,
            })
            .collect();
        let all = sensitivities(&families, self.slopes)?;
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
        miss: Vector3<f64>,
        approach: &ClosestApproach,
        rng: &mut ChaCha12Rng,
    ) -> Vec<Vec<f64>> {
        const KEPT: usize = 2;
        let v = Vector3::from(approach.velocity_m_s);
        // Along its way the tip only comes earlier or later.
        let across = Matrix3::identity() - v * v.transpose() / v.norm_squared().max(1e-12);
        let slopes = DMatrix::from_fn(3, x.len(), |i, k| {
            across
                .row(i)
                .transpose()
                .dot(&slopes.column(k).fixed_rows::<3>(0))
        });
        let mut kept = Vec::new();
        for fraction in FRACTIONS {
            for way in 0..WAYS {
                let weights: Vec<f64> = (0..x.len())
                    .map(|_| {
                        if way == 0 {
                            1.0
                        } else {
                            rng.random_range(0.0..1.0)
                        }
                    })
                    .collect();
                let weighted = DMatrix::from_fn(3, x.len(), |i, k| slopes[(i, k)] * weights[k]);
                let normal = &weighted * slopes.transpose() + DMatrix::identity(3, 3) * DAMPING;
                let Some(pull) =
                    normal
                        .lu()
                        .solve(&DMatrix::from_column_slice(3, 1, miss.as_slice()))
                else {
                    continue;
                };
                let step = weighted.tr_mul(&pull);
                let y: Vec<f64> = x
                    .iter()
                    .zip(step.iter())
                    .map(|(x, s)| x - fraction * s)
                    .collect();
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
