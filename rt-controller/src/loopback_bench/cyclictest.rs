//! `cyclictest` of the `rt-tests` package, the kernel developers' own measure of
//! how late a thread wakes.

use super::{PERIOD, PRIORITY, WARM_UP};
use crate::os::schedule::run_on;
use std::io::ErrorKind;
use std::process::Command;
use std::time::Duration;

/// Lateness of each wake-up of its thread on core `cpu` within `span` (ns), with the
/// priority and the interval of the loop; everything else of it stays on the cores
/// `others`. Else why there are no figures, and what to do.
pub(super) fn lateness_ns(
    cpu: usize,
    others: &[usize],
    span: Duration,
) -> Result<Vec<u64>, String> {
    let interval_us = PERIOD.as_micros();
    let loops = span.as_micros() / interval_us.max(1) + WARM_UP as u128;
    let mut command = Command::new("cyclictest");
    command
        .args(["--verbose", "--nsecs", "--mlockall", "--distance=0"])
        .arg(format!("--priority={}", PRIORITY))
        .arg(format!("--interval={interval_us}"))
        .arg(format!("--affinity={cpu}"))
        .arg(format!("--loops={loops}"));
    if let Some(main) = others.first() {
        command.arg(format!("--mainaffinity={main}"));
    }
    let cpus: Vec<usize> = others.iter().copied().chain([cpu]).collect();
    // It uses the cores of the thread that starts it, so that thread must
    // have them all.
    let output = std::thread::scope(|scope| {
        let start = scope.spawn(|| {
            run_on(&cpus)?;
            command.output()
        });
        start
            .join()
            .unwrap_or_else(|_| Err(std::io::Error::other("its thread panicked")))
    });
    let output = output.map_err(|e| match e.kind() {
        ErrorKind::NotFound => "`cyclictest` is not installed, so there is nothing to compare \
            with: install it with `apt-get install rt-tests`"
            .to_owned(),
        _ => format!("`cyclictest` cannot be started: {e}"),
    })?;
    let samples = samples(&String::from_utf8_lossy(&output.stdout));
    if output.status.success() && samples.len() > WARM_UP {
        return Ok(samples.get(WARM_UP..).unwrap_or_default().to_vec());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    let said = last.unwrap_or("no reason given").trim();
    Err(format!(
        "`cyclictest` measured nothing ({said}): run this as root or allow real-time priorities"
    ))
}

/// Third column of the lines `thread: count: lateness`.
fn samples(text: &str) -> Vec<u64> {
    let sample = |line: &str| {
        let numbers = line.split(':').map(|part| part.trim().parse::<u64>().ok());
        let numbers: Vec<u64> = numbers.collect::<Option<_>>()?;
        <[u64; 3]>::try_from(numbers)
            .ok()
            .map(|[_, _, late_ns]| late_ns)
    };
    text.lines().filter_map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_told_from_everything_else_it_prints() {
        let text = "Max CPUs = 2\n# /dev/cpu_dma_latency set to 0us\n\
                    Thread 0 Interval: 4000\n       0:       0:   39230\n       0:       1:   43597\n";
        assert_eq!(samples(text), [39230, 43597]);
    }
}
