//! Fits a hypothesis to what was read along it, by least squares.
//!
//! What was read off lies within a few pixels of the hypothesis: distances across the curve,
//! and the tip weight's place, fall with its numbers as smoothly as the simulated rope moves.
//! Levenberg-Marquardt with Cauchy's weights, by which what is far off (a passer-by's edge, a
//! stretch that was read off something else) counts little.

use nalgebra::{SMatrix, SVector};

use super::curve::{Pixel, normals};
use super::hypothesis::{FREE, Fidelity, LOWER, Point, SPREAD, Seen, Setup, Side, TURN, UPPER};
use super::read::NODES;
use super::reading::Reading;
use super::statistics::quantile;
use crate::track::TrackError;

/// Steps at most, and the part of the misfit that one must gain.
const STEPS: usize = 5;
const GAIN: f64 = 0.01;
/// Every which node is compared.
const EVERY: usize = 4;
/// Weight of the tip weight's place against a node's.
const TIP: f64 = 2.0;
/// What the camera's turns and the clock cost, per squared spread and frame (px²).
const PRIOR: f64 = 0.1;
/// Slopes are taken over this part of a number's spread.
const SLOPE: f64 = 0.03;
/// Cauchy's scale in medians of the distance, and at least (px).
const SCALE: f64 = 2.0;
const MIN_SCALE_PX: f64 = 0.3;
/// Dampings tried side by side.
const DAMPINGS: [f64; 8] = [1e-5, 1e-3, 1e-2, 0.1, 0.5, 3.0, 30.0, 300.0];

type Normal = SMatrix<f64, FREE, FREE>;
type Vector = SVector<f64, FREE>;

/// What was read off one frame.
#[derive(Debug)]
pub(super) struct Detection {
    t_s: f64,
    /// Index, place, unit normal and weight of nodes.
    nodes: Vec<(usize, Pixel, Pixel, f64)>,
    tip: Pixel,
    tip_weight: f64,
}

impl Detection {
    pub(super) fn of(reading: &Reading, frame: usize, t_s: f64) -> Self {
        let curve = &reading.curves[frame];
        let shown = reading.end.nodes_shown(curve);
        let nodes = curve
            .iter()
            .zip(normals(curve))
            .zip(&reading.evident[frame]);
        let nodes = (0..)
            .zip(nodes)
            .map(|(k, ((p, n), weight))| (k, *p, n, *weight));
        Self {
            t_s,
            nodes: nodes.take(shown).skip(EVERY / 2).step_by(EVERY).collect(),
            tip: reading.tip(frame),
            tip_weight: TIP * reading.tips[frame][1].weight,
        }
    }

    /// Adds distance (px) and weight of all that is compared; `None` where a part is behind
    /// the camera.
    fn add_misses(&self, seen: &Seen, out: &mut Vec<[f64; 2]>) -> Option<()> {
        let points = seen.curve(self.t_s, Side::Left, NODES)?;
        let nodes = self.nodes.iter();
        out.extend(nodes.map(|(k, p, n, weight)| [(points[*k] - p).dot(n), *weight]));
        let off = points[NODES - 1] - self.tip;
        out.extend([off.x, off.y].map(|px| [px, self.tip_weight]));
        Some(())
    }
}

/// What a hypothesis is fitted to.
pub(super) struct Fit<'a> {
    pub(super) detections: &'a [Detection],
    pub(super) setup: Setup<'a>,
    pub(super) fidelity: Fidelity,
}

