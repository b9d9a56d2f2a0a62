//! What the tests of the whole system share: the controller and the simulated arm in
//! virtual time, scenarios of faults, and a judge of setpoints.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod scenario;
pub mod setpoint_limits;
pub mod virtual_rig;

use std::num::NonZeroUsize;
use std::thread;

/// The value that `part` of all values do not exceed, the largest at most.
///
/// # Panics
/// Without any value.
#[must_use]
pub fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = (sorted.len() as f64 * part) as usize;
    sorted[index.min(sorted.len() - 1)]
}

/// Work for each seed, on all processors; in the order of the seeds.
///
/// # Panics
/// When the work does.
pub fn for_each_seed<T: Send>(seeds: &[u64], work: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let share = |seeds: &[u64]| -> Vec<T> { seeds.iter().map(|seed| work(*seed)).collect() };
    let share = &share;
    thread::scope(|scope| {
        let shares = seeds.chunks(seeds.len().div_ceil(threads).max(1));
        let workers: Vec<_> = shares.map(|s| scope.spawn(move || share(s))).collect();
        let ended = workers.into_iter().map(thread::ScopedJoinHandle::join);
        ended
            .flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    })
}
