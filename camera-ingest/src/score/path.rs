//! The tip's way through space from single detections.
//!
//! Along the image the detections are good (a few mm), in depth they are not
//! (65 mm a pixel at 1.7 m). So the image path is a cubic over 5 frames, the
//! inverse depth - proportional to disparity - a quadratic over 11 frames with
//! Cauchy weights against half-hidden leads. Detections known to be cut by something
//! else hardly count: the path goes on from the clear ones around them, and its error
//! grows with the way to them.

use nalgebra::{DMatrix, DVector, Vector3};

/// One stereo detection in the left optical frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detection {
    /// Middle of the exposure of the row it was seen in (s).
    pub(super) t_s: f64,
    /// `x/z`, `y/z`.
    pub(super) ray: [f64; 2],
    /// `1/z` (1/m).
    pub(super) inverse_depth: f64,
    /// Area as large as it was seen, at its depth (m^2).
    pub(super) area_m2: f64,
    /// Radius of a disc of the area seen (px).
    pub(super) radius_px: f64,
    /// How many times less sure it is than a clear one: 1, more if it is cut.
    pub(super) spread: f64,
}

impl Detection {
    /// Notes that a part of it may be hidden: its centre may be off by a good part of
    /// its radius, where a clear one's is off by a tenth of a pixel or two.
    pub(super) fn cut(&mut self) {
        /// A small blob's centre is no better known when it is cut.
        const MIN_PX: f64 = 3.0;
        self.spread = self.radius_px.max(MIN_PX);
    }
}

/// Clear frames for the image path and for the depth.
const IMAGE_FRAMES: usize = 5;
const DEPTH_FRAMES: usize = 11;
/// A detection smaller than this part of those around it is cut.
const MIN_AREA: f64 = 0.8;

/// Marks detections as cut whose area is smaller than that of the ones around them.
pub(super) fn mark_small(detections: &mut [Detection]) {
    let areas: Vec<f64> = detections.iter().map(|s| s.area_m2).collect();
    for (index, detection) in detections.iter_mut().enumerate() {
        let from = index.saturating_sub(DEPTH_FRAMES / 2);
        let to = (index + DEPTH_FRAMES / 2 + 1).min(areas.len());
        let mut around = areas[from..to].to_vec();
        around.sort_by(f64::total_cmp);
        if detection.area_m2 < MIN_AREA * around[around.len() / 2] {
            detection.cut();
        }
    }
}

/// Smooth path around one detection.
#[derive(Debug, Clone)]
pub(super) struct LocalPath {
    /// Time about which the polynomials are written (s).
    pub(super) t_s: f64,
    /// Usual radius of what was seen (m).
    pub(super) radius_m: f64,
    ray: [Fit; 2],
    inverse_depth: Fit,
}

/// Standard errors of a place on the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PathError {
    /// Across the line of sight, as a part of the depth.
    pub(super) across: f64,
    /// Of the inverse depth (1/m).
    pub(super) inverse_depth: f64,
}

impl LocalPath {
    /// Fits around detection `index`; `None` with fewer than four detections. `least` are
    /// the errors of a clear detection at best: few may happen to agree better.
    pub(super) fn around(detections: &[Detection], index: usize, least: PathError) -> Option<Self> {
        if detections.len() < 4 {
            return None;
        }
        let t_s = detections[index].t_s;
        let points = |count: usize, value: fn(&Detection) -> f64| -> Vec<Point> {
            window(detections, index, count)
                .iter()
                .map(|s| Point {
                    t_s: s.t_s - t_s,
                    value: value(s),
                    spread: s.spread,
                })
                .collect()
        };
        let mut areas_m2: Vec<f64> = window(detections, index, DEPTH_FRAMES)
            .iter()
            .map(|s| s.area_m2)
            .collect();
        areas_m2.sort_by(f64::total_cmp);
        Some(Self {
            t_s,
            radius_m: (areas_m2[areas_m2.len() / 2] / std::f64::consts::PI).sqrt(),
            ray: [
                fit(&points(IMAGE_FRAMES, |s| s.ray[0]), 3, 1e-3, least.across)?,
                fit(&points(IMAGE_FRAMES, |s| s.ray[1]), 3, 1e-3, least.across)?,
            ],
            inverse_depth: fit(
                &points(DEPTH_FRAMES, |s| s.inverse_depth),
                2,
                0.004,
                least.inverse_depth,
            )?,
        })
    }

