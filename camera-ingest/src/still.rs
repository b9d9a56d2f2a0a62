//! Does the rope hang still?
//!
//! A frame is compared with one a little earlier, so that slow swinging shows, too; pixels
//! that changed by much more than the noise are counted. The whole picture counts: an arm
//! or a person that moves is not still either.

use std::collections::VecDeque;

use crate::frame::EyeFrame;

/// What changed between two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Pixels that changed by more than the noise explains.
    pub moved_px: usize,
    /// Mean square change above the noise (grey levels squared).
    pub energy: f64,
}

/// Compares two frames of one size.
#[must_use]
pub fn motion(a: &EyeFrame, b: &EyeFrame) -> Motion {
    // Pairs of pixels: half the noise, and the chroma's own raster.
    let pairs = |frame: &EyeFrame| {
        let pairs = frame.luma.chunks_exact(2);
        pairs
            .map(|p| f32::from(p[0]) + f32::from(p[1]))
            .collect::<Vec<f32>>()
    };
    let both = pairs(a).into_iter().zip(pairs(b));
    let changes: Vec<f32> = both.map(|(a, b)| (a - b) / 2.0).collect();
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
    pub fn new(lag: usize, needed: usize) -> Self {
        Self {
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
            let moved = motion(&before, &frame).moved_px;
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
            luma,
            ..EyeFrame::grey([width_px, height_px], 0)
        }
    }

    #[test]
    fn noise_and_drift_are_not_motion() {
        let mut brighter = frame(2, Some(20));
        brighter.luma.iter_mut().for_each(|y| *y += 4);
        assert_eq!(motion(&frame(1, Some(20)), &brighter).moved_px, 0);
        let moved = motion(&frame(1, Some(20)), &frame(2, Some(24)));
        assert!(moved.moved_px > 100 && moved.energy > 10.0, "{moved:?}");
    }

    #[test]
    fn still_only_after_enough_still_frames() {
        let mut detector = StillDetector::new(2, 3);
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
