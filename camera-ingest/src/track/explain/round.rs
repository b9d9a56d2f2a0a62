//! How thick the rope is, and where its middle lies under light from one side.
//!
//! The dark side of a round, light rope can be as bright as the wall behind it: the
//! evidence then lies to one side of the rope. The mean brightness across the rope, over
//! the frames in which it hardly moves, is that of a cylinder in ambient light and light
//! from one side, blurred: fitted to it, the cylinder has its axis where the rope has.

use nalgebra::{SMatrix, SVector};

/// Distance of the samples across the rope, and how many to either side of its middle.
pub(super) const STEP_PX: f64 = 0.5;
pub(super) const REACH: usize = 24;
const SAMPLES: usize = 2 * REACH + 1;

/// Mean luma across the rope, and of the scene there.
#[derive(Debug, Clone)]
pub(super) struct Profile {
    pub(super) seen: [f64; SAMPLES],
    pub(super) behind: [f64; SAMPLES],
}

/// The rope's middle beside the curve, along its normals, and half its width (px).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Round {
    pub(super) middle_px: f64,
    pub(super) radius_px: f64,
    /// What the cylinder leaves unexplained, as a part of the contrast.
    pub(super) left: f64,
}

/// Axis, radius, ambient light, light from the side, its direction (rad), blur.
type Cylinder = SVector<f64, 6>;
const LOWER: [f64; 6] = [-4.0, 0.7, 0.0, 0.0, -1.4, 0.4];
const UPPER: [f64; 6] = [4.0, 12.0, 255.0, 300.0, 1.4, 2.5];
const RADII_PX: [f64; 4] = [2.0, 4.0, 6.5, 9.0];
const DIRECTIONS_RAD: [f64; 4] = [-0.9, -0.3, 0.3, 0.9];
const ROUNDS: usize = 40;
/// Of two cylinders that fit alike the one nearer to the curve is taken: what a pixel aside
/// costs, as a part of the contrast.
const ASIDE: f64 = 0.004;

fn place_px(sample: usize) -> f64 {
    (sample as f64 - REACH as f64) * STEP_PX
}

/// Brightness of a blurred cylinder before the scene.
fn brightness(c: &Cylinder, profile: &Profile) -> [f64; SAMPLES] {
    const FINE: usize = 4;
    const COUNT: usize = (SAMPLES - 1) * FINE + 1;
    let step = STEP_PX / FINE as f64;
    let (sin, cos) = c[4].sin_cos();
    let mut sharp = [0.0; COUNT];
    for (i, value) in sharp.iter_mut().enumerate() {
        let at = (i / FINE).min(SAMPLES - 2);
        let w = (i - at * FINE) as f64 / FINE as f64;
        let behind = profile.behind[at] * (1.0 - w) + profile.behind[at + 1] * w;
        let x = place_px(0) + i as f64 * step - c[0];
        let aside = (x / c[1]).clamp(-1.0, 1.0);
        let inside = ((c[1] - x.abs()) / step + 0.5).clamp(0.0, 1.0);
        // By the cosine between the surface normal and the light.
        let height = (1.0 - aside * aside).sqrt();
        let lit = c[2] + c[3] * (height * cos + aside * sin).max(0.0);
        *value = behind * (1.0 - inside) + lit * inside;
    }
    let reach = (3.0 * c[5] / step).ceil() as usize;
    let weights: Vec<f64> = (0..=reach)
        .map(|k| (-0.5 * (k as f64 * step / c[5]).powi(2)).exp())
        .collect();
    let whole = 2.0 * weights.iter().sum::<f64>() - weights[0];
    core::array::from_fn(|i| {
        let middle = i * FINE;
        let side = |k: usize| sharp[(middle + k).min(COUNT - 1)] + sharp[middle.saturating_sub(k)];
        let sum: f64 = weights
            .iter()
            .enumerate()
            .skip(1)
            .map(|(k, w)| w * side(k))
            .sum();
        (sum + weights[0] * sharp[middle]) / whole
    })
}

fn residual(c: &Cylinder, profile: &Profile) -> SVector<f64, SAMPLES> {
    let model = brightness(c, profile);
    SVector::from_fn(|i, _| model[i] - profile.seen[i])
}

/// The cylinder that fits best.
pub(super) fn fit(profile: &Profile) -> Round {
    let middle = profile.seen[REACH];
    let contrast = |i: usize| (profile.seen[i] - profile.behind[i]).abs();
    let contrast = (0..SAMPLES).map(contrast).fold(1.0, f64::max);
    let starts = RADII_PX
        .into_iter()
        .flat_map(|r| DIRECTIONS_RAD.map(|d| (r, d)));
    let round = |(radius_px, direction)| {
        let start = Cylinder::from([0.0, radius_px, 0.3 * middle, 0.7 * middle, direction, 0.8]);
        let (cost, c) = descend(start, profile);
        Round {
            middle_px: c[0],
            radius_px: c[1],
            left: (cost / SAMPLES as f64).sqrt() / contrast,
        }
    };
    let price = |round: &Round| round.left + ASIDE * round.middle_px.abs();
    starts
        .map(round)
        .min_by(|a, b| price(a).total_cmp(&price(b)))
        .unwrap_or(Round {
            middle_px: 0.0,
            radius_px: 0.0,
            left: f64::INFINITY,
        })
}

/// Levenberg-Marquardt in the box.
fn descend(mut c: Cylinder, profile: &Profile) -> (f64, Cylinder) {
    const H: f64 = 1e-3;
    let mut r = residual(&c, profile);
    let mut damping = 1.0;
    for _ in 0..ROUNDS {
        let mut slopes = SMatrix::<f64, SAMPLES, 6>::zeros();
        for i in 0..6 {
            let mut moved = c;
            moved[i] += H;
            slopes.set_column(i, &((residual(&moved, profile) - r) / H));
        }
        let normal = slopes.tr_mul(&slopes);
        let diagonal = SMatrix::from_diagonal(&normal.diagonal().add_scalar(1e-6));
        let Some(inverse) = (normal + diagonal * damping).try_inverse() else {
            break;
        };
        let mut next = c - inverse * slopes.tr_mul(&r);
        for i in 0..6 {
            next[i] = next[i].clamp(LOWER[i], UPPER[i]);
        }
        let after = residual(&next, profile);
        let gain = r.norm_squared() - after.norm_squared();
        if gain > 0.0 {
            (c, r) = (next, after);
            damping = f64::max(damping / 3.0, 1e-6);
            if gain < 1e-6 * r.norm_squared() {
                break;
            }
        } else {
            damping *= 3.0;
        }
    }
    (r.norm_squared(), c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rope_whose_dark_side_looks_like_the_wall_is_found_whole() {
        // Light from the right; on the left it is as bright as the wall.
        let truth = Cylinder::from([-1.0, 5.5, 71.0, 146.0, 0.48, 0.75]);
        let mut profile = Profile {
            seen: [0.0; SAMPLES],
            behind: [90.0; SAMPLES],
        };
        profile.seen = brightness(&truth, &profile);
        let found = fit(&profile);
        assert!((found.middle_px + 1.0).abs() < 0.02, "{found:?}");
        assert!((found.radius_px - 5.5).abs() < 0.02, "{found:?}");
        assert!(found.left < 1e-3, "{found:?}");
    }

    #[test]
    fn what_is_no_cylinder_is_not_taken_for_one() {
        let profile = Profile {
            seen: core::array::from_fn(|i| if i % 9 < 4 { 60.0 } else { 140.0 }),
            behind: [100.0; SAMPLES],
        };
        assert!(fit(&profile).left > 0.1);
    }
}
