//! The second image as a witness.
//!
//! What was read off one image lies at the hypothesis's depth: that says where it is in the
//! other one. A shadow on the wall, a cable further back or a person is elsewhere there.

use super::colour::Colour;
use super::curve::normals;
use super::evidence::Scene;
use super::field::{Look, offsets};
use super::read::NODES;
use crate::frame::EyeFrame;

/// The rope is looked for this far to either side of where it should be (px).
const REACH_PX: usize = 8;
/// Found so near, once what all places have in common is taken off, it is confirmed (px).
const NEAR_PX: f64 = 3.0;
/// What all may have in common: the right image's calibration (px).
const COMMON_PX: f64 = 4.0;
/// Least contrast of what is found.
const LEAST: f64 = 0.3;

/// One frame of the second image.
#[derive(Debug)]
pub(super) struct Sight<'a> {
    /// Index of the first image's frame of the same time.
    pub(super) index: usize,
    pub(super) frame: &'a EyeFrame,
    /// Where the rope should be.
    pub(super) curve: Vec<[f64; 2]>,
}

/// What the second image shows.
#[derive(Debug, Clone)]
pub(super) struct Testimony {
    /// Frames looked at, and the part of the rope that each confirms.
    frames: Vec<(usize, f64)>,
    /// Part of the frames that confirm a place.
    nodes: Vec<f64>,
}

impl Testimony {
    /// Looks for the rope's colours where it should be.
    pub(super) fn of(
        scene: &Scene,
        sights: &[Sight<'_>],
        rope: &[Colour],
        half_width_px: f64,
    ) -> Option<Self> {
        let look = Look {
            reach: REACH_PX,
            half_width_px,
            jump: 0.05,
        };
        let found: Vec<_> = sights
            .iter()
            .map(|sight| {
                let gain = scene.gain(sight.frame);
                let at = |p| scene.present(sight.frame, gain, rope, p);
                offsets(&sight.curve, &normals(&sight.curve), look, at)
            })
            .collect();
        let mut clear: Vec<f64> = found
            .iter()
            .flatten()
            .filter(|o| o.weight > LEAST)
            .map(|o| o.px)
            .collect();
        clear.sort_by(f64::total_cmp);
        let common_px = clear.get(clear.len() / 2).copied().unwrap_or(0.0);
        let is_common = common_px.abs() <= COMMON_PX;
        let confirmed: Vec<Vec<bool>> = found
            .iter()
            .map(|offsets| {
                let near = |px: f64| is_common && (px - common_px).abs() <= NEAR_PX;
                let confirms = offsets.iter().map(|o| o.weight > LEAST && near(o.px));
                confirms.collect()
            })
            .collect();
        let part = |of: &mut dyn Iterator<Item = bool>| {
            let (yes, all) = of.fold((0.0, 0.0), |(yes, all), c| {
                (yes + f64::from(u8::from(c)), all + 1.0)
            });
            yes / f64::max(all, 1.0)
        };
        (!sights.is_empty()).then(|| Self {
            frames: sights
                .iter()
                .zip(&confirmed)
                .map(|(s, c)| (s.index, part(&mut c.iter().copied())))
                .collect(),
            nodes: (0..NODES)
                .map(|k| part(&mut confirmed.iter().map(|c| c[k])))
                .collect(),
        })
    }

    /// Part of all places in all frames that is confirmed.
    pub(super) fn confirmed(&self) -> f64 {
        self.frames.iter().map(|(_, part)| part).sum::<f64>() / self.frames.len() as f64
    }

    /// Part of the rope confirmed in the frame nearest to one of the first image's.
    pub(super) fn around(&self, index: usize) -> f64 {
        let after = self.frames.partition_point(|(i, _)| *i < index);
        let near = &self.frames[after.saturating_sub(1)..(after + 1).min(self.frames.len())];
        near.iter().map(|(_, part)| part).sum::<f64>() / near.len().max(1) as f64
    }

    /// Part of the frames that confirm a part of the rope (0 at the clamp to 1).
    pub(super) fn along(&self, part: f64) -> f64 {
        let last = self.nodes.len() - 1;
        self.nodes[(part.clamp(0.0, 1.0) * last as f64).round() as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(stamp_ns: u64, rope_at: Option<usize>) -> EyeFrame {
        let mut frame = EyeFrame {
            stamp_ns,
            ..EyeFrame::grey([96, 128], 150)
        };
        if let Some(u) = rope_at {
            for v in 0..128 {
                frame.luma[v * 96 + u - 3..v * 96 + u + 3].fill(40);
            }
        }
        frame
    }

    #[test]
    fn a_rope_at_another_depth_is_not_confirmed() {
        let scene = Scene::of(&[drawn(1, None), drawn(2, None), drawn(3, None)], 3);
        let confirmed = |rope_at: usize, frames: usize| {
            let frames: Vec<EyeFrame> = (0..frames)
                .map(|i| drawn(i as u64, Some(rope_at)))
                .collect();
            let curve: Vec<[f64; 2]> = (0..NODES).map(|k| [47.5, 10.0 + k as f64 * 1.5]).collect();
            let sights: Vec<Sight<'_>> = (0..)
                .zip(&frames)
                .map(|(index, frame)| Sight {
                    index,
                    frame,
                    curve: curve.clone(),
                })
                .collect();
            Testimony::of(&scene, &sights, &[[40.0, 0.0, 0.0]], 3.0).map(|t| t.confirmed())
        };
        assert!(confirmed(48, 4).unwrap() > 0.95);
        assert!(
            confirmed(50, 4).unwrap() > 0.95,
            "a calibration a little off"
        );
        assert!(confirmed(54, 4).unwrap() < 0.05);
        assert!(confirmed(70, 4).unwrap() < 0.05);
        assert!(confirmed(48, 0).is_none());
    }
}
