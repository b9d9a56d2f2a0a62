//! The lead's outline: a circle through the places where contrast falls to half.
//!
//! Colour weights pull a centroid to the lit side of a shaded ball; its outline
//! does not move with the light. Motion blur widens it evenly.

use super::background::Background;
use super::evidence::Window;
use crate::frame::EyeFrame;

/// Rays from the centre.
const RAYS: usize = 40;
/// Distance of samples on a ray (px).
const STEP_PX: f64 = 0.5;
/// Edges of the rope are smeared this far into the outline beside it (px).
const MARGIN_PX: f64 = 0.7;
/// Rays reach this many radii, and the blur.
const RAY_RADII: f64 = 1.7;
/// Part of the free rays that must agree on the circle.
const LEAST_RAYS: f64 = 0.5;

/// A circle in raw pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Circle {
    pub(super) centre: [f64; 2],
    pub(super) radius_px: f64,
}

/// The rope where it enters the lead.
#[derive(Debug, Clone, Copy)]
pub(super) struct RopeEnd {
    /// Direction from the lead's centre into the rope (rad, from +u towards +v).
    pub(super) angle_rad: f64,
    /// Half the rope's width.
    pub(super) radius_px: f64,
}

impl RopeEnd {
    /// The rope hides the outline of a circle on a ray: half a circle for a
    /// lead no fatter than its rope.
    fn hides(self, ray_rad: f64, lead_radius_px: f64) -> bool {
        let half = ((self.radius_px + MARGIN_PX) / lead_radius_px)
            .min(1.0)
            .asin();
        (ray_rad - self.angle_rad).cos() > half.cos()
    }
}

/// Contrast of single pixels against the background.
pub(super) struct Contrast<'a> {
    pub(super) frame: &'a EyeFrame,
    pub(super) background: &'a Background,
    pub(super) gain: f32,
}

impl Contrast<'_> {
    fn pixel(&self, u: usize, v: usize) -> f64 {
        let (seen, empty) = (self.frame.ycc(u, v), self.background.image.ycc(u, v));
        let luma = f32::from(seen[0]) / self.gain - f32::from(empty[0]);
        let chroma =
            |k: usize| (f32::from(seen[k]) - 128.0) / self.gain - (f32::from(empty[k]) - 128.0);
        f64::from((luma * luma + chroma(1).powi(2) + chroma(2).powi(2)).sqrt())
    }

    /// Contrast at a raw pixel, bilinear; the border's value outside the image.
    pub(super) fn at(&self, place: [f64; 2]) -> f64 {
        self.bilinear(place, |u, v| self.pixel(u, v))
    }

    fn bilinear(&self, [u, v]: [f64; 2], pixel: impl Fn(usize, usize) -> f64) -> f64 {
        let u = u.clamp(0.0, (self.frame.width_px - 1) as f64);
        let v = v.clamp(0.0, (self.frame.height_px - 1) as f64);
        let (i, j) = (u as usize, v as usize);
        let (a, b) = (u - i as f64, v - j as f64);
        let row = |y: usize| (1.0 - a) * pixel(i, y) + a * pixel(i + 1, y);
        (1.0 - b) * row(j) + b * row(j + 1)
    }

    /// Circle near a guess. `None` when too few rays find an edge, or the edges
    /// form no circle within `0.65..1.4` of the guessed radius (grown by half
    /// the blur).
    pub(super) fn circle(&self, guess: Circle, blur_px: f64, rope: RopeEnd) -> Option<Circle> {
        let free: Vec<f64> = (0..RAYS)
            .map(|ray| ray as f64 * std::f64::consts::TAU / RAYS as f64)
            .filter(|&ray_rad| !rope.hides(ray_rad, guess.radius_px))
            .collect();
        let enough = LEAST_RAYS * free.len() as f64;
        let mut circle = guess;
        let patch = Patch::around(self, guess.centre, RAY_RADII * guess.radius_px + blur_px);
        for _ in 0..3 {
            let edges = patch.edges(&free, circle.centre, guess.radius_px, blur_px);
            circle = robust_circle(&edges, enough)?;
            let least = 0.65 * guess.radius_px;
            let most = 1.4 * guess.radius_px + blur_px / 2.0;
            let moved =
                (circle.centre[0] - guess.centre[0]).hypot(circle.centre[1] - guess.centre[1]);
            if !(least..=most).contains(&circle.radius_px)
                || moved > 0.6 * guess.radius_px + blur_px / 2.0
            {
                return None;
            }
        }
        Some(circle)
    }

    /// Centre of a lead that looks like the rope's own end: `radius_px` before
    /// the place where the contrast, followed out of the rope, falls to half.
    /// `None` when there is no rope before the expected centre or no end within
    /// `reach_px`.
    pub(super) fn free_end(
        &self,
        expected: Circle,
        rope: RopeEnd,
        reach_px: f64,
    ) -> Option<[f64; 2]> {
        let (sin, cos) = rope.angle_rad.sin_cos();
        let inward = |px: f64| [expected.centre[0] + px * cos, expected.centre[1] + px * sin];
        // Begin up the rope: the end may lie before the expected place.
        let start = reach_px / 2.0 + expected.radius_px;
        let samples = ((1.5 * reach_px + 2.0 * expected.radius_px) / STEP_PX) as usize;
        let at = |k: usize| self.at(inward(start - k as f64 * STEP_PX));
        let level = at(0);
        if level < 6.0 * f64::from(self.background.noise) {
            return None;
        }
        let last = (0..samples).find(|&k| at(k + 1) < level / 2.0)?;
        let (here, next) = (at(last), at(last + 1));
        let part = ((here - level / 2.0) / (here - next).max(1e-9)).clamp(0.0, 1.0);
        Some(inward(
            start - (last as f64 + part) * STEP_PX + expected.radius_px,
        ))
    }
}