    /// Point in the left optical frame (m).
    pub(super) fn at(&self, t_s: f64) -> Vector3<f64> {
        let dt = t_s - self.t_s;
        let z = 1.0 / self.inverse_depth.value(dt).max(1e-3);
        Vector3::new(self.ray[0].value(dt) * z, self.ray[1].value(dt) * z, z)
    }

    /// Speed on the path (m/s).
    pub(super) fn speed_at(&self, t_s: f64) -> f64 {
        const STEP_S: f64 = 1e-3;
        (self.at(t_s + STEP_S) - self.at(t_s - STEP_S)).norm() / (2.0 * STEP_S)
    }

    /// How sure [`Self::at`] is.
    pub(super) fn error_at(&self, t_s: f64) -> PathError {
        let dt = t_s - self.t_s;
        PathError {
            across: self.ray[0].error(dt).hypot(self.ray[1].error(dt)),
            inverse_depth: self.inverse_depth.error(dt),
        }
    }
}

/// The detections nearest to `index` of which `count` are clear, or all there are
/// within twice as many.
fn window(detections: &[Detection], index: usize, count: usize) -> &[Detection] {
    let clear = |s: &&Detection| s.spread <= 1.0;
    let (mut from, mut to) = (index, index + 1);
    let enough =
        |part: &[Detection]| part.iter().filter(clear).count() >= count || part.len() >= 2 * count;
    while !enough(&detections[from..to]) && to - from < detections.len() {
        // The nearer of the two next ones, in time.
        let before = from
            .checked_sub(1)
            .map(|i| detections[index].t_s - detections[i].t_s);
        let after = detections.get(to).map(|s| s.t_s - detections[index].t_s);
        if after.is_none_or(|after| before.is_some_and(|before| before < after)) {
            from -= 1;
        } else {
            to += 1;
        }
    }
    &detections[from..to]
}

/// A value at a time relative to the middle of a window.
#[derive(Debug, Clone, Copy)]
struct Point {
    t_s: f64,
    value: f64,
    spread: f64,
}

