//! The shadows of moving things during one exposure, in the lamps' own pictures.

use super::bodies::{Cast, ScenePose};
use super::lamp_view::{Cover, LampView};

/// Places of the rope during one exposure whose shadows are drawn.
const ROPES: usize = 4;

/// What each lamp's light meets on its way.
#[derive(Debug)]
pub(super) struct Shadows {
    views: Vec<LampView>,
    /// All but the rope, which hardly moves during a frame.
    still: Vec<Cover>,
    /// Each lamp's covers, as last cast.
    pub(super) covers: Vec<Cover>,
    rope: Cover,
}

impl Shadows {
    pub(super) fn of(views: Vec<LampView>) -> Self {
        Self {
            still: vec![Cover::empty(); views.len()],
            covers: vec![Cover::empty(); views.len()],
            rope: Cover::empty(),
            views,
        }
    }

    /// Begins a frame of the sub-frames `poses`.
    pub(super) fn begin(&mut self, cast: &Cast, poses: &[ScenePose]) {
        let Some(middle) = poses.get(poses.len() / 2) else {
            return;
        };
        let mut solids = cast.arm(&middle.q);
        solids.extend(cast.others);
        for (view, still) in self.views.iter().zip(&mut self.still) {
            still.clear();
            still.draw(view, &solids);
        }
    }

    /// Casts the shadows of the sub-frames `poses`, each with its weight.
    pub(super) fn cast(
        &mut self,
        cast: &Cast,
        poses: &[ScenePose],
        weight_of: impl Fn(usize) -> f32,
    ) {
        let seen: Vec<usize> = (0..poses.len()).filter(|i| weight_of(*i) > 0.0).collect();
        let total: f32 = seen.iter().map(|i| weight_of(*i)).sum();
        let groups: Vec<_> = seen
            .chunks(seen.len().div_ceil(ROPES).max(1))
            .map(|group| {
                let weight: f32 = group.iter().map(|i| weight_of(*i)).sum();
                let nodes = &poses[group[group.len() / 2]].nodes;
                (cast.rope.coarse_solids(nodes), weight / total)
            })
            .collect();
        let lamps = self.views.iter().zip(&self.still).zip(&mut self.covers);
        for ((view, still), cover) in lamps {
            cover.copy(still);
            for (rope, weight) in &groups {
                self.rope.clear();
                self.rope.draw(view, rope);
                cover.add(still, &self.rope, *weight);
            }
        }
    }
}
