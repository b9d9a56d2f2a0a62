//! Ropes drawn from what identification left open.

use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::rope::{LINK_COUNTS, RANGES, ROPE_PARAMETERS, RopePosterior};

/// Draws until one is a rope: a wide posterior has tails that are none.
const DRAWS_MAX: usize = 50;

/// Ropes that a robust plan is optimised over, and others that its error is forecast with.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PosteriorEnsemble {
    /// Those that the plan is optimised over; none for a plain plan.
    pub optimised: Vec<RopeParams>,
    /// Those its error is forecast with; none for no forecast.
    pub forecast: Vec<RopeParams>,
    /// Ropes missing among those of the forecast, because nothing that was drawn for them
    /// could be a rope.
    #[serde(default)]
    pub undrawn: u32,
    /// By how much a tip passes beside its simulated path, whatever the rope: what the model
    /// leaves out (m, one standard deviation, each axis).
    #[serde(default)]
    pub discrepancy_m: f64,
    /// How well the joints' zeros are known (rad, one standard deviation, each).
    #[serde(default)]
    pub joint_zero_std_rad: f64,
}

/// The discrepancy of a throw over what the fit left of the wiggle's film. What the model does
/// not explain of the one, it does not foresee of the other; a throw is faster, and is
/// seen from no camera that the fit could move. Tuned in another reality (`experiments
/// full-pipeline`, odd seeds).
const DISCREPANCY_PER_RESIDUAL: f64 = 2.5;
/// Zeros of an arm whose joints were aligned by their marks are off by some tenths of a degree. No
/// film tells them, because the fit takes them for a camera that stands elsewhere. Tuned with
/// the above, where zeros are off by 0.2 degree.
const JOINT_ZERO_STD_RAD: f64 = 3e-3;

impl PosteriorEnsemble {
    /// Ropes that a forecast is made with.
    pub const FORECAST: usize = 64;

    /// What a rope might be instead by its posterior: `robust` ropes that the plan weighs, and those
    /// of the forecast, where the posterior tells how well the model explains the film. `from`
    /// says in the error where the rope comes from.
    ///
    /// # Errors
    /// Hardly any of the ropes that are to be weighed could be drawn.
    pub fn of_posterior(
        rope: &RopeParams,
        posterior: &RopePosterior,
        robust: usize,
        seed: u64,
        from: &str,
    ) -> Result<Self, TooFewRopes> {
        let explains = posterior.residual_m > 0.0;
        let forecast = if explains { Self::FORECAST } else { 0 };
        let drawn = Self::drawn(rope, posterior, robust, forecast, seed);
        let count = drawn.optimised.len();
        if count == robust {
            return Ok(drawn);
        }
        Err(TooFewRopes {
            from: from.to_owned(),
            count,
            robust,
        })
    }

    /// `optimised` and `forecast` ropes of a posterior around the rope planned for.
    ///
    /// Parameters are taken for lognormal with the posterior's means and covariance, because
    /// what a film leaves open is a common factor of stiffness, damping and masses: ratios
    /// stay as sharp as they were identified. The link count follows its probabilities, and
    /// stiffness and damping of the joints follow the count: a film tells those per length.
    /// What is no rope is drawn again.
    #[must_use]
    pub fn drawn(
        rope: &RopeParams,
        posterior: &RopePosterior,
        optimised: usize,
        forecast: usize,
        seed: u64,
    ) -> Self {
        let logs = Logarithms::of(posterior);
        let mut rng = ChaCha12Rng::seed_from_u64(seed ^ 0xbe11_ef00);
        let mut draw = |_| {
            (0..DRAWS_MAX)
                .map(|_| logs.draw(rope, posterior, &mut rng))
                .find(|drawn| drawn.validate().is_ok())
        };
        let optimised = (0..optimised).filter_map(&mut draw).collect();
        let drawn: Vec<RopeParams> = (0..forecast).filter_map(&mut draw).collect();
        Self {
            optimised,
            undrawn: u32::try_from(forecast - drawn.len()).unwrap_or(u32::MAX),
            forecast: drawn,
            discrepancy_m: (DISCREPANCY_PER_RESIDUAL * posterior.residual_m)
                .hypot(posterior.absorbed_m),
            joint_zero_std_rad: JOINT_ZERO_STD_RAD,
        }
    }
}

