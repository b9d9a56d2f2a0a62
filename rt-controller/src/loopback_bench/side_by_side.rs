//! The loop beside `cyclictest` and beside a loop that does nothing.
//!
//! They take turns of a second each on one core, so that all meet the same neighbours;
//! all other cores are kept busy meanwhile.

use super::bare::bare_slice;
use super::cyclictest::lateness_ns;
use super::load::Load;
use super::{CycleTimes, LoopbackBench, LoopbackError};
use crate::os::RealTimeSettings;
use crate::os::schedule::run_on;
use shared_types::ipc::message::Percentiles;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::time::Duration;

/// Samples of all.
#[derive(Debug)]
pub struct SideBySide {
    /// Of the loop.
    pub ours: Vec<CycleTimes>,
    /// How long a loop took that does nothing for as long as ours computes (ns).
    pub bare: Vec<u64>,
    /// How late `cyclictest` woke (ns), or why there is nothing of it.
    pub cyclictest: Result<Vec<u64>, String>,
    /// Cores that were kept busy.
    pub loaded: Vec<usize>,
    /// Real-time properties that could not be had.
    pub warnings: Vec<String>,
}

impl SideBySide {
    /// Time until the next has its turn.
    pub const SLICE: Duration = Duration::from_secs(1);
    /// The loop's period.
    pub const PERIOD: Duration = super::PERIOD;
    /// Priority of all.
    pub const PRIORITY: u8 = super::PRIORITY;

    /// Measures on one of `cores` until each has had its seconds; tells `say` how many it had.
    pub fn measure(
        cpu: usize,
        cores: usize,
        seconds: u32,
        mut say: impl FnMut(u32),
    ) -> Result<Self, LoopbackError> {
        let loaded: Vec<usize> = (0..cores).filter(|other| *other != cpu).collect();
        let _awake = stay_awake();
        let real_time = RealTimeSettings {
            priority: Some(Self::PRIORITY),
            cpu: Some(cpu),
            ..RealTimeSettings::default()
        };
        // What this process starts besides stays off the loop's core.
        if !loaded.is_empty() {
            run_on(&loaded)?;
        }
        let _load = Load::begin(&loaded)?;
        let domain = format!("bench-rt-{}", std::process::id());
        let mut bench = LoopbackBench::new(&domain, &real_time)?;
        let mut measured = Self {
            ours: Vec::new(),
            bare: Vec::new(),
            cyclictest: Ok(Vec::new()),
            loaded,
            warnings: bench.warnings.clone(),
        };
        for turn in 0..seconds {
            say(turn);
            measured.ours.extend(bench.slice(Self::SLICE)?);
            let work = Percentiles::of_ns(measured.ours.iter().map(|t| t.compute_ns));
            let work_ns = (work.p50_us * 1e3) as u64;
            let bare = bare_slice(&real_time, work_ns, Self::PERIOD, Self::SLICE)?;
            measured.bare.extend(bare);
            if let Ok(late_ns) = &mut measured.cyclictest {
                match lateness_ns(cpu, &measured.loaded, Self::SLICE) {
                    Ok(more) => late_ns.extend(more),
                    Err(reason) => measured.cyclictest = Err(reason),
                }
            }
        }
        Ok(measured)
    }
}

/// Asks the kernel to keep cores out of deep sleep while the file is open, as
/// `cyclictest` does for itself. Where it cannot be had, both do without.
fn stay_awake() -> Option<File> {
    let mut file = OpenOptions::new()
        .write(true)
        .open("/dev/cpu_dma_latency")
        .ok()?;
    file.write_all(&0_i32.to_ne_bytes()).ok()?;
    Some(file)
}
