//! Contact of the rope with arm, pole and the column under the arm.

use arm_model::capsules::arm_at;
use arm_model::cell::CLAMPED_M;
use arm_model::{Cell, JointVector};
use nalgebra::Vector3;

/// Whether a rope touches arm, pole or column at the joint angles `q` (rad). `nodes` are
/// world positions (m), clamp first, lead last; middles of links are looked at as well. The
/// first 5 cm lie against the pole by construction and do not count.
pub(crate) fn touches(
    nodes: &[Vector3<f64>],
    [rope_radius_m, lead_radius_m]: [f64; 2],
    q: &JointVector,
    cell: &Cell,
) -> bool {
    let (links, pole) = arm_at(q, &cell.pole);
    let hits = |p: &Vector3<f64>, radius_m: f64| {
        links
            .iter()
            .any(|(_, c)| c.distance_to_point_m(p) < radius_m)
            || pole.distance_to_point_m(p) < radius_m
            || cell.column_distance_m(p) < radius_m
    };
    let mut arc_m = 0.0;
    let last = nodes.len().saturating_sub(1);
    nodes.windows(2).enumerate().any(|(i, link)| {
        let middle = (link[0] + link[1]) / 2.0;
        let length_m = (link[1] - link[0]).norm();
        arc_m += length_m;
        let end_radius_m = if i + 1 == last {
            lead_radius_m
        } else {
            rope_radius_m
        };
        (arc_m - length_m / 2.0 > CLAMPED_M && hits(&middle, rope_radius_m))
            || (arc_m > CLAMPED_M && hits(&link[1], end_radius_m))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    fn straight(from: Vector3<f64>, to: Vector3<f64>) -> Vec<Vector3<f64>> {
        (0..=20)
            .map(|i| from + (to - from) * f64::from(i) / 20.0)
            .collect()
    }

    #[test]
    fn a_hanging_rope_is_free_and_one_through_the_column_is_not() {
        let cell = Cell::default();
        let touches = |nodes: &[_], radii_m| touches(nodes, radii_m, &START_POSE, &cell);
        let (links, pole) = arm_at(&START_POSE, &cell.pole);
        let (clamp, _) = cell.pole.attach_pose(&START_POSE);
        assert!((pole.b_m - clamp).norm() < 1e-12);
        let hanging = straight(clamp, clamp - Vector3::z() * 0.65);
        assert!(!touches(&hanging, [0.01, 0.045]));
        let at_column = straight(clamp, Vector3::new(0.09 + 0.044, 0.0, -0.1));
        assert!(touches(&at_column, [0.01, 0.045]));
        let beside = straight(clamp, Vector3::new(0.09 + 0.046, 0.0, -0.1));
        assert!(!touches(&beside, [0.003, 0.045]));
        let up_at_link_4 = straight(clamp, links[5].1.a_m);
        assert!(touches(&up_at_link_4, [0.003, 0.02]));
    }
}
