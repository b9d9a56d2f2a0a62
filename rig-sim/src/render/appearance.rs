//! Colours of the rig's things.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Keeps the draw of colours apart from other draws of the same seed.
const STREAM: u64 = 0x636f_6c6f_7572;

/// Colours (8-bit video RGB) of what the camera sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Appearance {
    /// The rope.
    pub rope_rgb: [u8; 3],
    /// The lead at its end.
    pub lead_rgb: [u8; 3],
    /// The target ball.
    pub target_rgb: [u8; 3],
    /// The plaster wall behind the robot.
    pub wall_rgb: [u8; 3],
}

/// Rope, lead and target: three hues that nobody confuses.
const TRIPLES: [[[u8; 3]; 3]; 5] = [
    [[214, 96, 36], [44, 84, 196], [38, 168, 74]],
    [[176, 38, 44], [236, 198, 36], [40, 92, 204]],
    [[44, 82, 160], [240, 150, 30], [206, 48, 140]],
    [[116, 74, 48], [84, 178, 44], [202, 44, 132]],
    [[204, 84, 40], [200, 44, 150], [30, 150, 160]],
];

/// Plaster: grey, warm, cool.
const WALLS: [[u8; 3]; 3] = [[186, 187, 184], [190, 184, 172], [174, 182, 190]];

impl Appearance {
    /// Colours drawn from a seed.
    #[must_use]
    pub fn from_seed(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ STREAM);
        let [rope_rgb, lead_rgb, target_rgb] = TRIPLES[rng.random_range(0..TRIPLES.len())];
        Self {
            rope_rgb,
            lead_rgb,
            target_rgb,
            wall_rgb: WALLS[rng.random_range(0..WALLS.len())],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::colour::ycc;

    #[test]
    fn hues_are_far_apart_whatever_the_seed() {
        for seed in 0..50 {
            let a = Appearance::from_seed(seed);
            let chroma = |rgb: [u8; 3]| {
                let [_, cb, cr] = ycc(rgb.map(f32::from));
                (cb, cr)
            };
            let all = [a.rope_rgb, a.lead_rgb, a.target_rgb, a.wall_rgb].map(chroma);
            for i in 0..4 {
                for j in 0..i {
                    let far = (all[i].0 - all[j].0).hypot(all[i].1 - all[j].1);
                    assert!(far > 20.0, "seed {seed}: {i} and {j} differ by {far}");
                }
            }
        }
    }
}
