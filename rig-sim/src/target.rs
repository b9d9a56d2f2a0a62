//! Targets for throws on the rig.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shared_types::Task;

/// A target drawn from the seed where ropes of every length can do the task
/// (m): where it lies by distance from the base axis, height and bearing.
#[must_use]
pub fn random_target(task: Task, seed: u64) -> [f64; 3] {
    // Behind a wall that is turned to the other side the rig's camera does not see.
    let (rhos_m, heights_m, bearings_deg) = match task {
        Task::Strike => (0.85..1.05, -0.10..0.60, -20.0..20.0),
        Task::Lob => (0.85..0.95, 0.05..0.25, -20.0..20.0),
        Task::Drape => (0.70..0.80, 0.20..0.35, -20.0..0.0),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(0x7a26_e701);
    let rho: f64 = rng.random_range(rhos_m);
    let height = rng.random_range(heights_m);
    let bearing_deg: f64 = rng.random_range(bearings_deg);
    let bearing = bearing_deg.to_radians();
    [rho * bearing.cos(), rho * bearing.sin(), height]
}
