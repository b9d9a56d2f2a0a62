//! The figures of the real-time benchmark.

use crate::command::bench::percentiles::Percentiles;
use cli_output::Machine;
use cli_output::table::numbers;
use serde::Serialize;

/// Our wake-up error may be this many times that of `cyclictest`.
const RATIO_MAX: f64 = 1.15;
/// A cycle computes at most this long, at the 99.9th percentile (us).
const COMPUTE_MAX_US: f64 = 20.0;

/// Ours and that of `cyclictest`.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Beside {
    pub ours: Percentiles,
    pub cyclictest: Option<Percentiles>,
    /// Ours as a multiple, at p50, p99 and p99.9.
    pub ratio: Option<[f64; 3]>,
    /// Whether every ratio is at most 1.15.
    pub within: Option<bool>,
}

impl Beside {
    pub fn of(ours: Percentiles, cyclictest: Option<Percentiles>) -> Self {
        let ratio = cyclictest.map(|its| {
            [
                ours.p50_us / its.p50_us,
                ours.p99_us / its.p99_us,
                ours.p999_us / its.p999_us,
            ]
        });
        Self {
            ours,
            cyclictest,
            ratio,
            within: ratio.map(|parts| parts.iter().all(|part| *part <= RATIO_MAX)),
        }
    }
}

/// Everything measured.
#[derive(Debug, Serialize)]
pub struct Report {
    pub ok: bool,
    pub command: &'static str,
    pub machine: Machine,
    /// Time of each contender (s).
    pub seconds: u32,
    /// They took turns of this length (s).
    pub slice_s: f64,
    pub priority: u8,
    pub cpu: usize,
    /// Cores that were kept busy.
    pub loaded: Vec<usize>,
    pub period_us: f64,
    /// Real-time properties that could not be had.
    pub warnings: Vec<String>,
    /// Cycles skipped.
    pub missed: u64,
    /// Lateness of the wake-up.
    pub wake: Beside,
    /// The receive call.
    pub receive: Percentiles,
    /// Inputs, core and record, without system calls.
    pub compute: Percentiles,
    /// A loop that only reads the clock for as long as the median of `compute`.
    pub bare: Percentiles,
    /// The send call.
    pub send: Percentiles,
    /// Why there is nothing to compare with.
    pub no_cyclictest: Option<String>,
}

impl Report {
    /// Prints the table on standard output.
    pub fn print(&self) {
        println!("{}", self.machine);
        println!(
            "core {}, priority {}, every {:.0} us; load on cores {:?}; {} s each in turns of {} s",
            self.cpu, self.priority, self.period_us, self.loaded, self.seconds, self.slice_s
        );
        for warning in &self.warnings {
            println!("warning: {warning}");
        }
        let row = |name: &str, p: &Percentiles| {
            [
                name.to_owned(),
                p.count.to_string(),
                format!("{:.1}", p.p50_us),
                format!("{:.1}", p.p99_us),
                format!("{:.1}", p.p999_us),
                format!("{:.1}", p.max_us),
            ]
        };
        let mut rows = vec![row("wake-up error, the loop", &self.wake.ours)];
        if let Some(its) = &self.wake.cyclictest {
            rows.push(row("wake-up error, cyclictest", its));
        }
        rows.push(row("receive call", &self.receive));
        rows.push(row("compute", &self.compute));
        rows.push(row("nothing, for as long", &self.bare));
        rows.push(row("send call", &self.send));
        let header = [
            "",
            "samples",
            "p50 (us)",
            "p99 (us)",
            "p99.9 (us)",
            "max (us)",
        ];
        println!("{}", numbers(header, 0, rows));
        if let (Some([p50, p99, p999]), Some(within)) = (self.wake.ratio, self.wake.within) {
            println!(
                "the loop's wake-up error is {p50:.2}, {p99:.2} and {p999:.2} times that of cyclictest ({})",
                verdict(within, &format!("at most {RATIO_MAX}"))
            );
        }
        println!(
            "compute at p99.9: {:.1} us ({}); {} cycles skipped",
            self.compute.p999_us,
            verdict(
                self.compute.p999_us <= COMPUTE_MAX_US,
                &format!("at most {COMPUTE_MAX_US:.0} us")
            ),
            self.missed
        );
        println!(
            "a loop that does nothing for {:.1} us is held up to {:.1} us at p99.9: \
             so much of it is interrupts of this machine",
            self.bare.p50_us, self.bare.p999_us
        );
        if let Some(reason) = &self.no_cyclictest {
            println!("{reason}");
        }
    }
}

fn verdict(held: bool, limit: &str) -> String {
    let word = if held { "within" } else { "NOT within" };
    format!("{word} {limit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_judged() {
        let ours = Percentiles::of((1..=1000).map(|k| k * 1000));
        let slower = Percentiles::of((1..=1000).map(|k| k * 1200));
        assert_eq!(Beside::of(ours, Some(slower)).within, Some(true));
        assert_eq!(Beside::of(slower, Some(ours)).within, Some(false));
        assert_eq!(Beside::of(ours, None).ratio, None);
    }
}
