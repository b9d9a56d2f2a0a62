//! Least squares over the tip's distances: Levenberg's method, damped as much as serves best.

use super::model::{COUNT, PARAMETERS, Physics, Values, bounded, rope, tilt_rad};
use super::recording::Recording;
use anyhow::{bail, ensure};
use cli_output::is_interrupted;
use nalgebra::{SMatrix, Vector3};
use rope_sim::{Candidate, FrameTimes, Outcome, Precision, Rollout, SimOptions, roll_out};

/// Longest step (s): with half of it the errors differ by less than half a millimetre.
const STEP_S: f64 = 2e-3;
/// A fit looks at one row in so many.
const EVERY: usize = 5;
/// What is fitted in each stage: seconds of a recording, and rounds at most.
const STAGES: [(f64, usize); 3] = [(0.5, 8), (10.0, 8), (f64::INFINITY, 25)];
/// Damping of the first round, relative to the normal matrix' diagonal, and what is tried
/// relative to that of the round before.
const DAMPING: f64 = 1e-3;
const DAMPINGS: [f64; 6] = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0];
/// It ends where nothing helps but a damping beyond this, or gains less than this fraction.
const DAMPING_MAX: f64 = 1e3;
const GAIN_MIN: f64 = 1e-4;

/// The tip's path in every `every`th row of a recording's first seconds (m), for each of some
/// values. It is lost in a simulation that diverges.
pub(super) fn tips(
    recording: &Recording,
    all: &[Values],
    (until_s, every): (f64, usize),
    threads: usize,
) -> anyhow::Result<Vec<Option<Vec<Vector3<f64>>>>> {
    let ropes: Vec<_> = all.iter().map(rope).collect();
    let motions = all.iter().map(|x| recording.motion(tilt_rad(x)));
    let motions: Vec<_> = motions.collect::<Result<_, _>>()?;
    let pairs = ropes.iter().zip(&motions);
    let candidates: Vec<_> = pairs.map(|(r, m)| Candidate::new(r, m)).collect();
    let ends_s = until_s.min(recording.duration_s());
    let period_s = recording.period_s() * every as f64;
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s,
            // The last row is at the very end.
            count: (ends_s / period_s + 1e-6) as usize + 1,
        },
        threads,
        ..SimOptions::new(STEP_S, Precision::F64, ends_s)
    };
    let rollouts = roll_out(&candidates, &options)?;
    let tip = |rollout: &Rollout| {
        let nodes = &rollout.nodes;
        let path = || {
            (0..nodes.frames())
                .map(|frame| nodes.position(frame, nodes.nodes() - 1))
                .collect()
        };
        (rollout.outcome != Outcome::Diverged).then(path)
    };
    Ok(rollouts.iter().map(tip).collect())
}

/// Distance of the tip in each row of a recording (m), for each of some values; not a number where
/// the simulation diverges.
pub(super) fn distances(
    recording: &Recording,
    all: &[Values],
    threads: usize,
) -> anyhow::Result<Vec<Vec<f64>>> {
    let paths = tips(recording, all, (f64::INFINITY, 1), threads)?;
    let of = |path: Option<Vec<Vector3<f64>>>| {
        let path = path.unwrap_or_else(|| vec![Vector3::repeat(f64::NAN); recording.tip_m.len()]);
        let pairs = path.iter().zip(&recording.tip_m);
        pairs.map(|(a, b)| (a - b).norm()).collect()
    };
    Ok(paths.into_iter().map(of).collect())
}

/// Some recordings that a rope is fitted to.
struct Fit<'a> {
    recordings: &'a [&'a Recording],
    until_s: f64,
    threads: usize,
}

/// Residuals (m), or none where a simulation diverged.
type Residuals = Option<Vec<Vector3<f64>>>;

