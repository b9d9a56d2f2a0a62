//! `wag bench rt`: how punctual the control loop is on this machine, beside
//! `cyclictest` with the same priority, period and core.
//!
//! The two, and a loop that does nothing but read the clock for as long as ours
//! computes, take turns of a second each on one core, so that all meet the same
//! neighbours; all other cores are kept busy meanwhile.

mod report;

use super::percentiles::Percentiles;
use crate::cli::BenchArgs;
use cli_output::{Failure, Machine, OrInput, Outcome, Stage};
use report::{Beside, Report};
use rt_controller::loopback_bench::{
    CycleTimes, Cyclictest, CyclictestError, Load, LoopbackBench, bare_slice,
};
use rt_controller::os::RealTimeSettings;
use rt_controller::os::schedule::run_on;
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::time::Duration;

/// Time until the two change places.
const SLICE: Duration = Duration::from_secs(1);
/// The loop's period.
const PERIOD: Duration = Duration::from_millis(4);
/// Priority of both.
const PRIORITY: u8 = 80;
/// Time of each with `--quick` (s).
const QUICK_S: u32 = 5;

pub fn run(args: &BenchArgs, quiet: bool) -> Outcome<Option<Value>> {
    // Before this thread gives the loop's core away.
    let machine = Machine::here();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let cpu = args.cpu.unwrap_or(cores - 1);
    if cpu >= cores {
        return Err(Failure::input(anyhow::anyhow!(
            "--cpu is {cpu}, this machine has cores 0 to {}",
            cores - 1
        )));
    }
    let others: Vec<usize> = (0..cores).filter(|other| *other != cpu).collect();
    let seconds = if args.quick { QUICK_S } else { args.seconds };
    let _awake = stay_awake();
    let real_time = RealTimeSettings {
        priority: Some(PRIORITY),
        cpu: Some(cpu),
        ..RealTimeSettings::default()
    };
    let rival = Cyclictest {
        priority: PRIORITY,
        cpu,
        others: others.clone(),
        period: PERIOD,
    };
    // What this process starts besides stays off the loop's core.
    if !others.is_empty() {
        run_on(&others).or_failed()?;
    }
    let _load = Load::begin(&others).or_failed()?;
    let domain = format!("bench-rt-{}", std::process::id());
    let mut bench = LoopbackBench::new(&domain, real_time.clone()).or_failed()?;
    let stage = Stage::begin("real time", quiet);
    let measured = take_turns(&mut bench, &real_time, &rival, seconds, |done| {
        stage.say(format!("{done} of {seconds} s each"));
    })?;
    stage.done(&format!("{} cycles", measured.ours.len()));
    let report = Report {
        ok: true,
        command: "bench rt",
        machine,
        seconds,
        slice_s: SLICE.as_secs_f64(),
        priority: PRIORITY,
        cpu,
        loaded: others,
        period_us: PERIOD.as_secs_f64() * 1e6,
        warnings: bench.warnings().to_vec(),
        missed: measured.ours.iter().map(|t| u64::from(t.missed)).sum(),
        wake: Beside::of(
            Percentiles::of(measured.ours.iter().map(|t| t.wake_ns)),
            measured.rival.map(Percentiles::of),
        ),
        receive: Percentiles::of(measured.ours.iter().map(|t| t.receive_ns)),
        compute: Percentiles::of(measured.ours.iter().map(|t| t.compute_ns)),
        bare: Percentiles::of(measured.bare),
        send: Percentiles::of(measured.ours.iter().map(|t| t.send_ns)),
        no_cyclictest: measured.no_rival.map(|e| e.to_string()),
    };
    if !quiet {
        report.print();
    }
    serde_json::to_value(&report).or_failed().map(Some)
}

/// Samples of all.
struct Measured {
    ours: Vec<CycleTimes>,
    bare: Vec<u64>,
    rival: Option<Vec<u64>>,
    no_rival: Option<CyclictestError>,
}

/// Turn by turn, until each has had its time.
fn take_turns(
    bench: &mut LoopbackBench,
    real_time: &RealTimeSettings,
    rival: &Cyclictest,
    seconds: u32,
    mut say: impl FnMut(u32),
) -> Outcome<Measured> {
    let mut measured = Measured {
        ours: Vec::new(),
        bare: Vec::new(),
        rival: Some(Vec::new()),
        no_rival: None,
    };
    for turn in 0..seconds {
        say(turn);
        measured.ours.extend(bench.slice(SLICE).or_failed()?);
        let work_ns = median(measured.ours.iter().map(|t| t.compute_ns));
        let bare = bare_slice(real_time, work_ns, PERIOD, SLICE);
        measured.bare.extend(bare.or_failed()?);
        if let Some(late_ns) = &mut measured.rival {
            match rival.slice(SLICE) {
                Ok(more) => late_ns.extend(more),
                Err(reason) => {
                    measured.rival = None;
                    measured.no_rival = Some(reason);
                }
            }
        }
    }
    Ok(measured)
}

fn median(samples: impl Iterator<Item = u64>) -> u64 {
    let mut sorted: Vec<u64> = samples.collect();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or(0)
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
