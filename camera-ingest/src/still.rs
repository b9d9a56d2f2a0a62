//! Does the rope hang still?
//!
//! A frame is compared with one a little earlier, so that slow swinging shows, too; pixels
//! that changed by much more than the noise are counted. The whole picture counts: an arm
//! or a person that moves is not still either.

use std::collections::VecDeque;

use crate::frame::ImageFrame;

/// Pixels that changed between two frames of one size by more than noise explains.
fn moved_px(a: &ImageFrame, b: &ImageFrame) -> usize {
    // Pairs of pixels: half the noise, and the chroma's own raster.
    let pairs = a.luma.chunks_exact(2).zip(b.luma.chunks_exact(2));
    let mean = |pair: &[u8]| (f32::from(pair[0]) + f32::from(pair[1])) / 2.0;
    let changes: Vec<f32> = pairs.map(|(a, b)| mean(a) - mean(b)).collect();
    if changes.is_empty() {
        return 0;
    }
    // The median is a drift of the light, the median deviation is noise.
    let middle = changes.len() / 2;
    let mut sorted = changes.clone();
    let drift = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let mut away: Vec<f32> = changes.iter().map(|c| (c - drift).abs()).collect();
    let noise = 1.4826 * *away.select_nth_unstable_by(middle, f32::total_cmp).1;
    let threshold = (6.0 * noise).max(8.0);
    2 * away.iter().filter(|a| **a > threshold).count()
}

/// The rope hangs still while no more pixels than this change.
const STILL_PX: usize = 12;

/// Says when a rope has hung still for a while.
#[derive(Debug)]
pub struct StillDetector {
    lag: usize,
    needed: usize,
    recent: VecDeque<ImageFrame>,
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
            recent: VecDeque::new(),
            still_frames: 0,
        }
    }

    /// Takes the next left-eye frame; `true` once the rope hangs still.
    pub fn push(&mut self, frame: ImageFrame) -> bool {
        if self.recent.len() >= self.lag
            && let Some(before) = self.recent.pop_front()
        {
            let is_still = moved_px(&before, &frame) <= STILL_PX;
            self.still_frames = if is_still { self.still_frames + 1 } else { 0 };
        }
        self.recent.push_back(frame);
        self.still_frames >= self.needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey frame with deterministic noise and a bright bar at column `bar`.
    fn frame(seed: usize, bar: usize) -> ImageFrame {
        let (width_px, height_px) = (64, 48);
        let mut luma: Vec<u8> = (0..width_px * height_px)
            .map(|i| 100 + u8::try_from((i * 7919 + seed * 104_729) % 5).unwrap())
            .collect();
        for row in luma.chunks_exact_mut(width_px).take(40).skip(10) {
            row[bar..bar + 3].fill(200);
        }
        ImageFrame {
            luma,
            ..ImageFrame::grey([width_px, height_px], 0)
        }
    }

    #[test]
    fn noise_and_drift_are_not_motion() {
        let mut brighter = frame(2, 20);
        brighter.luma.iter_mut().for_each(|y| *y += 4);
        assert_eq!(moved_px(&frame(1, 20), &brighter), 0);
        let moved = moved_px(&frame(1, 20), &frame(2, 24));
        assert!(moved > 100, "{moved}");
    }

    #[test]
    fn still_only_after_enough_still_frames() {
        let mut detector = StillDetector::new(2, 3);
        let mut said = Vec::new();
        for i in 0..10 {
            let bar = if i < 4 { 10 + 5 * i } else { 40 };
            said.push(detector.push(frame(i, bar)));
        }
        // Frame 6 is the first like the one two before it; 8 the third.
        assert_eq!(said.iter().position(|s| *s), Some(8));
        assert!(!detector.push(frame(11, 10)));
    }
}
