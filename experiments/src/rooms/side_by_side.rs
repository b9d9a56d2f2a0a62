//! Work on many seeds at once, one thread each.

use anyhow::Context;
use planner::workers::map_in_order;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// Does `work` for each seed, on so many threads (default: one a processor). The results
/// come in the order of the seeds; after a failure no further seed is begun.
pub(super) fn each<T: Send>(
    seeds: &[u64],
    threads: Option<u16>,
    work: impl Fn(u64) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let own = thread::available_parallelism().map_or(1, usize::from);
    let failed = AtomicBool::new(false);
    let results = map_in_order(seeds, threads.map_or(own, usize::from), |seed| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = work(*seed).with_context(|| format!("seed {seed}"));
        failed.fetch_or(result.is_err(), Ordering::Relaxed);
        Some(result)
    });
    // What was not begun comes with a failure.
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_seeds_order_and_a_failure_names_its_seed() {
        let seeds: Vec<u64> = (1..40).collect();
        assert_eq!(each(&seeds, Some(3), Ok).unwrap(), seeds);
        let fails = |seed: u64| -> anyhow::Result<u64> {
            anyhow::ensure!(seed != 7, "no");
            Ok(seed)
        };
        let error = each(&seeds, Some(2), fails).unwrap_err();
        assert!(format!("{error:#}").contains("seed 7"));
    }
}
