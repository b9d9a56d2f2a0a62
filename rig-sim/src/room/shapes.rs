//! What stands still in a room: boxes and upright cylinders.

use super::paint::Paint;
use nalgebra::Vector3;

/// A still thing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Thing {
    pub(crate) shape: Shape,
    pub(crate) paint: Paint,
}

/// Shapes of still things.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// Between two corners (m).
    Box {
        low_m: Vector3<f64>,
        high_m: Vector3<f64>,
    },
    /// An upright cylinder: the middle of its foot, its radius and height (m).
    Cylinder {
        foot_m: Vector3<f64>,
        radius_m: f64,
        height_m: f64,
    },
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Lengths of the ray's direction up to there.
    pub(crate) t: f64,
    /// Outward normal.
    pub(crate) normal: Vector3<f64>,
    /// Place on the surface (m, to the right and up).
    pub(crate) place: [f64; 2],
}

impl Shape {
    /// Where a ray enters.
    pub(crate) fn hit(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
        match self {
            Self::Box { low_m, high_m } => hit_box(low_m, high_m, origin, ray),
            Self::Cylinder {
                foot_m,
                radius_m,
                height_m,
            } => hit_cylinder(foot_m, [*radius_m, *height_m], origin, ray),
        }
    }
}

fn hit_box(
    low: &Vector3<f64>,
    high: &Vector3<f64>,
    origin: &Vector3<f64>,
    ray: &Vector3<f64>,
) -> Option<Hit> {
    let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for i in 0..3 {
        let a = (low[i] - origin[i]) / ray[i];
        let b = (high[i] - origin[i]) / ray[i];
        if a.min(b) > enter {
            (enter, axis) = (a.min(b), i);
        }
        leave = leave.min(a.max(b));
    }
    if !(enter > 0.0 && enter < leave) {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[axis] = -ray[axis].signum();
    let p = origin + ray * enter - low;
    let place = match axis {
        0 => [p.y, p.z],
        1 => [p.x, p.z],
        _ => [p.x, p.y],
    };
    Some(Hit {
        t: enter,
        normal,
        place,
    })
}

fn hit_cylinder(
    foot: &Vector3<f64>,
    [radius, height]: [f64; 2],
    origin: &Vector3<f64>,
    ray: &Vector3<f64>,
) -> Option<Hit> {
    let (o, d) = ((origin - foot).xy(), ray.xy());
    let (a, b, c) = (d.dot(&d), o.dot(&d), o.dot(&o) - radius * radius);
    let root = b * b - a * c;
    if root <= 0.0 {
        return None;
    }
    let side = (-b - root.sqrt()) / a;
    let z = origin.z - foot.z + ray.z * side;
    if side > 0.0 && (0.0..=height).contains(&z) {
        let at = o + d * side;
        let normal = Vector3::new(at.x / radius, at.y / radius, 0.0);
        let place = [at.x.atan2(-at.y) * radius, z];
        return Some(Hit {
            t: side,
            normal,
            place,
        });
    }
    // The lid.
    let lid = (foot.z + height - origin.z) / ray.z;
    let at = o + d * lid;
    (lid > 0.0 && ray.z < 0.0 && at.norm() < radius).then(|| Hit {
        t: lid,
        normal: Vector3::z(),
        place: [at.x, at.y],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_boxes_and_cylinders_where_they_stand() {
        let from = Vector3::new(0.0, -1.0, 0.0);
        let ahead = Vector3::new(0.0, 2.0, 0.0);
        let cube = Shape::Box {
            low_m: Vector3::new(-0.1, 0.2, -0.1),
            high_m: Vector3::new(0.1, 0.4, 0.1),
        };
        let hit = cube.hit(&from, &ahead).unwrap();
        assert!((hit.t - 0.6).abs() < 1e-12);
        assert_eq!(hit.normal, -Vector3::y());
        let bin = Shape::Cylinder {
            foot_m: Vector3::new(0.0, 0.5, -0.2),
            radius_m: 0.1,
            height_m: 0.5,
        };
        let hit = bin.hit(&from, &ahead).unwrap();
        assert!((hit.t - 0.7).abs() < 1e-12 && (hit.normal + Vector3::y()).norm() < 1e-12);
        assert!(bin.hit(&(from + Vector3::z()), &ahead).is_none());
    }
}
