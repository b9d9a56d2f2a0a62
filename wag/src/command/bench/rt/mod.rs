//! `wag bench rt`: how punctual the control loop is on this machine, beside
//! `cyclictest` with the same priority, period and core.

mod report;

use super::percentiles::Percentiles;
use crate::cli::BenchArgs;
use cli_output::{Failure, Machine, OrInput, Outcome, Stage};
use report::{Beside, Report};
use rt_controller::loopback_bench::{CycleTimes, SideBySide};
use serde_json::Value;

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
    let seconds = if args.quick { QUICK_S } else { args.seconds };
    let stage = Stage::begin("real time", quiet);
    let say = |done| stage.say(format!("{done} of {seconds} s each"));
    let measured = SideBySide::measure(cpu, cores, seconds, say).or_failed()?;
    stage.done(&format!("{} cycles", measured.ours.len()));
    let ours = |of: fn(&CycleTimes) -> u64| Percentiles::of(measured.ours.iter().map(of));
    let (cyclictest, no_cyclictest) = match measured.cyclictest {
        Ok(late_ns) => (Some(Percentiles::of(late_ns)), None),
        Err(reason) => (None, Some(reason.to_string())),
    };
    let report = Report {
        ok: true,
        command: "bench rt",
        machine,
        seconds,
        slice_s: SideBySide::SLICE.as_secs_f64(),
        priority: SideBySide::PRIORITY,
        cpu,
        loaded: measured.loaded,
        period_us: SideBySide::PERIOD.as_secs_f64() * 1e6,
        warnings: measured.warnings,
        missed: measured.ours.iter().map(|t| u64::from(t.missed)).sum(),
        wake: Beside::of(ours(|t| t.wake_ns), cyclictest),
        receive: ours(|t| t.receive_ns),
        compute: ours(|t| t.compute_ns),
        bare: Percentiles::of(measured.bare),
        send: ours(|t| t.send_ns),
        no_cyclictest,
    };
    if !quiet {
        report.print();
    }
    serde_json::to_value(&report).or_failed().map(Some)
}