impl Fit<'_> {
    /// The hypothesis near another one that fits best.
    pub(super) fn refined(&self, mut x: Point) -> Result<Point, TrackError> {
        let Some(mut misses) = self.misses(&[x])?.pop().flatten() else {
            return Ok(x);
        };
        for _ in 0..STEPS {
            let sizes = misses.iter().map(|[px, _]| px.abs());
            let scale_px = (SCALE * quantile(sizes, 0.5)).max(MIN_SCALE_PX);
            let Some((normal, slope)) = self.linearised(&x, &misses, scale_px)? else {
                break;
            };
            let next: Vec<Point> = DAMPINGS
                .iter()
                .filter_map(|damping| {
                    let damped = normal + Normal::from_diagonal(&(normal.diagonal() * *damping));
                    let step = damped.cholesky()?.solve(&slope);
                    let moved = |i: usize| (x[i] - step[i] * SPREAD[i]).clamp(LOWER[i], UPPER[i]);
                    Some(core::array::from_fn(moved))
                })
                .collect();
            let before = self.misfit(&x, &misses, scale_px);
            let tried = next.iter().zip(self.misses(&next)?);
            let best = tried
                .filter_map(|(x, misses)| {
                    let misses = misses?;
                    Some((self.misfit(x, &misses, scale_px), *x, misses))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match best {
                Some((after, better, there)) if after < before => {
                    (x, misses) = (better, there);
                    if before - after < GAIN * before {
                        break;
                    }
                }
                _ => break,
            }
        }
        Ok(x)
    }

    /// Distances of some hypotheses; `None` for those that cannot be looked at.
    fn misses(&self, points: &[Point]) -> Result<Vec<Option<Vec<[f64; 2]>>>, TrackError> {
        let seen = self.setup.simulate(points, self.fidelity)?;
        let misses = |seen: Option<Seen>| {
            let mut out = Vec::new();
            for detection in self.detections {
                detection.add_misses(seen.as_ref()?, &mut out)?;
            }
            Some(out)
        };
        Ok(seen.into_iter().map(misses).collect())
    }

    fn prior(&self) -> f64 {
        PRIOR * self.detections.len() as f64
    }

    /// Cauchy's: squares near 0, hardly more further off.
    fn misfit(&self, x: &Point, misses: &[[f64; 2]], scale_px: f64) -> f64 {
        let scale2 = scale_px * scale_px;
        let cost = |[px, weight]: &[f64; 2]| weight * scale2 * (px * px / scale2).ln_1p();
        let prior: f64 = (TURN..FREE).map(|i| (x[i] / SPREAD[i]).powi(2)).sum();
        misses.iter().map(cost).sum::<f64>() + self.prior() * prior
    }

    /// Normal equations about a hypothesis, its numbers in spreads; `None` where a slope
    /// cannot be taken.
    fn linearised(
        &self,
        x: &Point,
        misses: &[[f64; 2]],
        scale_px: f64,
    ) -> Result<Option<(Normal, Vector)>, TrackError> {
        // Towards the middle of the box.
        let slopes: [f64; FREE] = core::array::from_fn(|i| {
            let is_above = x[i] > 0.5 * (LOWER[i] + UPPER[i]);
            if is_above { -SLOPE } else { SLOPE }
        });
        let moved = |i: usize| {
            let mut moved = *x;
            moved[i] += slopes[i] * SPREAD[i];
            moved
        };
        let beside = self.misses(&(0..FREE).map(moved).collect::<Vec<_>>())?;
        let Some(beside) = beside.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let (mut normal, mut slope) = (Normal::zeros(), Vector::zeros());
        for (row, [px, weight]) in misses.iter().enumerate() {
            let weight = weight / (1.0 + (px / scale_px).powi(2));
            let slopes = Vector::from_fn(|i, _| (beside[i][row][0] - px) / slopes[i]);
            normal += slopes * slopes.transpose() * weight;
            slope += slopes * (weight * px);
        }
        for i in 0..FREE {
            normal[(i, i)] += 1e-9;
            if i >= TURN {
                normal[(i, i)] += self.prior();
                slope[i] += self.prior() * x[i] / SPREAD[i];
            }
        }
        Ok(Some((normal, slope)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::hypothesis::{LENGTH, MIDDLE, STIFFNESS};
    use super::*;
    use nalgebra::{Matrix3, Vector3};
    use rope_sim::{PoseRow, PoseTrack};
    use shared_types::{Intrinsics, Shutter, StereoCamera};

    /// Looks along y at the clamp, from two metres off.
    fn camera() -> StereoCamera {
        let image = Intrinsics {
            fx: 700.0,
            fy: 700.0,
            cx: 336.0,
            cy: 188.0,
            distortion: [0.0; 5],
        };
        StereoCamera {
            width_px: 672,
            height_px: 376,
            left: image,
            right: image,
            r_right_left: Matrix3::identity(),
            t_right_left_m: Vector3::new(0.12, 0.0, 0.0),
            r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
            p_w_cam_m: Vector3::new(0.0, -2.0, 0.8),
            shutter: Shutter::Global,
            exposure_s: 0.0,
            line_time_s: 0.0,
        }
    }

    #[test]
    fn a_rope_is_found_again_among_places_read_off_something_else() {
        let row = |i: i32| {
            let t_s = f64::from(i) * 0.02;
            PoseRow {
                t_s,
                p_m: [0.06 * (7.0 * t_s).sin() * (2.0 * t_s).min(1.0), 0.0, 1.1],
                q_wxyz: [1.0, 0.0, 0.0, 0.0],
            }
        };
        let motion = PoseTrack::new(&(0..=160).map(row).collect::<Vec<_>>()).unwrap();
        let mut truth = MIDDLE;
        truth[TURN + 1] = 0.004;
        let setup = Setup {
            camera: &camera(),
            motion: &motion,
            film_s: 3.0,
            threads: 1,
        };
        let curves = |x: &Point| -> Vec<(f64, Vec<Pixel>)> {
            let seen = setup.simulate_one(x, Fidelity::COARSE).unwrap();
            let times_s = (0..30).map(|i| 0.1 * f64::from(i));
            times_s
                .map(|t_s| (t_s, seen.curve(t_s, Side::Left, NODES).unwrap()))
                .collect()
        };
        let detection = |(t_s, curve): &(f64, Vec<Pixel>)| {
            let node = |(k, n): (usize, Pixel)| {
                // Every sixth place shows something twelve pixels to the side.
                let aside = if (k + (t_s * 10.0) as usize).is_multiple_of(6) {
                    12.0
                } else {
                    0.0
                };
                (k, curve[k] + n * aside, n, 1.0)
            };
            let nodes = normals(curve).enumerate().map(node);
            Detection {
                t_s: *t_s,
                nodes: nodes.skip(EVERY / 2).step_by(EVERY).collect(),
                tip: curve[NODES - 1],
                tip_weight: TIP,
            }
        };
        let there = curves(&truth);
        let fit = Fit {
            detections: &there.iter().map(detection).collect::<Vec<_>>(),
            setup,
            fidelity: Fidelity::COARSE,
        };
        let mut x = truth;
        x[LENGTH] += 0.02;
        x[STIFFNESS] += 0.7;
        x[TURN] = -0.005;
        let worst_px = |x: &Point| {
            let pairs = there.iter().zip(curves(x));
            let off = pairs.flat_map(|((_, a), (_, b))| a.clone().into_iter().zip(b));
            off.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        };
        assert!(worst_px(&x) > 4.0, "{}", worst_px(&x));
        for _ in 0..2 {
            x = fit.refined(x).unwrap();
        }
        assert!(worst_px(&x) < 0.5, "{x:?}: {}", worst_px(&x));
        assert!((x[LENGTH] - truth[LENGTH]).abs() < 1e-3, "{x:?}");
    }
}
