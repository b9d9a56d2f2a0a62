//! A rope hanging still from a fixed attach frame.
//!
//! Without twist the hanging rope lies in the vertical plane through the attach
//! frame's -z axis. With `psi_i` the angle of link i from straight down, it
//! minimises `sum k/2 (psi_i - psi_{i-1})² - g s W_i cos psi_i`, where `W_i` is the
//! mass carried by link i (half of its own). Newton's method on the angles with a
//! tridiagonal, positive matrix finds it in a few iterations. For a rope with a rest
//! curvature, which leaves the plane, or a first joint of its own, see [`curved`].

mod curved;

use crate::kernel::GRAVITY_M_S2;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use shared_types::rope_state::Sway;
use shared_types::{RopeExtras, RopeParams, RopeState};

/// Most Newton steps; ten are typical.
const MAX_ITERATIONS: usize = 200;

/// Turn of gravity between two equilibria whose difference gives a sway's shape (rad).
const SWAY_STEP_RAD: f64 = 1e-4;

/// A rope that swings below an attach frame of attitude `r_attach`.
pub(crate) fn swaying_links(rope: &RopeParams, r_attach: &Matrix3<f64>, sway: &Sway) -> RopeState {
    // Gravity turned is the attach frame turned back, seen from a turned world.
    let hanging = |angle_rad: [f64; 2]| -> Vec<UnitQuaternion<f64>> {
        let [x, y] = angle_rad;
        let turn = Rotation3::from_scaled_axis(Vector3::new(x, y, 0.0));
        let links = hanging_links(rope, &(turn.matrix().transpose() * r_attach));
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        let turned = |[w, x, y, z]: [f64; 4]| {
            turn * UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
        };
        links.into_iter().map(turned).collect()
    };
    let here = hanging(sway.angle_rad);
    let mut rates = vec![Vector3::zeros(); here.len()];
    for axis in 0..2 {
        if sway.rate_rad_s[axis] == 0.0 {
            continue;
        }
        let mut beside = sway.angle_rad;
        beside[axis] += SWAY_STEP_RAD;
        for ((rate, from), to) in rates.iter_mut().zip(&here).zip(hanging(beside)) {
            let shape = (to * from.inverse()).scaled_axis() / SWAY_STEP_RAD;
            *rate += shape * sway.rate_rad_s[axis];
        }
    }
    RopeState {
        attitudes: here.iter().map(|q| [q.w, q.i, q.j, q.k]).collect(),
        rates_rad_s: rates.into_iter().map(Into::into).collect(),
        friction_nm: Vec::new(),
    }
}

/// Attitudes of the links (scalar first, link to world), hanging still from an
/// attach frame of attitude `r_attach`.
pub(crate) fn hanging_links(rope: &RopeParams, r_attach: &Matrix3<f64>) -> Vec<[f64; 4]> {
    let extras = rope.beyond();
    let weight_nm = weights_nm(rope, &extras);
    let straight = hanging_straight(rope, &weight_nm, r_attach);
    let curvature = Vector3::from(extras.rest_curvature_per_m);
    let clamped_alike = (extras.clamp_stiffness - 1.0).abs() <= 0.0;
    if curvature == Vector3::zeros() && clamped_alike {
        straight
    } else {
        curved::hanging(rope, weight_nm, r_attach, &straight)
    }
}

fn hanging_straight(
    rope: &RopeParams,
    weight_nm: &[f64],
    r_attach: &Matrix3<f64>,
) -> Vec<[f64; 4]> {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(*r_attach);
    let attach = UnitQuaternion::from_rotation_matrix(&rotation);
    let out: Vector3<f64> = -r_attach.column(2);
    let tilt_rad = out.xy().norm().atan2(-out.z);
    // Turning about `axis` by a positive angle brings the direction down; at no or
    // full tilt any horizontal axis will do.
    let axis = Vector3::new(-out.y, out.x, 0.0)
        .try_normalize(1e-12)
        .map_or(Vector3::x_axis(), nalgebra::Unit::new_unchecked);
    hanging_angles(rope, weight_nm, tilt_rad)
        .into_iter()
        .map(|psi| {
            let q = UnitQuaternion::from_axis_angle(&axis, tilt_rad - psi) * attach;
            [q.w, q.i, q.j, q.k]
        })
        .collect()
}

/// Angles of the links from straight down (rad) below an attach frame tilted by
/// `tilt_rad` from 0 to pi.
fn hanging_angles(rope: &RopeParams, weight: &[f64], tilt_rad: f64) -> Vec<f64> {
    let n = rope.links as usize;
    let k = rope.joint_stiffness_nm_per_rad;
    let mut psi = vec![0.0; n];
    let mut value = energy(&psi, tilt_rad, k, weight);
    for _ in 0..MAX_ITERATIONS {
        let direction = newton_direction(&psi, tilt_rad, k, weight);
        let largest = direction.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        if largest < 1e-13 {
            break;
        }
        let mut fraction = (1.0 / largest).min(1.0);
        loop {
            let next: Vec<f64> = psi
                .iter()
                .zip(&direction)
                .map(|(p, d)| p + fraction * d)
                .collect();
            let next_value = energy(&next, tilt_rad, k, weight);
            if next_value <= value + 1e-15 * value.abs() || fraction < 1e-6 {
                (psi, value) = (next, next_value);
                break;
            }
            fraction *= 0.5;
        }
    }
    psi
}

