//! A hanging rope with a rest curvature: the least of `sum k/2 |theta_i|² + W_i d_i.z`
//! over the links' attitudes, with `theta_i` the turn of link i against the one before
//! beyond its rest turn, `d_i` its direction and `W_i` the weight it carries times its
//! length.
//!
//! Newton's method on small turns of all links in the world frame. Their gradient,
//! `k (theta_i - theta_{i+1}) + W_i d_i x z`, is exact; in their Hessian the springs are
//! those of small angles, and gravity's part is kept positive: block tridiagonal with
//! scalar couplings.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Most steps; thirty are typical.
const MAX_ITERATIONS: usize = 500;
/// Torque out of balance that is none, as part of the largest at the start.
const BALANCED_PART: f64 = 1e-12;
/// Largest turn of one step (rad).
const MAX_TURN_RAD: f64 = 0.5;

struct Chain {
    stiffness_nm: f64,
    /// Of the first joint beyond the others' (N m/rad).
    clamp_nm: f64,
    weight_nm: Vec<f64>,
    attach: UnitQuaternion<f64>,
    rest_turn: UnitQuaternion<f64>,
}

/// Attitudes of the links (scalar first), found from those in `start`.
pub(super) fn hanging(
    rope: &RopeParams,
    weight_nm: Vec<f64>,
    r_attach: &Matrix3<f64>,
    start: &[[f64; 4]],
) -> Vec<[f64; 4]> {
    let rotation = Rotation3::from_matrix_unchecked(*r_attach);
    let extras = rope.beyond();
    let curvature_per_m = Vector3::from(extras.rest_curvature_per_m);
    let chain = Chain {
        stiffness_nm: rope.joint_stiffness_nm_per_rad,
        clamp_nm: rope.joint_stiffness_nm_per_rad * (extras.clamp_stiffness - 1.0),
        weight_nm,
        attach: UnitQuaternion::from_rotation_matrix(&rotation),
        rest_turn: UnitQuaternion::from_scaled_axis(curvature_per_m * rope.link_length_m()),
    };
    let mut links: Vec<UnitQuaternion<f64>> = start
        .iter()
        .map(|[w, x, y, z]| UnitQuaternion::new_unchecked(Quaternion::new(*w, *x, *y, *z)))
        .collect();
    let mut gradient = chain.gradient(&links);
    let mut energy = chain.energy(&links);
    let balanced = BALANCED_PART * largest(&gradient);
    for _ in 0..MAX_ITERATIONS {
        if largest(&gradient) <= balanced {
            break;
        }
        let turns = chain.newton_turns(&links, &gradient);
        // Rounding is all that is left: a start that was the solution.
        if largest(&turns) < 1e-13 {
            break;
        }
        let mut part = (MAX_TURN_RAD / largest(&turns)).min(1.0);
        let next = loop {
            let next = turned(&links, &turns, part);
            // Close to the end rounding hides what is gained.
            if chain.energy(&next) <= energy + 1e-14 * energy.abs() || part < 1e-6 {
                break next;
            }
            part *= 0.5;
        };
        links = next;
        energy = chain.energy(&links);
        gradient = chain.gradient(&links);
    }
    links.iter().map(|q| [q.w, q.i, q.j, q.k]).collect()
}

fn largest(vectors: &[Vector3<f64>]) -> f64 {
    vectors.iter().fold(0.0, |m, v| m.max(v.norm()))
}

fn turned(
    links: &[UnitQuaternion<f64>],
    turns: &[Vector3<f64>],
    part: f64,
) -> Vec<UnitQuaternion<f64>> {
    let pairs = links.iter().zip(turns);
    pairs
        .map(|(q, turn)| UnitQuaternion::from_scaled_axis(turn * part) * q)
        .collect()
}

impl Chain {
    /// Turn of every link against the one before, beyond its rest turn (rad, world).
    fn strains(&self, links: &[UnitQuaternion<f64>]) -> Vec<Vector3<f64>> {
        let mut before = self.attach;
        let mut strains = Vec::with_capacity(links.len());
        for q in links {
            strains.push((q * (before * self.rest_turn).inverse()).scaled_axis());
            before = *q;
        }
        strains
    }

    fn energy(&self, links: &[UnitQuaternion<f64>]) -> f64 {
        let strains = self.strains(links);
        let springs: f64 = strains.iter().map(Vector3::norm_squared).sum();
        let clamp = strains.first().map_or(0.0, Vector3::norm_squared);
        let heights = links.iter().zip(&self.weight_nm);
        let height: f64 = heights.map(|(q, w)| w * down(q).z).sum();
        0.5 * (self.stiffness_nm * springs + self.clamp_nm * clamp) + height
    }

    /// Torque that would have to hold every link (N m).
    fn gradient(&self, links: &[UnitQuaternion<f64>]) -> Vec<Vector3<f64>> {
        let strains = self.strains(links);
        let count = links.len();
        (0..count)
            .map(|i| {
                let beyond = strains.get(i + 1).copied().unwrap_or_default();
                let gravity = down(&links[i]).cross(&Vector3::z()) * self.weight_nm[i];
                let clamp = strains[i] * if i == 0 { self.clamp_nm } else { 0.0 };
                (strains[i] - beyond) * self.stiffness_nm + clamp + gravity
            })
            .collect()
    }

    /// Newton's turns, by block elimination from the attach point on and back.
    fn newton_turns(
        &self,
        links: &[UnitQuaternion<f64>],
        gradient: &[Vector3<f64>],
    ) -> Vec<Vector3<f64>> {
        let k = self.stiffness_nm;
        let count = links.len();
        let mut inverses: Vec<Matrix3<f64>> = Vec::with_capacity(count);
        let mut turns: Vec<Vector3<f64>> = Vec::with_capacity(count);
        for i in 0..count {
            let d = down(&links[i]);
            let clamp = if i == 0 { self.clamp_nm } else { 0.0 };
            let springs = clamp + if i + 1 < count { 2.0 * k } else { k };
            let swing = Matrix3::identity() - d * d.transpose();
            let mut block = Matrix3::identity() * (springs + 1e-12)
                + swing * (self.weight_nm[i] * (-d.z).max(0.0));
            let mut right = -gradient[i];
            if let (Some(inverse), Some(turn)) = (inverses.last(), turns.last()) {
                block -= inverse * (k * k);
                right += turn * k;
            }
            let inverse = block.try_inverse().unwrap_or_else(Matrix3::identity);
            turns.push(inverse * right);
            inverses.push(inverse);
        }
        for i in (0..count.saturating_sub(1)).rev() {
            let beyond = turns[i + 1];
            turns[i] += inverses[i] * beyond * k;
        }
        turns
    }
}

/// Direction of a link from its nearer node.
fn down(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    q * -Vector3::z()
}

#[cfg(test)]
mod tests {
    use super::super::{hanging_links, hanging_straight, weights_nm};
    use super::*;
    use shared_types::RopeExtras;

    #[test]
    fn no_curvature_is_the_plane_curve() {
        let rope = RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0]);
        let attach = Rotation3::from_euler_angles(0.4, 0.7, -1.0).into_inner();
        let weight_nm = weights_nm(&rope, &RopeExtras::NONE);
        let straight = hanging_straight(&rope, &weight_nm, &attach);
        let extras = RopeExtras {
            rest_curvature_per_m: [1e-12, 0.0, 0.0],
            ..RopeExtras::NONE
        };
        let almost = hanging_links(&rope.with_extras(extras), &attach);
        for (a, b) in straight.iter().zip(&almost) {
            let same: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            assert!(same.abs() > 1.0 - 1e-12);
        }
    }
}