/// A polynomial and the covariance of its coefficients.
#[derive(Debug, Clone)]
struct Fit {
    /// Time unit of the coefficients (s).
    unit_s: f64,
    /// From the constant up.
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Fit {
    fn powers(&self, dt: f64) -> DVector<f64> {
        powers(dt / self.unit_s, self.coefficients.len())
    }

    fn value(&self, dt: f64) -> f64 {
        self.coefficients.dot(&self.powers(dt))
    }

    fn error(&self, dt: f64) -> f64 {
        let powers = self.powers(dt);
        powers.dot(&(&self.covariance * &powers)).max(0.0).sqrt()
    }
}

fn powers(x: f64, count: usize) -> DVector<f64> {
    DVector::from_iterator(
        count,
        std::iter::successors(Some(1.0), |p| Some(p * x)).take(count),
    )
}

/// Polynomial with Cauchy weights. `min_scale` keeps the weights sane when the fit
/// is perfect, `min_error` its covariance.
fn fit(points: &[Point], degree: usize, min_scale: f64, min_error: f64) -> Option<Fit> {
    let count = degree.min(points.len().checked_sub(2)?) + 1;
    // Time in units of the window, for the sake of the matrix.
    let unit_s = points.iter().map(|p| p.t_s.abs()).fold(1e-6, f64::max);
    let rows: Vec<DVector<f64>> = points
        .iter()
        .map(|p| powers(p.t_s / unit_s, count))
        .collect();
    let mut weights: Vec<f64> = points.iter().map(|p| 1.0 / p.spread).collect();
    let mut result = None;
    for _ in 0..12 {
        let a = DMatrix::from_fn(points.len(), count, |r, c| weights[r] * rows[r][c]);
        let b = DVector::from_fn(points.len(), |r, _| weights[r] * points[r].value);
        let inverse = (a.transpose() * &a).pseudo_inverse(1e-12).ok()?;
        let coefficients = a.svd(true, true).solve(&b, 1e-12).ok()?;
        // In units of a clear detection's error.
        let residual: Vec<f64> = points
            .iter()
            .zip(&rows)
            .map(|(p, row)| (p.value - coefficients.dot(row)) / p.spread)
            .collect();
        let mut sorted: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let scale = (1.4826 * sorted[sorted.len() / 2]).max(min_scale);
        let trust: Vec<f64> = residual
            .iter()
            .map(|r| (1.0 / (1.0 + (r / (2.0 * scale)).powi(2))).sqrt())
            .collect();
        let square: f64 = trust
            .iter()
            .zip(&residual)
            .map(|(w, r)| (w * r).powi(2))
            .sum();
        let total: f64 = trust.iter().map(|w| w * w).sum();
        // Coefficients take their share of the scatter away.
        let freedom = (total - count as f64).max(1.0);
        for ((w, t), p) in weights.iter_mut().zip(&trust).zip(points) {
            *w = t / p.spread;
        }
        result = Some(Fit {
            unit_s,
            coefficients,
            covariance: inverse * (square / freedom).max(min_error * min_error),
        });
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIN_ERROR: PathError = PathError {
        across: 5e-4,
        inverse_depth: 3e-3,
    };

    /// Fifteen clear detections: ray and inverse depth at a time.
    fn clear(place: impl Fn(f64) -> ([f64; 2], f64)) -> Vec<Detection> {
        let detection = |i: u8| {
            let t_s = f64::from(i) / 60.0;
            let (ray, inverse_depth) = place(t_s);
            Detection {
                t_s,
                ray,
                inverse_depth,
                area_m2: 1e-3,
                radius_px: 6.0,
                spread: 1.0,
            }
        };
        (0..15).map(detection).collect()
    }

    #[test]
    fn the_path_of_a_parabola_survives_an_outlier() {
        let truth = |t: f64| {
            let ray = [0.1 + 2.0 * t, 0.2 - 1.5 * t + 4.0 * t * t];
            (ray, 0.6 + 0.3 * t - t * t)
        };
        let mut detections = clear(truth);
        detections[6].inverse_depth += 0.08;
        let path = LocalPath::around(&detections, 7, MIN_ERROR).unwrap();
        let ([x, y], w) = truth(0.12);
        let p = path.at(0.12);
        assert!(
            (p - Vector3::new(x / w, y / w, 1.0 / w)).norm() < 0.004,
            "{p}"
        );
        assert!(LocalPath::around(&detections[..3], 1, MIN_ERROR).is_none());
    }

    #[test]
    fn cut_detections_are_bridged_and_make_the_path_less_sure() {
        let clear = clear(|t| ([0.1 + 2.0 * t + 3.0 * t * t, 0.2], 0.6));
        let mut half = clear.clone();
        for detection in &mut half[6..9] {
            detection.ray[0] += 0.02;
            detection.inverse_depth += 0.05;
            detection.area_m2 /= 2.0;
        }
        let t_s = 7.0 / 60.0;
        let whole = LocalPath::around(&clear, 7, MIN_ERROR).unwrap();
        let misled = LocalPath::around(&half, 7, MIN_ERROR).unwrap();
        assert!((misled.at(t_s) - whole.at(t_s)).norm() > 0.02);
        mark_small(&mut half);
        let cut: Vec<usize> = (0..15).filter(|&i| half[i].spread > 1.0).collect();
        assert_eq!(cut, [6, 7, 8]);
        let bridged = LocalPath::around(&half, 7, MIN_ERROR).unwrap();
        let off_m = (bridged.at(t_s) - whole.at(t_s)).norm();
        assert!(off_m < 0.006, "{off_m} m");
        let (sure, unsure) = (whole.error_at(t_s), bridged.error_at(t_s));
        assert!(unsure.across > 1.1 * sure.across, "{sure:?} {unsure:?}");
    }
}