/// Contrast around a place, computed once for rays that cross each other.
struct Patch<'a> {
    contrast: &'a Contrast<'a>,
    window: Window,
    values: Vec<f64>,
}

impl<'a> Patch<'a> {
    fn around(contrast: &'a Contrast<'a>, centre: [f64; 2], reach_px: f64) -> Self {
        let window = Window::around(std::iter::once(centre), reach_px, contrast.frame);
        let values = (window.v0..window.v1)
            .flat_map(|v| (window.u0..window.u1).map(move |u| contrast.pixel(u, v)))
            .collect();
        Self {
            contrast,
            window,
            values,
        }
    }

    #[inline]
    fn pixel(&self, u: usize, v: usize) -> f64 {
        let w = self.window;
        // Before the window these are huge.
        let (x, y) = (u.wrapping_sub(w.u0), v.wrapping_sub(w.v0));
        let width = w.u1 - w.u0;
        if x < width && y < w.v1 - w.v0 {
            self.values[y * width + x]
        } else {
            self.contrast.pixel(u, v)
        }
    }

    #[inline]
    fn at(&self, place: [f64; 2]) -> f64 {
        self.contrast.bilinear(place, |u, v| self.pixel(u, v))
    }

    /// Places on rays where the contrast falls below half of the inside's.
    fn edges(
        &self,
        rays_rad: &[f64],
        centre: [f64; 2],
        radius_px: f64,
        blur_px: f64,
    ) -> Vec<[f64; 2]> {
        let floor = 3.0 * f64::from(self.contrast.background.noise);
        let samples = ((RAY_RADII * radius_px + blur_px) / STEP_PX) as usize;
        let inside = (0.3 * radius_px / STEP_PX) as usize..=(0.75 * radius_px / STEP_PX) as usize;
        rays_rad
            .iter()
            .filter_map(|ray_rad| {
                let (sin, cos) = ray_rad.sin_cos();
                let place = |k: f64| [centre[0] + k * STEP_PX * cos, centre[1] + k * STEP_PX * sin];
                let at = |k: usize| self.at(place(k as f64));
                if *inside.end() > samples {
                    return None;
                }
                let sum: f64 = inside.clone().map(at).sum();
                let level = sum / inside.clone().count() as f64;
                if level < 2.0 * floor {
                    return None;
                }
                let half = level / 2.0;
                // From the inside outwards: the first place that is followed by less.
                let mut before = at(*inside.end());
                let (first, [here, next]) = (*inside.end()..samples).find_map(|k| {
                    let after = at(k + 1);
                    let here = std::mem::replace(&mut before, after);
                    (after < half).then_some((k, [here, after]))
                })?;
                let fall = here - next;
                let part = if fall > 1e-9 {
                    (here - half) / fall
                } else {
                    0.5
                };
                Some(place(first as f64 + part.clamp(0.0, 1.0)))
            })
            .collect()
    }
}

/// Circle through most of the points: fit, drop what lies off, fit again.
fn robust_circle(points: &[[f64; 2]], enough: f64) -> Option<Circle> {
    let mut kept = points.to_vec();
    let mut circle = None;
    for _ in 0..4 {
        if (kept.len() as f64) < enough {
            return None;
        }
        let fit = fit_circle(&kept)?;
        let off = |p: &[f64; 2]| {
            ((p[0] - fit.centre[0]).hypot(p[1] - fit.centre[1]) - fit.radius_px).abs()
        };
        let mut sorted: Vec<f64> = points.iter().map(off).collect();
        sorted.sort_by(f64::total_cmp);
        let limit = (2.5 * sorted[sorted.len() / 2]).max(0.5);
        kept = points.iter().copied().filter(|p| off(p) <= limit).collect();
        circle = Some(fit);
    }
    circle
}

/// Least-squares circle (Kasa): `u^2 + v^2 = 2 a u + 2 b v + c`.
fn fit_circle(points: &[[f64; 2]]) -> Option<Circle> {
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / count;
    let (u0, v0) = (mean(0), mean(1));
    let (mut uu, mut uv, mut vv, mut uz, mut vz, mut z) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let (u, v) = (p[0] - u0, p[1] - v0);
        let square = u * u + v * v;
        uu += u * u;
        uv += u * v;
        vv += v * v;
        uz += u * square;
        vz += v * square;
        z += square;
    }
    let det = 2.0 * (uu * vv - uv * uv);
    if det.abs() < 1e-9 {
        return None;
    }
    let (a, b) = ((uz * vv - vz * uv) / det, (vz * uu - uz * uv) / det);
    Some(Circle {
        centre: [u0 + a, v0 + b],
        radius_px: (a * a + b * b + z / count).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_found_among_strays() {
        let mut points: Vec<[f64; 2]> = (0..RAYS)
            .map(|i| {
                let angle = i as f64 * std::f64::consts::TAU / RAYS as f64;
                [12.5 + 7.0 * angle.cos(), -3.0 + 7.0 * angle.sin()]
            })
            .collect();
        for p in &mut points[..6] {
            p[1] += 5.0;
        }
        let circle = robust_circle(&points, 20.0).unwrap();
        assert!((circle.centre[0] - 12.5).abs() < 1e-6 && (circle.centre[1] + 3.0).abs() < 1e-6);
        assert!((circle.radius_px - 7.0).abs() < 1e-6);
        assert_eq!(robust_circle(&points[..10], 20.0), None);
    }
}
