//! Throws of random ropes across a thin wall.

use arm_model::kinematics::FrameMotion;
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

/// Throws a rope across a thin wall: the frame jerks sideways with a constant
/// acceleration for a moment, faster than any arm.
pub struct Whip {
    pub from_m: Vector3<f64>,
    pub acceleration_m_s2: Vector3<f64>,
    pub push_s: f64,
    pub r: Rotation3<f64>,
}

impl Whip {
    /// One whose frame stays clear of the wall; the rope does not push it back.
    pub fn random(rng: &mut ChaCha8Rng) -> Self {
        loop {
            let push_s = rng.random_range(0.1..0.25);
            let mut speed = |max: f64| rng.random_range(-max..max);
            let velocity = Vector3::new(3.0 + speed(2.0), speed(1.0), speed(1.0));
            let whip = Self {
                from_m: Vector3::new(-0.25 + speed(0.15), speed(0.2), 0.42 + speed(0.17)),
                acceleration_m_s2: velocity / push_s,
                push_s,
                r: Rotation3::from_axis_angle(&Vector3::y_axis(), 1.0 + speed(1.0)),
            };
            let is_clear = (0..=100).all(|i| {
                let p = whip.at(whip.duration_s() * f64::from(i) / 100.0).p_m;
                (0..3).any(|axis| p[axis].abs() > WALL_HALF_M[axis] + 0.03)
            });
            if is_clear {
                return whip;
            }
        }
    }
}

impl AttachMotion for Whip {
    fn at(&self, t_s: f64) -> FrameMotion {
        // Forth, then braked.
        let forth = t_s.clamp(0.0, self.push_s);
        let back = (t_s - self.push_s).clamp(0.0, self.push_s);
        let v = forth - back;
        let sign = match t_s {
            t if t < self.push_s => 1.0,
            t if t < 2.0 * self.push_s => -1.0,
            _ => 0.0,
        };
        let path = 0.5 * forth * forth + forth * back - 0.5 * back * back;
        FrameMotion {
            p_m: self.from_m + self.acceleration_m_s2 * path,
            v_m_s: self.acceleration_m_s2 * v,
            a_m_s2: self.acceleration_m_s2 * sign,
            r: self.r.into_inner(),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        2.0 * self.push_s
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![self.push_s, 2.0 * self.push_s]
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
