//! Random three-dimensional flings of an attach frame on a lever.

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rope_sim::AttachMotion;

/// Distance of the attach point from the fixed point it turns about (m).
const LEVER_M: f64 = 0.45;
/// Time between knots (s).
const KNOT_S: f64 = 0.135;
/// Inner control points lie within this of zero (rad).
const REACH_RAD: f64 = 1.05;
/// Control points of a channel; the first and the last three are equal, so that the
/// motion starts and stops without speed and acceleration.
const CONTROL: usize = 11;

/// Roll, pitch and yaw along uniform cubic B-splines about a fixed point, 0.45 m from
/// the attach point, for 1.08 s; then still.
pub struct Fling {
    /// Control points of roll, pitch and yaw (rad).
    control: [[f64; CONTROL]; 3],
}

impl Fling {
    /// The next random fling.
    pub fn random(random: &mut ChaCha8Rng) -> Self {
        let control = core::array::from_fn(|_| {
            let mut points = [0.0; CONTROL];
            for point in &mut points[3..9] {
                *point = random.random_range(-REACH_RAD..REACH_RAD);
            }
            let end = points[8];
            points[9..].fill(end);
            points
        });
        Self { control }
    }

    /// Value, rate and acceleration of one angle.
    fn angle(&self, channel: usize, t_s: f64) -> [f64; 3] {
        let x = (t_s / KNOT_S).clamp(0.0, (CONTROL - 3) as f64 - 1e-12);
        let u = x.fract();
        let v = 1.0 - u;
        let points = &self.control[channel][x as usize..][..4];
        let sum = |weights: [f64; 4]| -> f64 {
            points.iter().zip(weights).map(|(p, w)| p * w).sum::<f64>() / 6.0
        };
        let (u2, v2) = (u * u, v * v);
        [
            sum([
                v2 * v,
                3.0 * u2 * u - 6.0 * u2 + 4.0,
                3.0 * v2 * v - 6.0 * v2 + 4.0,
                u2 * u,
            ]),
            sum([
                -3.0 * v2,
                9.0 * u2 - 12.0 * u,
                12.0 * v - 9.0 * v2,
                3.0 * u2,
            ]) / KNOT_S,
            sum([6.0 * v, 18.0 * u - 12.0, 18.0 * v - 12.0, 6.0 * u]) / (KNOT_S * KNOT_S),
        ]
    }
}

impl AttachMotion for Fling {
    /// `R = Rz(yaw) Ry(pitch) Rx(roll)`, attach point at `R (0, 0, -lever)`.
    fn at(&self, t_s: f64) -> FrameMotion {
        let [roll, pitch, yaw] = [0, 1, 2].map(|channel| self.angle(channel, t_s));
        let rz = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw[0]);
        let ry = Rotation3::from_axis_angle(&Vector3::y_axis(), pitch[0]);
        let rx = Rotation3::from_axis_angle(&Vector3::x_axis(), roll[0]);
        // Axes of the three turns, each carried by the ones before.
        let (yaw_axis, pitch_axis) = (Vector3::z(), rz * Vector3::y());
        let r = rz * ry * rx;
        let roll_axis = rz * ry * Vector3::x();
        let w_yaw = yaw_axis * yaw[1];
        let w_pitch = w_yaw + pitch_axis * pitch[1];
        let w = w_pitch + roll_axis * roll[1];
        let alpha = yaw_axis * yaw[2]
            + pitch_axis * pitch[2]
            + w_yaw.cross(&pitch_axis) * pitch[1]
            + roll_axis * roll[2]
            + w_pitch.cross(&roll_axis) * roll[1];
        let p_m = r * Vector3::new(0.0, 0.0, -LEVER_M);
        let v_m_s = w.cross(&p_m);
        FrameMotion {
            p_m,
            r: r.into_inner(),
            v_m_s,
            w_rad_s: w,
            a_m_s2: alpha.cross(&p_m) + w.cross(&v_m_s),
            alpha_rad_s2: alpha,
        }
    }
}
