//! Does the rope hang still?
//!
//! A frame is compared with one a little earlier, so that slow swinging shows,
//! too; pixels that changed by much more than the noise are counted within the
//! rope's reach.

use std::collections::VecDeque;

use nalgebra::Vector3;
use shared_types::StereoCamera;

use crate::frame::EyeFrame;

/// A rectangle of raw pixels, upper bounds exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub u0: usize,
    /// First row.
    pub v0: usize,
    /// Column after the last.
    pub u1: usize,
    /// Row after the last.
    pub v1: usize,
}

impl Region {
    /// Where a rope of `length_m` hanging on the clamp can be while it swings
    /// out by up to half its length; `None` when that is not in view.
    #[must_use]
    pub fn below_clamp(
        camera: &StereoCamera,
        p_w_clamp_m: &Vector3<f64>,
        length_m: f64,
    ) -> Option<Self> {
        let sideways = camera.r_w_cam.column(0) * (length_m / 2.0);
        let down = Vector3::new(0.0, 0.0, -1.1 * length_m);
        let corners = [
            p_w_clamp_m + sideways,
            p_w_clamp_m - sideways,
            p_w_clamp_m + sideways + down,
            p_w_clamp_m - sideways + down,
        ];
        let pixels: Vec<[f64; 2]> = corners
            .iter()
            .map(|p| camera.project_left(p))
            .collect::<Option<_>>()?;
        let bound = |k: usize, limit: u32| {
            let ends = pixels.iter().map(|p| p[k].clamp(0.0, f64::from(limit)));
            let low = ends.clone().fold(f64::INFINITY, f64::min);
            let high = ends.fold(0.0, f64::max);
            (low as usize, high as usize)
        };
        let (u0, u1) = bound(0, camera.width_px);
        let (v0, v1) = bound(1, camera.height_px);
        (u1 > u0 + 8 && v1 > v0 + 8).then_some(Self { u0, v0, u1, v1 })
    }
}

/// What changed between two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Pixels that changed by more than the noise explains.
    pub moved_px: usize,
    /// Mean square change above the noise (grey levels squared).
    pub energy: f64,
}

/// Compares two frames of one size within a region (cut to the image).
#[must_use]
pub fn motion(a: &EyeFrame, b: &EyeFrame, region: Region) -> Motion {
    let width = a.width_px.min(b.width_px);
    let height = a.height_px.min(b.height_px);
    let (u1, v1) = (region.u1.min(width), region.v1.min(height));
    let mut changes: Vec<f32> = Vec::new();
    // Pairs of pixels: half the noise, and the chroma's own raster.
    for v in region.v0..v1 {
        for u in (region.u0..u1.saturating_sub(1)).step_by(2) {
            let pair = |f: &EyeFrame| {
                let at = v * f.width_px + u;
                f32::from(f.luma[at]) + f32::from(f.luma[at + 1])
            };
            changes.push((pair(a) - pair(b)) / 2.0);
        }
    }
    if changes.is_empty() {
        return Motion {
            moved_px: 0,
            energy: 0.0,
        };
    }
    // The median is a drift of the light, the median deviation is noise.
    let middle = changes.len() / 2;
    let mut sorted = changes.clone();
    let drift = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let mut away: Vec<f32> = changes.iter().map(|c| (c - drift).abs()).collect();
    let noise = 1.4826 * *away.select_nth_unstable_by(middle, f32::total_cmp).1;
    let threshold = (6.0 * noise).max(8.0);
    let moved: Vec<f32> = away.into_iter().filter(|a| *a > threshold).collect();
    let energy: f64 = moved.iter().map(|m| f64::from(*m).powi(2)).sum();
    Motion {
        moved_px: 2 * moved.len(),
        energy: energy / changes.len() as f64,
    }
}

/// Says when a rope has hung still for a while.
#[derive(Debug)]
pub struct StillDetector {
    region: Region,
    lag: usize,
    needed: usize,
    moved_limit_px: usize,
    recent: VecDeque<EyeFrame>,
    still_frames: usize,
}

impl StillDetector {
    /// Still means: over `needed` frames in a row, no more than 12 pixels differ
    /// from the frame a tenth of a second (`lag` frames) earlier.
    #[must_use]
    pub fn new(region: Region, lag: usize, needed: usize) -> Self {
        Self {
            region,
            lag: lag.max(1),
            needed: needed.max(1),
            moved_limit_px: 12,
            recent: VecDeque::new(),
            still_frames: 0,
        }
    }

    /// Takes the next left-eye frame; `true` once the rope hangs still.
    pub fn push(&mut self, frame: EyeFrame) -> bool {
        if self.recent.len() >= self.lag
            && let Some(before) = self.recent.pop_front()
        {
            let moved = motion(&before, &frame, self.region).moved_px;
            self.still_frames = if moved <= self.moved_limit_px {
                self.still_frames + 1
            } else {
                0
            };
        }
        self.recent.push_back(frame);
        self.still_frames >= self.needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey frame with deterministic noise and a bright bar at column `bar`.
    fn frame(seed: usize, bar: Option<usize>) -> EyeFrame {
        let (width_px, height_px) = (64, 48);
        let mut luma: Vec<u8> = (0..width_px * height_px)
            .map(|i| 100 + u8::try_from((i * 7919 + seed * 104_729) % 5).unwrap())
            .collect();
        for v in 10..40 {
            if let Some(u) = bar {
                luma[v * width_px + u..v * width_px + u + 3].fill(200);
            }
        }
        EyeFrame {
            stamp_ns: 0,
            sequence: 0,
            width_px,
            height_px,
            luma,
            cb: vec![128; width_px * height_px / 2],
            cr: vec![128; width_px * height_px / 2],
        }
    }

    const ALL: Region = Region {
        u0: 0,
        v0: 0,
        u1: 64,
        v1: 48,
    };

    #[test]
    fn noise_and_drift_are_not_motion() {
        let mut brighter = frame(2, Some(20));
        brighter.luma.iter_mut().for_each(|y| *y += 4);
        assert_eq!(motion(&frame(1, Some(20)), &brighter, ALL).moved_px, 0);
        let moved = motion(&frame(1, Some(20)), &frame(2, Some(24)), ALL);
        assert!(moved.moved_px > 100 && moved.energy > 10.0, "{moved:?}");
        let elsewhere = Region { u1: 16, ..ALL };
        assert_eq!(
            motion(&frame(1, Some(20)), &frame(2, Some(24)), elsewhere).moved_px,
            0
        );
    }

    #[test]
    fn still_only_after_enough_still_frames() {
        let mut detector = StillDetector::new(ALL, 2, 3);
        let mut said = Vec::new();
        for i in 0..10 {
            let bar = if i < 4 { 10 + 5 * i } else { 40 };
            said.push(detector.push(frame(i, Some(bar))));
        }
        // Frame 6 is the first like the one two before it; 8 the third.
        assert_eq!(said.iter().position(|s| *s), Some(8));
        assert!(!detector.push(frame(11, Some(10))));
    }
}
