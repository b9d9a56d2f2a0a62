//! Frames that are pushed, and one that cannot be simulated.

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rope_sim::AttachMotion;

/// A frame that starts at rest and is pushed piece by piece: by a constant acceleration until
/// a time (s). After the last it coasts.
#[derive(Debug, Clone)]
pub struct Pushed {
    pub from_m: Vector3<f64>,
    pub r: Rotation3<f64>,
    pub pieces: Vec<(f64, Vector3<f64>)>,
}

impl Pushed {
    pub fn from_origin(pieces: Vec<(f64, Vector3<f64>)>) -> Self {
        Self {
            from_m: Vector3::zeros(),
            r: Rotation3::identity(),
            pieces,
        }
    }
}

impl AttachMotion for Pushed {
    fn at(&self, t_s: f64) -> FrameMotion {
        let mut motion = FrameMotion {
            p_m: self.from_m,
            r: self.r.into_inner(),
            ..FrameMotion::world()
        };
        let mut begun_s = 0.0;
        for (until_s, push) in &self.pieces {
            let h = (t_s.min(*until_s) - begun_s).max(0.0);
            motion.p_m += motion.v_m_s * h + push * (0.5 * h * h);
            motion.v_m_s += push * h;
            if t_s < *until_s {
                motion.a_m_s2 = *push;
                return motion;
            }
            begun_s = *until_s;
        }
        motion.p_m += motion.v_m_s * (t_s - begun_s);
        motion
    }

    fn acceleration_jumps_s(&self) -> Vec<f64> {
        self.pieces.iter().map(|(until_s, _)| *until_s).collect()
    }
}

/// Ends early, and is not finite from some time on: its place, or else its velocity.
pub struct Broken {
    pub ends_s: f64,
    pub nan_from_s: f64,
    pub in_place: bool,
}

impl AttachMotion for Broken {
    fn at(&self, t_s: f64) -> FrameMotion {
        let x = if t_s > self.nan_from_s { f64::NAN } else { 0.0 };
        let (p, v) = if self.in_place { (x, 0.0) } else { (0.0, x) };
        FrameMotion {
            p_m: Vector3::new(p, 0.0, 0.0),
            v_m_s: Vector3::new(v, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        self.ends_s
    }
    fn holds_after_end(&self) -> bool {
        false
    }
}
