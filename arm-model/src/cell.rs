//! The cell: what is fixed to the arm's flange and what stands around its base.
//!
//! Planner, preflight, controller, simulated rig, renderer and viewers take these numbers
//! from here and from nowhere else. Lengths in metres, world frame.

use crate::capsules::box_distance_m;
use nalgebra::Vector3;

/// Length of the pole along the flange's +z (m).
pub const POLE_LENGTH_M: f64 = 0.20;
/// Radius of the pole (m).
pub const POLE_RADIUS_M: f64 = 0.008;
/// Height of the floor (m).
pub const FLOOR_Z_M: f64 = -0.75;
/// Half width of the square column whose top carries the arm at z = 0 (m).
pub const COLUMN_HALF_WIDTH_M: f64 = 0.09;

/// What stands around the arm: a square column under it, and the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Half width of the column, whose top is at z = 0 (m).
    pub column_half_width_m: f64,
    /// Height of the floor (m).
    pub floor_z_m: f64,
}

impl Default for Cell {
    fn default() -> Self {
        Self {
            column_half_width_m: COLUMN_HALF_WIDTH_M,
            floor_z_m: FLOOR_Z_M,
        }
    }
}

impl Cell {
    /// Distance of a point to the column (m), 0 inside.
    #[must_use]
    pub fn column_distance_m(&self, p: &Vector3<f64>) -> f64 {
        let w = self.column_half_width_m;
        let low = Vector3::new(-w, -w, self.floor_z_m);
        box_distance_m(p, &low, &Vector3::new(w, w, 0.0))
    }

    /// Whether a sphere touches column or floor.
    #[must_use]
    pub fn touches(&self, p: &Vector3<f64>, radius_m: f64) -> bool {
        p.z - radius_m < self.floor_z_m || self.column_distance_m(p) < radius_m
    }
}
