//! Work on many seeds at once, one thread each.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Does `work` for each seed, on so many threads (default: one a processor). The results
/// come in the order of the seeds; after a failure no further seed is begun.
pub(super) fn each<T: Send>(
    seeds: &[u64],
    threads: Option<u16>,
    work: impl Fn(u64) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let own = thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.map_or(own, usize::from).min(seeds.len());
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(None));
    let worker = || {
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(seed) = seeds.get(i) else {
                return done;
            };
            match work(*seed) {
                Ok(result) => done.push((i, result)),
                Err(error) => {
                    next.store(seeds.len(), Ordering::Relaxed);
                    let error = error.context(format!("seed {seed}"));
                    if let Ok(mut failed) = failed.lock() {
                        failed.get_or_insert(error);
                    }
                }
            }
        }
    };
    let mut all: Vec<(usize, T)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        let ended = workers.into_iter().map(thread::ScopedJoinHandle::join);
        ended
            .flat_map(|result| result.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    if let Some(error) = failed.into_inner().unwrap_or_else(|e| e.into_inner()) {
        return Err(error);
    }
    all.sort_by_key(|(i, _)| *i);
    Ok(all.into_iter().map(|(_, result)| result).collect())
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
