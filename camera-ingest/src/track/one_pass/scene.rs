//! The scene without rope, from frames as they come.
//!
//! A frame becomes a sample when enough has moved since the last sample: while the
//! rope stands still it must not become part of the scene. The median over the newest
//! samples is renewed band by band, one a frame, so that no frame takes long.

use super::super::background::{Background, changed};
use crate::frame::EyeFrame;

/// Samples kept, and how many there must be for a first median.
const SAMPLES: usize = 15;
const LEAST_SAMPLES: usize = 9;
/// Part of the pixels that must have changed since the last sample: an eighth of a
/// rope half a metre long at a distance of a metre.
const MOVED: f64 = 5e-4;
/// Frames between two samples at least: the samples then span most of a swing.
const APART: u64 = 3;
/// Frames between two that may be the one in which the rope hangs still. The older one
/// is taken: when motion shows in the newest, it had begun before.
const QUIET_APART: u64 = 15;
/// Bands in which the median is renewed.
const BANDS: usize = 8;

/// The scene as far as it is known.
#[derive(Debug)]
pub(super) struct Scene {
    /// A frame a while before anything moved; the rope hangs still in it.
    rest: EyeFrame,
    /// A later one in which nothing had moved yet, and which one that was.
    quiet: (EyeFrame, u64),
    samples: Vec<EyeFrame>,
    /// Sample that the next one takes the place of, once there are all.
    oldest: usize,
    last_sample: u64,
    background: Background,
    /// Bands of this round still to be renewed.
    stale: usize,
    /// A sample came since the round began: another one follows.
    again: bool,
    /// All bands were renewed once.
    whole: bool,
}

impl Scene {
    pub(super) fn new(first: EyeFrame) -> Self {
        Self {
            background: Background {
                image: first.clone(),
                noise: 1.0,
            },
            quiet: (first.clone(), 0),
            rest: first,
            samples: Vec::new(),
            oldest: 0,
            last_sample: 0,
            stale: 0,
            again: false,
            whole: false,
        }
    }

    pub(super) fn rest(&self) -> &EyeFrame {
        &self.rest
    }

    /// From now on the rope is to be found where it is in this frame, the `index`-th.
    pub(super) fn rest_in(&mut self, frame: &EyeFrame, index: u64) {
        self.rest.clone_from(frame);
        self.quiet = (frame.clone(), index);
    }

    /// The scene without rope, once there is one.
    pub(super) fn background(&self) -> Option<&Background> {
        self.whole.then_some(&self.background)
    }

    /// Takes a frame, the `index`-th, as a sample if enough has moved in the picture.
    pub(super) fn watch(&mut self, frame: &EyeFrame, index: u64) {
        let newest = self.newest().unwrap_or(&self.rest);
        let moved = changed(newest, frame) > MOVED;
        match (moved, self.samples.is_empty()) {
            (false, true) if index >= self.quiet.1 + QUIET_APART => {
                let quiet = std::mem::replace(&mut self.quiet, (frame.clone(), index));
                self.rest = quiet.0;
            }
            (true, _) if index >= self.last_sample + APART => self.take(frame, index),
            _ => {}
        }
    }

    /// Takes a frame as a sample.
    pub(super) fn take(&mut self, frame: &EyeFrame, index: u64) {
        self.last_sample = index;
        if self.samples.len() < SAMPLES {
            self.samples.push(frame.clone());
        } else {
            self.samples[self.oldest].clone_from(frame);
            self.oldest = (self.oldest + 1) % SAMPLES;
        }
        self.again = true;
    }

    fn newest(&self) -> Option<&EyeFrame> {
        let before = (self.oldest + self.samples.len()).checked_sub(1)?;
        self.samples.get(before % self.samples.len().max(1))
    }

    /// Renews one band of the median, if one is out of date.
    pub(super) fn renew(&mut self) {
        if self.stale == 0 {
            if self.samples.len() < LEAST_SAMPLES || !self.again {
                return;
            }
            (self.stale, self.again) = (BANDS, false);
        }
        self.stale -= 1;
        let rows = self.rest.height_px;
        let band = rows * self.stale / BANDS..rows * (self.stale + 1) / BANDS;
        self.background.renew(&self.samples, band);
        if self.stale == 0 {
            self.whole = true;
            if let Some(newest) = self.newest().cloned() {
                self.background.measure_noise(&newest);
            }
        }
    }
}