/// What hangs on each link, times its length (N m).
fn weights_nm(rope: &RopeParams, extras: &RopeExtras) -> Vec<f64> {
    let mut beyond_kg = rope.lead_mass_kg;
    let mut weights: Vec<f64> = (0..rope.links)
        .rev()
        .map(|link| {
            let mass_kg = rope.link_mass_kg() * extras.mass_factor(link, rope.links);
            let carried_kg = beyond_kg + 0.5 * mass_kg;
            beyond_kg += mass_kg;
            GRAVITY_M_S2 * rope.link_length_m() * carried_kg
        })
        .collect();
    weights.reverse();
    weights
}

fn energy(psi: &[f64], tilt_rad: f64, k: f64, weight: &[f64]) -> f64 {
    let mut above = tilt_rad;
    let mut sum = 0.0;
    for (p, w) in psi.iter().zip(weight) {
        sum += 0.5 * k * (p - above).powi(2) - w * p.cos();
        above = *p;
    }
    sum
}

/// Newton step with the gravity curvature kept positive, by Thomas elimination.
fn newton_direction(psi: &[f64], tilt_rad: f64, k: f64, weight: &[f64]) -> Vec<f64> {
    let n = psi.len();
    let mut upper = vec![0.0; n];
    let mut step = vec![0.0; n];
    for i in 0..n {
        let above = if i == 0 { tilt_rad } else { psi[i - 1] };
        let below = psi.get(i + 1).map_or(0.0, |next| k * (next - psi[i]));
        let descent = below - k * (psi[i] - above) - weight[i] * psi[i].sin();
        let springs = if i + 1 < n { 2.0 * k } else { k };
        let curvature = springs + weight[i] * psi[i].cos().max(0.0) + 1e-12;
        let (upper_before, step_before) = if i == 0 {
            (0.0, 0.0)
        } else {
            (upper[i - 1], step[i - 1])
        };
        let pivot = curvature + k * upper_before;
        upper[i] = -k / pivot;
        step[i] = (descent + k * step_before) / pivot;
    }
    for i in (0..n - 1).rev() {
        step[i] -= upper[i] * step[i + 1];
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rope() -> RopeParams {
        RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0])
    }

    #[test]
    fn torque_balances_at_every_joint() {
        let rope = rope();
        let tilt = 1.1;
        let extras = RopeExtras {
            mass_slope: 0.6,
            ..RopeExtras::NONE
        };
        let psi = hanging_angles(&rope, &weights_nm(&rope, &extras), tilt);
        let (s, m) = (rope.link_length_m(), rope.link_mass_kg());
        let mut above = tilt;
        for i in 0..psi.len() {
            // Moment of everything beyond joint i about it, by its lever arms.
            let mut x = 0.0;
            let mut moment = 0.0;
            for (link, p) in (0_u32..).zip(&psi).skip(i) {
                let place = (f64::from(link) + 0.5) / f64::from(rope.links);
                let m = m * (1.0 + 0.6 * (2.0 * place - 1.0));
                moment += m * GRAVITY_M_S2 * (x + 0.5 * s * p.sin());
                x += s * p.sin();
            }
            moment += rope.lead_mass_kg * GRAVITY_M_S2 * x;
            let spring = rope.joint_stiffness_nm_per_rad * (above - psi[i]);
            assert!(
                (spring - moment).abs() < 1e-10,
                "joint {i}: {spring} against {moment}"
            );
            above = psi[i];
        }
    }

    #[test]
    fn links_start_from_the_attach_frame_and_bend_down() {
        let attach = nalgebra::Rotation3::from_euler_angles(0.4, 0.7, -1.0);
        let links = hanging_links(&rope(), attach.matrix());
        let z = |q: [f64; 4]| {
            let q =
                UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
            (q * -Vector3::z()).z
        };
        let above = (attach * -Vector3::z()).z;
        assert!(z(links[0]) < above);
        for pair in links.windows(2) {
            assert!(z(pair[1]) < z(pair[0]) + 1e-12);
        }
    }

    #[test]
    fn limp_and_upward_ropes_are_solved() {
        let limp = RopeParams {
            joint_stiffness_nm_per_rad: 0.0,
            ..rope()
        };
        let angles = |rope: &RopeParams, tilt| {
            hanging_angles(rope, &weights_nm(rope, &RopeExtras::NONE), tilt)
        };
        assert!(angles(&limp, 2.0).iter().all(|p| p.abs() < 1e-9));
        for tilt in [0.0, 2.0, 3.1] {
            assert!(angles(&rope(), tilt).iter().all(|p| p.is_finite()));
        }
    }
}
