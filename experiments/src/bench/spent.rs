//! Time spent on a piece of work.

use rustix::time::{ClockId, Timespec, clock_gettime};
use std::time::Instant;

/// Processor and wall time of one piece of work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spent {
    /// Processor time of all threads of this process (s).
    pub cpu_s: f64,
    /// Wall time (s).
    pub wall_s: f64,
}

impl Spent {
    /// The smaller times of both, each by itself.
    #[must_use]
    pub fn or_less(self, other: Self) -> Self {
        Self {
            cpu_s: self.cpu_s.min(other.cpu_s),
            wall_s: self.wall_s.min(other.wall_s),
        }
    }
}

/// Processor time of all threads of this process so far (s).
fn process_cpu_s() -> f64 {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::ProcessCPUTime);
    tv_sec as f64 + 1e-9 * tv_nsec as f64
}

/// Does the work `repeats` times; returns the smallest times, each by itself, and the
/// last result. Other load on the machine only ever adds time, so the smallest is the
/// best estimate.
pub fn least<T, E>(
    repeats: usize,
    mut work: impl FnMut() -> Result<T, E>,
) -> Result<(Spent, T), E> {
    let mut once = || {
        let (began, cpu_s) = (Instant::now(), process_cpu_s());
        let result = work()?;
        let spent = Spent {
            cpu_s: process_cpu_s() - cpu_s,
            wall_s: began.elapsed().as_secs_f64(),
        };
        Ok((spent, result))
    };
    let (mut spent, mut result) = once()?;
    for _ in 1..repeats {
        let (again, latest) = once()?;
        spent = spent.or_less(again);
        result = latest;
    }
    Ok((spent, result))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_of_other_threads_counts_and_sleep_does_not() {
        let work = || {
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    let began = process_cpu_s();
                    let mut x = 1.0_f64;
                    while process_cpu_s() - began < 0.05 {
                        x = std::hint::black_box(x * 1.000_001);
                    }
                });
            });
            Ok::<(), ()>(())
        };
        let (spent, ()) = least(2, work).unwrap();
        assert!(spent.cpu_s >= 0.05, "{spent:?}");
        let nap = || {
            std::thread::sleep(std::time::Duration::from_millis(200));
            Ok::<(), ()>(())
        };
        let (spent, ()) = least(3, nap).unwrap();
        assert!(spent.wall_s >= 0.2 && spent.cpu_s < 0.15, "{spent:?}");
    }
}
