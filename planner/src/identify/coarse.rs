//! Pixel distance of many candidates to the film, the camera's place left free.
//!
//! A camera 2 cm off shifts the picture by more pixels than most ropes differ. Its best
//! correction is found for every candidate by one linear solution, whose matrix is the
//! same for all: how a pixel moves with the camera hardly depends on the rope.

use super::camera_pose::CORRECTIONS;
use super::coordinates::{CAMERA, CLOCK, Coordinates, Point, nearest_links, simulated_rope};
use super::error::IdentifyError;
use super::film::{Detection, Fidelity, Film, Instant, is_finite, sample_s};
use crate::workers::map_in_order;
use nalgebra::{SMatrix, SVector};
use rope_sim::Rollout;
use shared_types::RopeParams;

/// Distance given to a candidate that cannot be compared (px).
pub(super) const INVISIBLE_PX: f64 = 1e4;
/// Deviation of one detection against which the camera's prior is weighed (px): large,
/// because neighbouring detections err together.
const DETECTION_PX: f64 = 20.0;
/// Step of the camera's corrections (m, rad).
const STEP: f64 = 1e-4;
/// Distance beyond which a detection counts as an outlier (Huber, px).
const OUTLIER_PX: f64 = 8.0;

type Slopes = SMatrix<f64, 2, CORRECTIONS>;

/// A candidate compared.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    /// The candidate, the camera where it fits best.
    pub(super) x: Point,
    /// Root mean square (Huber) distance (px).
    pub(super) distance_px: f64,
}

/// Compares candidates with one film.
pub(super) struct Comparer<'a> {
    film: &'a Film<'a>,
    detections: Vec<(Detection, Slopes)>,
    inverse: SMatrix<f64, CORRECTIONS, CORRECTIONS>,
}

impl<'a> Comparer<'a> {
    pub(super) fn new(film: &'a Film<'a>, coordinates: &Coordinates) -> Self {
        let attach = film.observation.motion.at(0.0).p_m;
        let nominal = film.viewer.view(&[0.0; CORRECTIONS]);
        let perturbed = film.viewer.perturbed(&[0.0; CORRECTIONS], STEP);
        let depth_m = film.observation.camera.to_left(&attach).z.max(0.1);
        let camera = film.observation.camera;
        let mut normal = SMatrix::<f64, CORRECTIONS, CORRECTIONS>::from_fn(|i, j| {
            let weight = (DETECTION_PX / coordinates.prior_std[CAMERA + i]).powi(2);
            if i == j { weight } else { 0.0 }
        });
        let mut detections = Vec::new();
        for detection in film.grid(Fidelity::Coarse).cells.iter().flatten() {
            // Where the pixel's ray meets the plane of the clamp.
            let (origin, ray) = camera.left_ray(detection.pixel);
            let forward = ray.dot(&camera.r_w_cam.column(2));
            let p = origin + ray * (depth_m / forward.max(0.1));
            let Some(here) = nominal.project(&p) else {
                continue;
            };
            let slopes = Slopes::from_fn(|axis, i| {
                perturbed[i]
                    .project(&p)
                    .map_or(0.0, |moved| (moved[axis] - here[axis]) / STEP)
            });
            normal += slopes.tr_mul(&slopes) * detection.weight;
            detections.push((*detection, slopes));
        }
        Self {
            film,
            detections,
            inverse: normal.try_inverse().unwrap_or_else(SMatrix::zeros),
        }
    }

    /// Compares candidates, each with its own link count, the nearest of the ranges.
    pub(super) fn compare(&self, points: &[Point]) -> Result<Vec<Compared>, IdentifyError> {
        // Lanes hold ropes of one count: few counts fill them.
        let rope = |x| simulated_rope(x, nearest_links(x));
        let ropes: Vec<RopeParams> = points.iter().map(rope).collect();
        let rollouts = self.film.simulate(&ropes, Fidelity::Coarse)?;
        let jobs: Vec<_> = points.iter().zip(&rollouts).collect();
        let threads = self.film.options.threads;
        Ok(map_in_order(&jobs, threads, |(x, rollout)| {
            let found = self.one(x, rollout);
            let (distance_px, camera) = found.unwrap_or((INVISIBLE_PX, [0.0; CORRECTIONS]));
            let mut x = **x;
            for (i, c) in camera.into_iter().enumerate() {
                x[CAMERA + i] = c;
            }
            Compared { x, distance_px }
        }))
    }

    /// The distance (px), and the camera's corrections there.
    fn one(&self, x: &Point, rollout: &Rollout) -> Option<(f64, [f64; CORRECTIONS])> {
        if !is_finite(rollout) || self.detections.is_empty() {
            return None;
        }
        let period_s = sample_s(Fidelity::Coarse);
        let samples = rollout.nodes.frames();
        let mut residuals = Vec::with_capacity(self.detections.len());
        let mut pull = SVector::<f64, CORRECTIONS>::zeros();
        for (detection, slopes) in &self.detections {
            let now = Instant::new(detection.time_s - x[CLOCK], period_s, samples);
            let p = now.position(&rollout.nodes, detection.along);
            let [u, v] = self.film.observation.camera.project_left(&p)?;
            let r = SVector::<f64, 2>::new(u - detection.pixel[0], v - detection.pixel[1]);
            pull += slopes.tr_mul(&r) * detection.weight;
            residuals.push(r);
        }
        let correction = -self.inverse * pull;
        let (mut sum, mut weights) = (0.0, 0.0);
        for (r, (detection, slopes)) in residuals.iter().zip(&self.detections) {
            let d = (r + slopes * correction).norm();
            let loss = if d <= OUTLIER_PX {
                d * d
            } else {
                OUTLIER_PX * (2.0 * d - OUTLIER_PX)
            };
            sum += detection.weight * loss;
            weights += detection.weight;
        }
        let distance_px = (sum / f64::max(weights, 1e-9)).sqrt();
        distance_px
            .is_finite()
            .then(|| (distance_px, correction.into()))
    }
}
