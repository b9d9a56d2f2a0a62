//! `wag bench rt`: how punctual the control loop is on this machine, beside
//! `cyclictest` with the same priority, period and core.

use crate::cli::BenchArgs;
use cli_output::table::numbers;
use cli_output::{Machine, OrInput, Outcome, Stage};
use rt_controller::loopback_bench::{CycleTimes, SideBySide};
use serde_json::{Value, json};
use shared_types::ipc::message::Percentiles;

/// Time of each with `--quick` (s).
const QUICK_S: u32 = 5;
/// Our wake-up latency may be this many times that of `cyclictest`.
const RATIO_MAX: f64 = 1.15;
/// A cycle computes at most this long, at the 99.9th percentile (us).
const COMPUTE_MAX_US: f64 = 20.0;

pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    // Before this thread gives the loop's core away.
    let machine = Machine::here();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let cpu = args.cpu.unwrap_or(cores - 1);
    if cpu >= cores {
        return Err(bad_input!(
            "--cpu is {cpu}, this machine has cores 0 to {}",
            cores - 1
        ));
    }
    let seconds = if args.quick { QUICK_S } else { args.seconds };
    let stage = Stage::begin("real time");
    let say = |done| stage.say(format!("{done} of {seconds} s each"));
    let measured = SideBySide::measure(cpu, cores, seconds, say).or_failed()?;
    stage.done(&format!("{} cycles", measured.ours.len()));
    let slice_s = SideBySide::SLICE.as_secs_f64();
    let period_us = SideBySide::PERIOD.as_secs_f64() * 1e6;
    println!("{machine}");
    println!(
        "core {cpu}, priority {}, every {period_us:.0} us; load on cores {:?}; {seconds} s each in turns of {slice_s} s",
        SideBySide::PRIORITY,
        measured.loaded
    );
    for warning in &measured.warnings {
        println!("warning: {warning}");
    }
    let ours = |of: fn(&CycleTimes) -> u64| Percentiles::of_ns(measured.ours.iter().map(of));
    let missed: u64 = measured.ours.iter().map(|t| u64::from(t.missed)).sum();
    let (wake, compute) = (ours(|t| t.wake_ns), ours(|t| t.compute_ns));
    let (receive, send) = (ours(|t| t.receive_ns), ours(|t| t.send_ns));
    let bare = Percentiles::of_ns(measured.bare);
    let (cyclictest, no_cyclictest) = match measured.cyclictest {
        Ok(late_ns) => (Some(Percentiles::of_ns(late_ns)), None),
        Err(reason) => (None, Some(reason.to_string())),
    };
    let rows = [
        ("wake-up latency, the loop", Some(wake)),
        ("wake-up latency, cyclictest", cyclictest),
        ("receive call", Some(receive)),
        ("compute", Some(compute)),
        ("nothing, for as long", Some(bare)),
        ("send call", Some(send)),
    ];
    let rows = rows.into_iter().filter_map(|(name, p)| {
        let p = p?;
        let [p50, p99, p999, max] =
            [p.p50_us, p.p99_us, p.p999_us, p.max_us].map(|us| format!("{us:.1}"));
        Some([name.to_owned(), p.count.to_string(), p50, p99, p999, max])
    });
    let header = [
        "",
        "samples",
        "p50 (us)",
        "p99 (us)",
        "p99.9 (us)",
        "max (us)",
    ];
    println!("{}", numbers(header, 0, rows));
    let compared = cyclictest.map(|its| compare(&wake, &its));
    if let Some(([p50, p99, p999], within)) = compared {
        println!(
            "the loop's wake-up latency is {p50:.2}, {p99:.2} and {p999:.2} times that of cyclictest ({} at most {RATIO_MAX})",
            verdict(within)
        );
    }
    println!(
        "compute at p99.9: {:.1} us ({} at most {COMPUTE_MAX_US:.0} us); {missed} cycles skipped",
        compute.p999_us,
        verdict(compute.p999_us <= COMPUTE_MAX_US)
    );
    println!(
        "a loop that does nothing for {:.1} us is held up to {:.1} us at p99.9: \
         so much of it is interrupts of this machine",
        bare.p50_us, bare.p999_us
    );
    if let Some(reason) = &no_cyclictest {
        println!("{reason}");
    }
    Ok(Some(json!({
        "ok": true, "command": "bench rt", "machine": machine, "seconds": seconds,
        "slice_s": slice_s, "priority": SideBySide::PRIORITY, "cpu": cpu,
        "loaded": measured.loaded, "period_us": period_us, "warnings": measured.warnings,
        "missed": missed,
        "wake": {
            "ours": wake, "cyclictest": cyclictest,
            "ratio": compared.map(|(ratio, _)| ratio), "within": compared.map(|(_, within)| within),
        },
        "receive": receive, "compute": compute, "bare": bare, "send": send,
        "no_cyclictest": no_cyclictest,
    })))
}

/// Ours as a multiple of the other's at p50, p99 and p99.9, and whether all are small enough.
fn compare(ours: &Percentiles, its: &Percentiles) -> ([f64; 3], bool) {
    let ratio = [
        ours.p50_us / its.p50_us,
        ours.p99_us / its.p99_us,
        ours.p999_us / its.p999_us,
    ];
    (ratio, ratio.iter().all(|part| *part <= RATIO_MAX))
}

fn verdict(held: bool) -> &'static str {
    if held { "within" } else { "NOT within" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_judged() {
        let ours = Percentiles::of_ns((1..=1000).map(|k| k * 1000));
        let slower = Percentiles::of_ns((1..=1000).map(|k| k * 1200));
        assert!(compare(&ours, &slower).1 && !compare(&slower, &ours).1);
    }
}
