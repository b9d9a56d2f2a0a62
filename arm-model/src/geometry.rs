//! Capsules and boxes, and the distances between segments, points and boxes.

use nalgebra::Vector3;

/// All points within `radius_m` of the segment from `a_m` to `b_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the axis (m).
    pub a_m: Vector3<f64>,
    /// Other end of the axis (m).
    pub b_m: Vector3<f64>,
    /// Radius (m).
    pub radius_m: f64,
}

impl Capsule {
    /// Distance from a point to the surface, negative inside (m).
    #[must_use]
    pub fn distance_to_point_m(&self, p: &Vector3<f64>) -> f64 {
        let axis = self.b_m - self.a_m;
        let t = (p - self.a_m).dot(&axis) / axis.norm_squared().max(1e-18);
        (p - self.a_m - axis * t.clamp(0.0, 1.0)).norm() - self.radius_m
    }

    /// Distance between two surfaces, negative when they overlap (m).
    #[must_use]
    pub fn distance_to_m(&self, other: &Self) -> f64 {
        segment_distance_m(&self.a_m, &self.b_m, &other.a_m, &other.b_m)
            - self.radius_m
            - other.radius_m
    }

    /// Whether the axis-aligned box around this capsule, grown by `margin_m`,
    /// meets the box from `low` to `high`.
    #[must_use]
    pub fn near_box(&self, low: &Vector3<f64>, high: &Vector3<f64>, margin_m: f64) -> bool {
        let grow = self.radius_m + margin_m;
        (0..3).all(|i| {
            self.a_m[i].min(self.b_m[i]) - grow <= high[i]
                && self.a_m[i].max(self.b_m[i]) + grow >= low[i]
        })
    }
}

/// Smallest distance between segments `p0 p1` and `q0 q1` (m). After C. Ericson,
/// "Real-Time Collision Detection", section 5.1.9.
fn segment_distance_m(
    p0: &Vector3<f64>,
    p1: &Vector3<f64>,
    q0: &Vector3<f64>,
    q1: &Vector3<f64>,
) -> f64 {
    let (d1, d2, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (b, c) = (d1.dot(&d2), d1.dot(&r));
    let (a, e) = (a.max(1e-18), e.max(1e-18));
    let det = a * e - b * b;
    let s = if det > 1e-12 * a * e {
        ((b * f - c * e) / det).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = (b * s + f) / e;
    let (s, t) = if t < 0.0 {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (((b - c) / a).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    };
    (r + d1 * s - d2 * t).norm()
}

/// Distance from a point to an axis-aligned box, 0 inside (m).
#[must_use]
pub fn box_distance_m(p: &Vector3<f64>, low: &Vector3<f64>, high: &Vector3<f64>) -> f64 {
    Vector3::from_fn(|i, _| (low[i] - p[i]).max(p[i] - high[i]).max(0.0)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0f64..1.0).prop_map(Vector3::from)
    }

    proptest! {
        /// Against the smallest distance over a fine grid of both segments.
        #[test]
        fn segment_distance_is_the_grid_minimum(
            p0 in point(), p1 in point(), q0 in point(), q1 in point()
        ) {
            let exact = segment_distance_m(&p0, &p1, &q0, &q1);
            let mut grid = f64::INFINITY;
            for i in 0..=60 {
                for k in 0..=60 {
                    let (s, t) = (f64::from(i) / 60.0, f64::from(k) / 60.0);
                    grid = grid.min((p0.lerp(&p1, s) - q0.lerp(&q1, t)).norm());
                }
            }
            prop_assert!(exact <= grid + 1e-12 && exact > grid - 0.05);
        }
    }

    #[test]
    fn distances_to_points_and_boxes() {
        let c = Capsule {
            a_m: Vector3::zeros(),
            b_m: Vector3::new(1.0, 0.0, 0.0),
            radius_m: 0.1,
        };
        let at = |x, y| c.distance_to_point_m(&Vector3::new(x, y, 0.0));
        assert!((at(0.5, 0.3) - 0.2).abs() < 1e-12 && (at(1.3, 0.4) - 0.4).abs() < 1e-12);
        assert!(at(0.2, 0.05) < 0.0);
        let (low, high) = (Vector3::repeat(-1.0), Vector3::repeat(1.0));
        assert_eq!(
            box_distance_m(&Vector3::new(0.5, -0.2, 0.9), &low, &high),
            0.0
        );
        assert!((box_distance_m(&Vector3::new(4.0, 5.0, 0.0), &low, &high) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn crossing_parallel_and_end_to_end_segments() {
        let v = Vector3::new;
        let (a, b) = (v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0));
        let cases = [
            (v(0.0, -1.0, 0.5), v(0.0, 1.0, 0.5), 0.5),
            (v(-1.0, 0.0, 2.0), v(1.0, 0.0, 2.0), 2.0),
            (v(3.0, 0.0, 0.0), v(5.0, 0.0, 0.0), 2.0),
        ];
        for (p, q, want) in cases {
            assert!((segment_distance_m(&a, &b, &p, &q) - want).abs() < 1e-12);
        }
    }
}
