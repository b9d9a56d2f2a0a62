//! The cell: what is fixed to the arm's flange and what stands around its base.
//!
//! Planner, preflight, simulated arm, renderer, tracker, recorder and viewers are handed
//! the same [`Cell`], read from a file under `configs/cell/`. Lengths in metres, world
//! frame.

use crate::checked_length::{below_zero, length, place};
use crate::geometry::box_distance_m;
use crate::joint::{JointState, JointVector};
use crate::kinematics::{FrameMotion, flange_motion, flange_pose};
use crate::task_bodies::{Board, StandingDomino, Wall};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Part of the rope, measured from the clamp, that lies against the pole's end by
/// construction (m): it touches nothing.
pub const CLAMPED_M: f64 = 0.05;

/// The pole on the flange, along the flange's +z. The rope's first joint sits at its end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pole {
    /// From its foot to its end (m).
    #[serde(deserialize_with = "length")]
    pub length_m: f64,
    /// Its radius (m).
    #[serde(deserialize_with = "length")]
    pub radius_m: f64,
    /// Its foot in the flange frame (m).
    #[serde(deserialize_with = "place")]
    pub offset_m: [f64; 3],
}

/// What stands around the arm, and what it carries.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Height of the floor (m).
    #[serde(deserialize_with = "below_zero")]
    pub floor_z_m: f64,
    /// Half width of the square column whose top carries the arm at z = 0 (m).
    #[serde(deserialize_with = "length")]
    pub column_half_width_m: f64,
    /// The pole on the flange.
    pub pole: Pole,
    /// What a lob is thrown at.
    #[cfg_attr(feature = "std", serde(default = "lab::board"))]
    pub board: Board,
    /// What stands on it.
    #[cfg_attr(feature = "std", serde(default = "lab::domino"))]
    pub domino: StandingDomino,
    /// What a rope is draped over.
    #[cfg_attr(feature = "std", serde(default = "lab::wall"))]
    pub wall: Wall,
}

/// Bodies of a cell whose file is older than they are, or does without.
#[cfg(feature = "std")]
mod lab {
    use super::{Board, Cell, StandingDomino, Wall};

    pub(super) fn board() -> Board {
        Cell::default().board
    }

    pub(super) fn domino() -> StandingDomino {
        Cell::default().domino
    }

    pub(super) fn wall() -> Wall {
        Cell::default().wall
    }
}

#[cfg(feature = "std")]
impl Default for Cell {
    /// The cell of `configs/cell/lab.toml`.
    fn default() -> Self {
        #[allow(clippy::expect_used, reason = "a file of this crate's own sources")]
        static LAB: std::sync::LazyLock<Cell> = std::sync::LazyLock::new(|| {
            toml::from_str(include_str!("../../configs/cell/lab.toml"))
                .expect("configs/cell/lab.toml is a cell")
        });
        *LAB
    }
}

#[cfg(feature = "std")]
impl Default for Pole {
    /// The pole of `configs/cell/lab.toml`.
    fn default() -> Self {
        Cell::default().pole
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

impl Pole {
    /// Its end in the flange frame (m).
    #[must_use]
    pub fn end_m(&self) -> Vector3<f64> {
        let [x, y, z] = self.offset_m;
        Vector3::new(x, y, z + self.length_m)
    }

    /// Motion of the rope's attach frame A at the pole's end: x as the flange's, -z
    /// along the pole (`R_A = R_flange diag(1, -1, -1)`). RT-safe.
    #[must_use]
    pub fn attach_motion(&self, state: &JointState) -> FrameMotion {
        let end = flange_motion(state).at_offset(&self.end_m());
        FrameMotion {
            r: flip_yz(&end.r),
            ..end
        }
    }

    /// Pose of the attach frame A as (origin in m, attitude). RT-safe.
    #[must_use]
    pub fn attach_pose(&self, q: &JointVector) -> (Vector3<f64>, Matrix3<f64>) {
        let (p, r) = flange_pose(q);
        (p + r * self.end_m(), flip_yz(&r))
    }
}

fn flip_yz(r: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[r.column(0).into(), -r.column(1), -r.column(2)])
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    const TEXT: &str = include_str!("../../configs/cell/lab.toml");

    #[test]
    fn a_cell_survives_a_file_and_nonsense_is_refused_by_key() {
        let lab = Cell::default();
        let back: Cell = toml::from_str(&toml::to_string(&lab).unwrap()).unwrap();
        assert_eq!(back, lab);
        for (from, to, says) in [
            ("floor_z_m = -0.75", "floor_z_m = 0.75", "below 0"),
            ("length_m = 0.20", "length_m = 0.0", "above 0"),
            ("radius_m = 0.008", "radius_m = nan", "above 0"),
            ("offset_m = [0.0,", "offset_m = [inf,", "beyond 10 m"),
            ("floor_z_m", "flor_z_m", "flor_z_m"),
        ] {
            let refusal = toml::from_str::<Cell>(&TEXT.replace(from, to)).unwrap_err();
            assert!(refusal.to_string().contains(says), "{to}: {refusal}");
        }
    }

    #[test]
    fn pole_points_straight_down_in_the_wiggle_pose() {
        let q = JointVector([0.0, 0.8, 0.0, 2.4, 0.0, 1.6, 0.0]);
        let (p, r) = Pole::default().attach_pose(&q);
        assert!((p - Vector3::new(0.663, 0.0, 0.224)).norm() < 1e-3, "{p}");
        assert!((r.column(2) - Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn the_rope_hangs_from_the_end_of_whatever_pole_there_is() {
        let q = JointVector([0.3, 0.5, -0.2, 1.9, 0.4, 1.2, 0.1]);
        let lab = Pole::default();
        let other = Pole {
            length_m: 0.30,
            offset_m: [0.01, 0.0, 0.02],
            ..lab
        };
        let (_, flange) = flange_pose(&q);
        let moved = other.attach_pose(&q).0 - lab.attach_pose(&q).0;
        assert!((flange.transpose() * moved - Vector3::new(0.01, 0.0, 0.12)).norm() < 1e-12);
        let still = other.attach_motion(&JointState::at_rest(q));
        assert_eq!((still.p_m, still.r), other.attach_pose(&q));
    }

    /// Velocities and accelerations against central differences of the pose.
    #[test]
    fn derivatives_match_differences() {
        let at = |t: f64| {
            let w = |i: usize| 1.0 + 0.3 * i as f64;
            let vector = |f: &dyn Fn(usize) -> f64| JointVector(core::array::from_fn(f));
            Pole::default().attach_motion(&JointState {
                q: vector(&|i| 0.3 * (i as f64) + 0.4 * (t * w(i)).sin()),
                qd: vector(&|i| 0.4 * w(i) * (t * w(i)).cos()),
                qdd: vector(&|i| -0.4 * w(i) * w(i) * (t * w(i)).sin()),
            })
        };
        let h = 1e-4;
        let (m, o, p) = (at(0.7 - h), at(0.7), at(0.7 + h));
        assert!(((p.p_m - m.p_m) / (2.0 * h) - o.v_m_s).norm() < 1e-6);
        assert!(((p.v_m_s - m.v_m_s) / (2.0 * h) - o.a_m_s2).norm() < 1e-5);
        assert!(((p.w_rad_s - m.w_rad_s) / (2.0 * h) - o.alpha_rad_s2).norm() < 1e-5);
        let skew = (p.r - m.r) / (2.0 * h) * o.r.transpose();
        let w = Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
        assert!((w - o.w_rad_s).norm() < 1e-6);
    }
}
