//! The attach motion at one time: position and quaternion with their first two derivatives.

use arm_model::kinematics::FrameMotion;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Position, then quaternion scalar first.
pub(crate) const CHANNELS: usize = 7;

/// Attitude of a frame as a quaternion, scalar first.
pub(crate) fn attitude(frame: &FrameMotion) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame.r))
}

/// Channels and their first two derivatives at one time.
pub(crate) struct Knot {
    pub(crate) value: [f64; CHANNELS],
    pub(crate) rate: [f64; CHANNELS],
    pub(crate) acceleration: [f64; CHANNELS],
}

impl Knot {
    /// From a frame's motion.
    pub(crate) fn new(m: &FrameMotion) -> Self {
        let q = attitude(m).into_inner();
        let w = Quaternion::from_imag(m.w_rad_s * 0.5);
        let q_rate = w * q;
        let q_acceleration = Quaternion::from_imag(m.alpha_rad_s2 * 0.5) * q + w * q_rate;
        let join = |p: &Vector3<f64>, q: &Quaternion<f64>| [p.x, p.y, p.z, q.w, q.i, q.j, q.k];
        Self {
            value: join(&m.p_m, &q),
            rate: join(&m.v_m_s, &q_rate),
            acceleration: join(&m.a_m_s2, &q_acceleration),
        }
    }

    /// Turns the quaternion's sign towards that of another knot.
    pub(crate) fn on_the_side_of(&mut self, other: &Self) {
        let dot: f64 = (3..CHANNELS).map(|c| self.value[c] * other.value[c]).sum();
        if dot < 0.0 {
            for numbers in [&mut self.value, &mut self.rate, &mut self.acceleration] {
                numbers[3..].iter_mut().for_each(|x| *x = -*x);
            }
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let sum = |numbers: &[f64; CHANNELS]| numbers.iter().sum::<f64>();
        (sum(&self.value) + sum(&self.rate) + sum(&self.acceleration)).is_finite()
    }
}
