//! Motions of the attach frame: it stands, then goes in steps that begin and end softly.

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rope_sim::AttachMotion;
use serde::Serialize;

/// One step: from here to there without a jump of velocity or acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(in crate::results) struct Ramp {
    pub from_s: f64,
    pub to_s: f64,
    pub by_m: [f64; 3],
    /// Turn about the world's y axis; a negative one swings the rope's end towards x (rad).
    pub turn_rad: f64,
}

impl Ramp {
    pub const fn new([from_s, to_s]: [f64; 2], by_m: [f64; 3], turn_rad: f64) -> Self {
        Self {
            from_s,
            to_s,
            by_m,
            turn_rad,
        }
    }

    /// Part done, its rate (1/s) and the rate of that (1/s²): the polynomial of degree five
    /// that is flat at both ends.
    fn part(&self, t_s: f64) -> [f64; 3] {
        let length_s = self.to_s - self.from_s;
        let u = ((t_s - self.from_s) / length_s).clamp(0.0, 1.0);
        [
            u.powi(3) * (10.0 + u * (6.0 * u - 15.0)),
            30.0 * (u * (1.0 - u)).powi(2) / length_s,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (length_s * length_s),
        ]
    }
}

/// The steps, one after the other or at once, of a frame that is upright at the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(in crate::results) struct Ramps {
    pub start_m: [f64; 3],
    pub ramps: Vec<Ramp>,
}

impl AttachMotion for Ramps {
    fn at(&self, t_s: f64) -> FrameMotion {
        let mut motion = FrameMotion {
            p_m: self.start_m.into(),
            ..FrameMotion::world()
        };
        let mut angle_rad = 0.0;
        for ramp in &self.ramps {
            let [part, rate, rate2] = ramp.part(t_s);
            let by = Vector3::from(ramp.by_m);
            motion.p_m += by * part;
            motion.v_m_s += by * rate;
            motion.a_m_s2 += by * rate2;
            angle_rad += ramp.turn_rad * part;
            motion.w_rad_s.y += ramp.turn_rad * rate;
            motion.alpha_rad_s2.y += ramp.turn_rad * rate2;
        }
        motion.r = Rotation3::from_axis_angle(&Vector3::y_axis(), angle_rad).into_inner();
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_and_accelerations_are_those_of_the_pose() {
        let motion = Ramps {
            start_m: [0.1, 0.2, 0.3],
            ramps: vec![
                Ramp::new([0.1, 0.6], [0.4, 0.0, -0.1], -1.0),
                Ramp::new([0.4, 0.9], [0.0, 0.2, -0.3], 0.4),
            ],
        };
        let h_s = 1e-5;
        for i in 1..100 {
            // Beside the ends of the steps, where the acceleration has a kink.
            let t_s = 0.01 * f64::from(i) + 0.003;
            let [before, now, after] = [t_s - h_s, t_s, t_s + h_s].map(|t_s| motion.at(t_s));
            let v_m_s = (after.p_m - before.p_m) / (2.0 * h_s);
            assert!((v_m_s - now.v_m_s).norm() < 1e-6, "{t_s}");
            let a_m_s2 = (after.v_m_s - before.v_m_s) / (2.0 * h_s);
            assert!((a_m_s2 - now.a_m_s2).norm() < 1e-5, "{t_s}");
            let turn = after.r * before.r.transpose();
            let about_y_rad = 0.5 * (turn[(0, 2)] - turn[(2, 0)]);
            let w_rad_s = Vector3::y() * (about_y_rad / (2.0 * h_s));
            assert!((w_rad_s - now.w_rad_s).norm() < 1e-6, "{t_s}");
            let alpha_rad_s2 = (after.w_rad_s - before.w_rad_s) / (2.0 * h_s);
            assert!((alpha_rad_s2 - now.alpha_rad_s2).norm() < 1e-4, "{t_s}");
        }
    }
}
