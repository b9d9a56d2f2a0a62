//! Lamps: where the light comes from, and how much of it a place gets.

use nalgebra::Vector3;

/// Most lamps that cast shadows of moving things.
pub(crate) const LAMPS: usize = 2;

/// A round lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lamp {
    /// Its centre (m).
    pub(crate) at_m: Vector3<f64>,
    /// Its radius (m): the larger, the softer its shadows.
    pub(crate) radius_m: f64,
    /// Its light on a surface that faces it at `reach_m`, as a part of all light.
    pub(crate) power: f64,
    /// Distance at which it gives that light (m).
    pub(crate) reach_m: f64,
}

impl Lamp {
    /// Light on a surface at a place, with this normal, if nothing is between.
    pub(crate) fn light(&self, p: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        let way = self.at_m - p;
        let distance = way.norm();
        let facing = (normal.dot(&way) / distance).max(0.0);
        self.power * facing * (self.reach_m / distance).powi(2).min(1.4)
    }

    /// A place on its disc as seen from `p`, for two numbers from 0 to 1.
    pub(crate) fn place(&self, p: &Vector3<f64>, [a, b]: [f64; 2]) -> Vector3<f64> {
        let ahead = (self.at_m - p).normalize();
        let right = ahead.cross(&Vector3::new(0.31, 0.17, 0.93)).normalize();
        let up = right.cross(&ahead);
        let (sin, cos) = (a * core::f64::consts::TAU).sin_cos();
        self.at_m + (right * cos + up * sin) * (self.radius_m * b.sqrt())
    }
}

/// A level of the camera at which bright things begin to lose their differences.
const SHOULDER: f64 = 150.0;

/// What the camera makes of a bright level: it never quite reaches 255.
pub(crate) fn shoulder(level: f64) -> f64 {
    let above = level - SHOULDER;
    let room = 258.0 - SHOULDER;
    if above <= 0.0 {
        level
    } else {
        SHOULDER + room * (1.0 - (-above / room).exp())
    }
}

/// A level of the camera for so much light: the inverse of the display's curve.
pub(crate) fn level(light: f64) -> f64 {
    light.max(0.0).powf(1.0 / 2.2)
}