/// A posterior of which few draws are ropes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "what {from} leaves open is hardly ever a rope: {count} of {robust} could be drawn; film and identify it again"
)]
pub struct TooFewRopes {
    /// Where the rope comes from.
    pub from: String,
    /// Ropes that could be drawn.
    pub count: usize,
    /// Ropes that were wanted.
    pub robust: usize,
}

/// Parameters but for the link count.
const OTHERS: usize = ROPE_PARAMETERS - 1;

/// Normally distributed logarithms of the parameters: those of the others given that of the
/// link count.
struct Logarithms {
    mean: SVector<f64, ROPE_PARAMETERS>,
    /// Slope over the logarithm of the link count.
    slope: SVector<f64, OTHERS>,
    /// Square root of the covariance that is left when the link count is known.
    root: SMatrix<f64, OTHERS, OTHERS>,
}

impl Logarithms {
    fn of(posterior: &RopePosterior) -> Self {
        let mean = |i: usize| posterior.mean[i].max(1e-9);
        let logs = SMatrix::<f64, ROPE_PARAMETERS, ROPE_PARAMETERS>::from_fn(|i, k| {
            let relative = posterior.covariance[i][k] / (mean(i) * mean(k));
            relative.max(-0.9).ln_1p()
        });
        let with_links = logs.fixed_view::<OTHERS, 1>(1, 0).into_owned();
        let slope = with_links / logs[(0, 0)].max(1e-12);
        let given_links = logs.fixed_view::<OTHERS, OTHERS>(1, 1) - slope * with_links.transpose();
        // Rounding and moments of no lognormal may leave it slightly indefinite.
        let eigen = given_links.symmetric_eigen();
        let lengths = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
        Self {
            mean: SVector::from_fn(|i, _| mean(i).ln() - logs[(i, i)] / 2.0),
            slope,
            root: eigen.eigenvectors * SMatrix::from_diagonal(&lengths),
        }
    }

    /// The rope with other values, which need not be those of any rope.
    fn draw(
        &self,
        rope: &RopeParams,
        posterior: &RopePosterior,
        rng: &mut ChaCha12Rng,
    ) -> RopeParams {
        let normal = SVector::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
        let links = links(posterior, rope, rng.random());
        let more_links = f64::from(links).ln() - self.mean[0];
        let shift = self.slope * more_links + self.root * normal;
        let value = |i: usize| (self.mean[i] + shift[i - 1]).exp();
        let mut drawn = *rope;
        drawn.links = links;
        drawn.length_m = value(1);
        drawn.joint_damping_nms_per_rad = value(2);
        drawn.joint_stiffness_nm_per_rad = value(3);
        drawn.radius_m = value(4);
        drawn.mass_per_length_kg_per_m = value(5);
        drawn.lead_mass_kg = value(6);
        drawn.lead_radius_m = value(7);
        drawn.link_extra_scale = value(8);
        let stiffer = drawn;
        if let Some(friction) = drawn.extras.as_mut().and_then(|e| e.friction.as_mut()) {
            // Identified as a part of the bending stiffness: a common factor is in both.
            friction.moment_max_nm *=
                stiffer.bending_stiffness_nm2() / rope.bending_stiffness_nm2();
        }
        drawn
    }
}

