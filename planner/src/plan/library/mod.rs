//! Throws simulated ahead.
//!
//! A throw is kept with its rope and with the whole path of the tip, so that one simulation
//! answers for every target on that path. For a rope and a target, the throws whose tips
//! passed near that target, of ropes like that one, are simulated again with the rope itself,
//! and the best of them polished; a search begins only where none is good enough.

mod make;
mod recall;
#[cfg(test)]
mod tests;

pub use make::LibraryOptions;

use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use std::sync::OnceLock;

use super::waypoints::WAYPOINTS;

/// Joints that move in the plane of a throw.
const PLANAR: usize = 3;

/// What a rope of other parameters counts like, as a distance of the tip, per range of a
/// parameter (m). The length moves the tip by about itself; the others are rough, for the
/// throws that are chosen by them are simulated again with the rope itself.
const SHIFT_PER_RANGE_M: [f64; ROPE_PARAMETERS] = [0.0, 0.2, 0.05, 0.05, 0.0, 0.05, 0.05, 0.0, 0.0];

/// The library that comes with this version (`configs/models/README.md`).
const EMBEDDED: &[u8] = include_bytes!("../../../../configs/models/throws.bin");

/// One throw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct StoredThrow {
    /// Parameters of the rope, order of [`RANGES`].
    rope: [f32; ROPE_PARAMETERS],
    /// Joints 2, 4 and 6 at each waypoint (rad).
    waypoints_rad: [[f32; PLANAR]; WAYPOINTS],
    /// The tip from the start on, every [`ThrowLibrary::period_s`]: distance from the base
    /// axis and height (mm).
    tip_mm: Vec<[i16; 2]>,
}

/// Throws simulated ahead, for the default times of a strike's waypoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThrowLibrary {
    /// Version of the program that made it.
    version: String,
    /// Size of the work and its seed.
    options: LibraryOptions,
    /// Times of the waypoints (s).
    times_s: [f64; WAYPOINTS],
    /// Time between two places of a tip (s).
    period_s: f64,
    throws: Vec<StoredThrow>,
}

/// Why a library cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not a library of throws: {0}")]
pub struct LibraryError(postcard::Error);

impl ThrowLibrary {
    /// The library that comes with this version; `None` if it cannot be read, which a test rules
    /// out.
    pub(super) fn embedded() -> Option<&'static Self> {
        static LIBRARY: OnceLock<Option<ThrowLibrary>> = OnceLock::new();
        LIBRARY
            .get_or_init(|| Self::from_bytes(EMBEDDED).ok())
            .as_ref()
    }

    /// Reads a library.
    ///
    /// # Errors
    /// Bytes of something else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, LibraryError> {
        postcard::from_bytes(bytes).map_err(LibraryError)
    }

    /// The bytes of its file.
    ///
    /// # Errors
    /// None that is known of.
    pub fn to_bytes(&self) -> Result<Vec<u8>, LibraryError> {
        postcard::to_allocvec(self).map_err(LibraryError)
    }

    /// Number of throws.
    #[must_use]
    pub fn len(&self) -> usize {
        self.throws.len()
    }

    /// Whether it has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.throws.is_empty()
    }

    /// Joints 2, 4 and 6 at the waypoints (rad) of the throws whose tips passed nearest to a
    /// target, given as distance from the base axis and height (m), the nearest first. Other
    /// parameters of the rope count as distance.
    fn nearest(&self, rope: &RopeParams, target_m: [f64; 2], count: usize) -> Vec<Vec<f64>> {
        let rope = rope.to_array();
        let mut near: Vec<(f64, &StoredThrow)> = self
            .throws
            .iter()
            .map(|throw| {
                (
                    throw.tip_distance_m(target_m) + throw.rope_distance_m(&rope),
                    throw,
                )
            })
            .collect();
        let count = count.min(near.len());
        if count > 0 && count < near.len() {
            near.select_nth_unstable_by(count, |(a, _), (b, _)| a.total_cmp(b));
        }
        near.truncate(count);
        near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let joints = |throw: &StoredThrow| throw.waypoints_rad.as_flattened().to_vec();
        near.into_iter()
            .map(|(_, throw)| joints(throw).into_iter().map(f64::from).collect())
            .collect()
    }
}

impl StoredThrow {
    /// Least distance of the tip's path, straight between its places, from a point (m).
    fn tip_distance_m(&self, [x, z]: [f64; 2]) -> f64 {
        let place = |p: &[i16; 2]| [f64::from(p[0]) * 1e-3 - x, f64::from(p[1]) * 1e-3 - z];
        let squared = |[x, z]: [f64; 2]| x * x + z * z;
        let of_segment = |pair: &[[i16; 2]]| {
            let (a, b) = (place(&pair[0]), place(&pair[1]));
            let along = [b[0] - a[0], b[1] - a[1]];
            let u = -(a[0] * along[0] + a[1] * along[1]) / squared(along).max(1e-12);
            let u = u.clamp(0.0, 1.0);
            squared([a[0] + u * along[0], a[1] + u * along[1]])
        };
        let least = self.tip_mm.windows(2).map(of_segment);
        least.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// How far the tip would be off with another rope, parameters in the order of [`RANGES`] (m).
    fn rope_distance_m(&self, rope: &[f64; ROPE_PARAMETERS]) -> f64 {
        let parameters = rope.iter().zip(&self.rope).zip(&RANGES);
        let squares = parameters
            .zip(SHIFT_PER_RANGE_M)
            .map(|(((a, b), range), shift_m)| {
                let ranges = (a - f64::from(*b)) / (range.max - range.min);
                (shift_m * ranges).powi(2)
            });
        squares.sum::<f64>().sqrt()
    }
}
