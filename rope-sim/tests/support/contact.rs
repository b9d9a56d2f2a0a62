//! Throws of random ropes across a thin wall.

use super::pushed::Pushed;
use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rope_sim::{AttachMotion, Obstacle, Shape};
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// Half edges of the thin wall about the origin.
pub const WALL_HALF_M: [f64; 3] = [0.005, 0.3, 0.2];

pub fn wall() -> Obstacle {
    let shape = Shape::Box {
        half_m: WALL_HALF_M,
    };
    Obstacle::fixed(shape, [0.0; 3], 0.5)
}

/// Throws a rope across the wall: the frame jerks sideways with a constant acceleration for a
/// moment, faster than any arm, and is braked as fast. It stays clear of the wall itself, since
/// the rope does not push it back.
pub fn random_whip(rng: &mut ChaCha8Rng) -> Pushed {
    loop {
        let push_s = rng.random_range(0.1..0.25);
        let mut speed = |max: f64| rng.random_range(-max..max);
        let velocity = Vector3::new(3.0 + speed(2.0), speed(1.0), speed(1.0));
        let push = velocity / push_s;
        let whip = Pushed {
            from_m: Vector3::new(-0.25 + speed(0.15), speed(0.2), 0.42 + speed(0.17)),
            r: Rotation3::from_axis_angle(&Vector3::y_axis(), 1.0 + speed(1.0)),
            pieces: vec![(push_s, push), (2.0 * push_s, -push)],
        };
        let is_clear = (0..=100).all(|i| {
            let p = whip.at(2.0 * push_s * f64::from(i) / 100.0).p_m;
            (0..3).any(|axis| p[axis].abs() > WALL_HALF_M[axis] + 0.03)
        });
        if is_clear {
            return whip;
        }
    }
}

/// A rope from the paper's ranges; every other one as thin as they go, lead and all.
pub fn random_rope(rng: &mut ChaCha8Rng, links: f64) -> RopeParams {
    let mut v: [f64; 9] = core::array::from_fn(|i| rng.random_range(RANGES[i].min..=RANGES[i].max));
    v[0] = links;
    if rng.random_bool(0.5) {
        (v[4], v[7]) = (0.003, 0.003);
    }
    RopeParams::from_array(v)
}