/// The link count at a part of the cumulated probability.
fn links(posterior: &RopePosterior, rope: &RopeParams, part: f64) -> u32 {
    let mut left = part;
    for (i, p) in (0u32..).zip(posterior.links_probability.iter().take(LINK_COUNTS)) {
        left -= p;
        if left < 0.0 {
            return RANGES[0].min as u32 + i;
        }
    }
    rope.links
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A common factor known to 30 %, ratios to 1 %: drawn ropes have just that.
    #[test]
    fn drawn_ropes_have_the_moments_and_keep_the_ratios() {
        let rope = RopeParams::from_array([23.0, 0.55, 0.01, 0.2, 0.006, 0.05, 0.05, 0.03, 0.9]);
        let mean = rope.to_array();
        let common = [2usize, 3, 5, 6];
        let covariance = core::array::from_fn(|i| {
            core::array::from_fn(|k| {
                let both = common.contains(&i) && common.contains(&k);
                let own = if i == k { 1e-4 } else { 0.0 };
                mean[i] * mean[k] * (own + if both { 0.09 } else { 0.0 })
            })
        });
        let posterior = RopePosterior {
            mean,
            covariance,
            interval_90: [[0.0; 2]; ROPE_PARAMETERS],
            links_probability: [0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0],
            ambiguities: Vec::new(),
            inflation: 1.0,
            residual_m: 0.0,
            absorbed_m: 0.0,
        };
        let drawn = PosteriorEnsemble::drawn(&rope, &posterior, 3995, 5, 1);
        let drawn = [drawn.optimised, drawn.forecast].concat();
        let moments = |of: &dyn Fn(&RopeParams) -> f64| {
            let m = drawn.iter().map(of).sum::<f64>() / 4000.0;
            let v = drawn.iter().map(|r| (of(r) - m).powi(2)).sum::<f64>() / 4000.0;
            (m, v.sqrt())
        };
        let (m, s) = moments(&|r| r.lead_mass_kg);
        assert!(
            (m / 0.05 - 1.0).abs() < 0.02 && (s / m - 0.3).abs() < 0.02,
            "{m} {s}"
        );
        let (m, s) = moments(&|r| r.lead_mass_kg / r.mass_per_length_kg_per_m);
        assert!((m - 1.0).abs() < 0.02 && s < 0.02, "{m} {s}");
        let (m, _) = moments(&|r| f64::from(r.links));
        assert!((m - 22.5).abs() < 0.05, "{m}");
        let few = PosteriorEnsemble::drawn(&rope, &posterior, 5, 0, 1);
        assert_eq!(drawn[..5], few.optimised);
    }

    /// Mean and covariance of some ropes, and the probabilities of their link counts.
    fn posterior_of(ropes: &[RopeParams]) -> RopePosterior {
        let count = ropes.len() as f64;
        let all: Vec<[f64; ROPE_PARAMETERS]> = ropes.iter().map(RopeParams::to_array).collect();
        let mean =
            |of: &dyn Fn(&[f64; ROPE_PARAMETERS]) -> f64| all.iter().map(of).sum::<f64>() / count;
        let means: [f64; ROPE_PARAMETERS] = core::array::from_fn(|i| mean(&|v| v[i]));
        RopePosterior {
            mean: means,
            covariance: core::array::from_fn(|i| {
                core::array::from_fn(|k| mean(&|v| (v[i] - means[i]) * (v[k] - means[k])))
            }),
            interval_90: [[0.0; 2]; ROPE_PARAMETERS],
            links_probability: core::array::from_fn(|i| {
                mean(&|v| f64::from(u8::from(v[0] == RANGES[0].min + i as f64)))
            }),
            ambiguities: Vec::new(),
            inflation: 1.0,
            residual_m: 0.0,
            absorbed_m: 0.0,
        }
    }

    /// What a throw depends on: logarithms of bending stiffness, of damping and of the lead's
    /// mass, over the mass per length; and the link count.
    fn ratios(rope: &RopeParams) -> [f64; 4] {
        let (s, mu) = (rope.link_length_m(), rope.mass_per_length_kg_per_m);
        [
            (rope.joint_stiffness_nm_per_rad * s / mu).ln(),
            (rope.joint_damping_nms_per_rad * s / mu).ln(),
            (rope.lead_mass_kg / mu).ln(),
            f64::from(rope.links),
        ]
    }

    fn deviations(ropes: &[RopeParams]) -> [f64; 4] {
        let all: Vec<[f64; 4]> = ropes.iter().map(ratios).collect();
        let count = all.len() as f64;
        core::array::from_fn(|i| {
            let mean = all.iter().map(|r| r[i]).sum::<f64>() / count;
            let squares = all.iter().map(|r| (r[i] - mean).powi(2));
            (squares.sum::<f64>() / count).sqrt()
        })
    }

    /// A film tells bending stiffness and damping per length to 1 and 2 %, but hardly the link
    /// count, nor the common factor of stiffness, damping and masses.
    #[test]
    fn drawn_ropes_bend_as_sharply_as_identified_whatever_their_link_count() {
        let rope = RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.006, 0.05, 0.05, 0.03, 0.9]);
        let mut rng = ChaCha12Rng::seed_from_u64(3);
        let mut known = || {
            let mut error =
                |std_dev: f64| -> f64 { (std_dev * rng.sample::<f64, _>(StandardNormal)).exp() };
            let (stiffness, damping, lead) = (error(0.01), error(0.02), error(0.01));
            let (length, links) = (error(0.002), (23.0 * error(0.07)).round());
            let mass: f64 = rng.random_range(0.6..1.4);
            let per_joint = links / f64::from(rope.links) / length * mass;
            RopeParams {
                links: (links as u32).clamp(20, 26),
                length_m: rope.length_m * length,
                joint_stiffness_nm_per_rad: rope.joint_stiffness_nm_per_rad * stiffness * per_joint,
                joint_damping_nms_per_rad: rope.joint_damping_nms_per_rad * damping * per_joint,
                mass_per_length_kg_per_m: rope.mass_per_length_kg_per_m * mass,
                lead_mass_kg: rope.lead_mass_kg * lead * mass,
                ..rope
            }
        };
        let known: Vec<RopeParams> = (0..4096).map(|_| known()).collect();
        let posterior = posterior_of(&known);
        let drawn = PosteriorEnsemble::drawn(&rope, &posterior, 4096, 0, 1).optimised;
        let (is, was) = (deviations(&drawn), deviations(&known));
        for (is, was) in is.into_iter().zip(was) {
            assert!((0.85..1.15).contains(&(is / was)), "{is} of {was}");
        }
    }

    /// Lead radii a hundred times too uncertain: many draws are larger than any lead.
    #[test]
    fn what_is_no_rope_is_drawn_again_or_counted() {
        let rope = RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.006, 0.05, 0.05, 0.03, 0.9]);
        let mut posterior = posterior_of(&[rope]);
        posterior.mean[7] = 0.4;
        posterior.covariance[7][7] = 0.16;
        (posterior.residual_m, posterior.absorbed_m) = (0.002, 0.012);
        let drawn = PosteriorEnsemble::drawn(&rope, &posterior, 20, 200, 1);
        // Two and a half residuals, and what went elsewhere.
        assert!((drawn.discrepancy_m - 0.013).abs() < 1e-12, "{drawn:?}");
        assert_eq!(drawn.joint_zero_std_rad, 3e-3);
        let ropes = [&drawn.optimised[..], &drawn.forecast].concat();
        assert_eq!((ropes.len(), drawn.undrawn), (220, 0));
        for (i, drawn) in ropes.iter().enumerate() {
            assert!(
                drawn.validate().is_ok() && !ropes[..i].contains(drawn),
                "{drawn:?}"
            );
        }
        posterior.mean[7] = 40.0;
        let none = PosteriorEnsemble::drawn(&rope, &posterior, 2, 3, 1);
        assert_eq!(
            (none.optimised.len(), none.forecast.len(), none.undrawn),
            (0, 0, 3)
        );
    }
}
