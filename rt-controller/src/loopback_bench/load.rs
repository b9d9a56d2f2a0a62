//! Work on the other cores, so that the measured one has neighbours.

use crate::os::schedule::run_on;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Memory that each thread walks through: more than caches hold (bytes).
const WALK_BYTES: usize = 64 << 20;

/// Threads that compute and touch memory until this is dropped.
#[derive(Debug)]
pub(super) struct Load {
    quit: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    /// One thread on each of `cpus`.
    pub(super) fn begin(cpus: &[usize]) -> std::io::Result<Self> {
        let quit = Arc::new(AtomicBool::new(false));
        let mut load = Self {
            quit: Arc::clone(&quit),
            threads: Vec::new(),
        };
        for cpu in cpus {
            let (cpu, quit) = (*cpu, Arc::clone(&quit));
            let thread = std::thread::Builder::new()
                .name("load".to_owned())
                .spawn(move || {
                    // Elsewhere it is a load, too.
                    let _ = run_on(&[cpu]);
                    walk(&quit);
                })?;
            load.threads.push(thread);
        }
        Ok(load)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn walk(quit: &AtomicBool) {
    let mut words = vec![1_u64; WALK_BYTES / size_of::<u64>()];
    let mut sum = 0_u64;
    while !quit.load(Ordering::Relaxed) {
        for line in words.chunks_mut(4096) {
            for word in line.iter_mut() {
                *word = word.rotate_left(7) ^ sum;
                sum = sum.wrapping_add(*word);
            }
            if quit.load(Ordering::Relaxed) {
                break;
            }
        }
    }
    std::hint::black_box(sum);
}