impl Fit<'_> {
    fn residuals(&self, all: &[Values]) -> anyhow::Result<Vec<Residuals>> {
        let mut joined = vec![Some(Vec::new()); all.len()];
        for recording in self.recordings {
            let paths = tips(recording, all, (self.until_s, EVERY), self.threads)?;
            for (joined, path) in joined.iter_mut().zip(paths) {
                let measured = recording.tip_m.iter().step_by(EVERY);
                let errors = |path: Vec<_>| path.into_iter().zip(measured).map(|(p, m)| p - m);
                match (joined.as_mut(), path) {
                    (Some(joined), Some(path)) => joined.extend(errors(path)),
                    _ => *joined = None,
                }
            }
        }
        Ok(joined)
    }

    /// The values after one round, with their mean square (m²) and damping; the same and
    /// nothing where no step helps.
    fn round(
        &self,
        x: &Values,
        free: &[usize],
        damping: f64,
    ) -> anyhow::Result<Option<(Values, [f64; 2], f64)>> {
        let mut family = vec![*x];
        for i in free {
            let mut moved = *x;
            moved[*i] += PARAMETERS[*i].step;
            family.push(moved);
        }
        let mut residuals = self.residuals(&family)?.into_iter();
        let base = residuals.next().flatten();
        let Some((base, beside)) = base.zip(residuals.collect::<Option<Vec<_>>>()) else {
            bail!("the rope's simulation diverges around {:?}", rope(x));
        };
        let mut normal = SMatrix::<f64, COUNT, COUNT>::zeros();
        let mut gradient = Values::zeros();
        let slope = |a: usize, row: usize| (beside[a][row] - base[row]) / PARAMETERS[free[a]].step;
        for (row, residual) in base.iter().enumerate() {
            for (a, i) in free.iter().enumerate() {
                gradient[*i] += slope(a, row).dot(residual);
                for (b, j) in free.iter().enumerate() {
                    normal[(*i, *j)] += slope(a, row).dot(&slope(b, row));
                }
            }
        }
        let dampings = DAMPINGS.map(|factor| factor * damping);
        let tried = dampings.map(|damping| {
            let mut damped = normal;
            for i in 0..COUNT {
                // A number that is not free, or moves nothing, stays.
                damped[(i, i)] += (damping * normal[(i, i)]).max(1e-9);
            }
            let step = damped.cholesky().map(|factors| factors.solve(&gradient));
            step.map_or(*x, |step| bounded(&(x - step)))
        });
        let mean =
            |r: &[Vector3<f64>]| r.iter().map(Vector3::norm_squared).sum::<f64>() / r.len() as f64;
        let before = mean(&base);
        let costs = self.residuals(&tried)?;
        let best = (costs.iter().zip(tried).zip(dampings))
            .filter_map(|((r, x), damping)| Some((x, mean(r.as_ref()?), damping)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best
            .filter(|(_, after, _)| *after < before)
            .map(|(x, after, damping)| (x, [before, after], damping)))
    }
}

/// The values with which the tips of some recordings are met best; `progress` hears how far, of 1,
/// and the root of the mean square (m).
pub(super) fn fit(
    physics: Physics,
    recordings: &[&Recording],
    threads: usize,
    progress: &dyn Fn(f64, f64),
) -> anyhow::Result<Values> {
    let mut x = physics.start();
    let all: usize = STAGES.iter().map(|(_, rounds)| rounds).sum();
    let mut begun = 0;
    for ((until_s, rounds), free) in STAGES.into_iter().zip(physics.stages()) {
        let fit = Fit {
            recordings,
            until_s,
            threads,
        };
        let mut damping = DAMPING;
        for round in 0..rounds {
            ensure!(!is_interrupted(), "interrupted");
            match fit.round(&x, &free, damping)? {
                Some((better, [before, after], used)) => {
                    (x, damping) = (better, used);
                    progress((begun + round + 1) as f64 / all as f64, after.sqrt());
                    if before - after < GAIN_MIN * before {
                        break;
                    }
                }
                None if damping > DAMPING_MAX => break,
                None => damping *= 100.0 * DAMPINGS[DAMPINGS.len() - 1],
            }
        }
        begun += rounds;
    }
    Ok(x)
}

#[cfg(test)]
mod tests {
    use super::super::recording::tests::recorded;
    use super::*;

    /// A rope that the fit does not start at is found by its tip, and met where it was not seen.
    #[test]
    fn a_simulated_rope_is_found() {
        let mut truth = Physics::Elastic.start();
        for (value, by) in truth.iter_mut().zip([-0.1, 0.4, 0.3, 0.15, 0.05]) {
            *value += by;
        }
        let still = recorded(&[Vector3::zeros(); 1000]);
        let tip = |values, until_s| {
            let mut paths = tips(&still, &[values], (until_s, 1), 1).unwrap();
            paths.remove(0).unwrap()
        };
        let whole = tip(truth, f64::INFINITY);
        let seen = recorded(&whole[..700]);
        let found = fit(Physics::Elastic, &[&seen], 1, &|_, _| ()).unwrap();
        let apart = tip(found, f64::INFINITY).into_iter().zip(&whole);
        let farthest_m = apart.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(
            farthest_m < 1e-3,
            "{farthest_m} m: {found} instead of {truth}"
        );
    }
}
