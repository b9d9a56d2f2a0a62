//! What the facts about a machine mean for a throw, and what to do about them.

use super::{ArmLine, Facts, Finding, Verdict};
use rope_sim::Kernel;

/// Priority the control thread asks for.
const PRIORITY: u64 = 80;
/// Memory the controller locks, generously (bytes).
const LOCKED_BYTES: u64 = 1 << 30;
/// Shared memory a controller begins with, and what leaves room beside it (MB).
const SHARED_MEMORY_MB: (u64, u64) = (128, 250);
/// Disk a run needs, and what lasts for a day of runs (MB).
const DISK_MB: (u64, u64) = (100, 2000);
/// Round trips that leave a cycle of 4 ms room: median and p99 (µs).
const ROUND_TRIP_US: (f64, f64) = (500.0, 2000.0);

fn finding(
    name: &'static str,
    verdict: Verdict,
    found: impl Into<String>,
    remedy: &str,
) -> Finding {
    Finding {
        name,
        verdict,
        found: found.into(),
        remedy: if verdict == Verdict::Pass {
            String::new()
        } else {
            remedy.to_owned()
        },
    }
}

const fn pass_or_warn(good: bool) -> Verdict {
    if good { Verdict::Pass } else { Verdict::Warn }
}

/// Judges a machine.
pub fn judge(facts: &Facts) -> Vec<Finding> {
    let mut findings = real_time(facts).to_vec();
    findings.extend(room(facts));
    findings.push(finding(
        "vector instructions",
        pass_or_warn(facts.rope_kernel.is_some_and(Kernel::is_single_precision)),
        match facts.rope_kernel {
            None => "the system does not say".to_owned(),
            Some(Kernel::ScalarF64) => "neither AVX2 with FMA nor AVX-512".to_owned(),
            Some(kernel) => format!("{} rope(s) at a time", kernel.lanes()),
        },
        "ropes are simulated one by one without them: identify and plan on another machine",
    ));
    findings.push(finding(
        "camera",
        pass_or_warn(!facts.cameras.is_empty()),
        if facts.cameras.is_empty() {
            "no /dev/video*".to_owned()
        } else {
            facts.cameras.join(", ")
        },
        "plug the camera in; not needed for the simulated rig or for films",
    ));
    findings
}

fn real_time(facts: &Facts) -> [Finding; 6] {
    let flavour = if facts.preempt_rt {
        "PREEMPT_RT"
    } else {
        "not PREEMPT_RT"
    };
    let said = |text: &str| {
        if text.is_empty() {
            "the system does not say".to_owned()
        } else {
            text.to_owned()
        }
    };
    [
        finding(
            "kernel",
            pass_or_warn(facts.preempt_rt),
            format!("{}, {flavour}", said(&facts.kernel)),
            "install your distribution's PREEMPT_RT kernel; without it rare delays of milliseconds are to be expected",
        ),
        finding(
            "real-time priority",
            pass_or_warn(facts.priority_max >= PRIORITY),
            match facts.priority_max {
                u64::MAX => "any".to_owned(),
                0 => "none".to_owned(),
                max => format!("up to {max}"),
            },
            "put `@wag - rtprio 95` into /etc/security/limits.d/wag.conf (packaging/limits.d), join the group, log in again",
        ),
        finding(
            "memory lock",
            pass_or_warn(facts.lock_max_bytes >= LOCKED_BYTES),
            match facts.lock_max_bytes {
                u64::MAX => "unlimited".to_owned(),
                bytes => format!("{} MB", bytes / 1_000_000),
            },
            "put `@wag - memlock unlimited` into /etc/security/limits.d/wag.conf (packaging/limits.d), join the group, log in again",
        ),
        finding(
            "frequency governor",
            pass_or_warn(facts.governors == ["performance"]),
            said(&facts.governors.join(", ")),
            "cpupower frequency-set -g performance; on a virtual machine the host decides",
        ),
        finding(
            "isolated core",
            pass_or_warn(!facts.isolated.is_empty()),
            if facts.isolated.is_empty() {
                "none".to_owned()
            } else {
                facts.isolated.clone()
            },
            "isolcpus=N nohz_full=N rcu_nocbs=N on the kernel's command line, cpu = N in [real_time]",
        ),
        finding(
            "clock source",
            pass_or_warn(facts.clock == "tsc"),
            said(&facts.clock),
            "clocksource=tsc on the kernel's command line if the processor's counter is steady; others cost time at every reading",
        ),
    ]
}

fn room(facts: &Facts) -> [Finding; 3] {
    let enough = |free: Option<u64>, (needed, ample): (u64, u64)| match free {
        Some(mb) if mb < needed => Verdict::Fail,
        Some(mb) if mb >= ample => Verdict::Pass,
        _ => Verdict::Warn,
    };
    let mb = |free: Option<u64>| {
        free.map_or_else(
            || "the system does not say".to_owned(),
            |mb| format!("{mb} MB free"),
        )
    };
    let dead = &facts.dead_runs;
    [
        finding(
            "shared memory",
            enough(facts.shared_memory_mb, SHARED_MEMORY_MB),
            mb(facts.shared_memory_mb),
            "mount -o remount,size=1G /dev/shm; for a container --shm-size=1g",
        ),
        finding(
            "leftovers of dead runs",
            pass_or_warn(dead.is_empty()),
            if dead.is_empty() {
                "none".to_owned()
            } else {
                dead.join(", ")
            },
            "they take room but disturb nobody: rm /dev/shm/wag_run-PID_*",
        ),
        finding(
            "disk",
            enough(facts.disk_mb, DISK_MB),
            mb(facts.disk_mb),
            "make room, or name another folder with --out; a run takes about 10 MB",
        ),
    ]
}

/// Judges the line to an arm.
pub fn judge_line(line: &ArmLine) -> Vec<Finding> {
    let mut findings = vec![match &line.version {
        Ok(version) => finding(
            "arm",
            Verdict::Pass,
            format!(
                "{}: {} axes, firmware {}",
                line.address, version.axes, version.firmware
            ),
            "",
        ),
        Err(reason) => finding(
            "arm",
            Verdict::Fail,
            format!("{}: {reason}", line.address),
            "check power, cable and address (the arm's own page shows it in a browser), and that this machine has an address in its network",
        ),
    }];
    for (port, speaks) in &line.reports {
        findings.push(finding(
            "report port",
            if *speaks { Verdict::Pass } else { Verdict::Fail },
            if *speaks {
                format!("{port} reports")
            } else {
                format!("{port} is silent")
            },
            "end other clients (the arm takes a few only); port 30000 needs firmware 2.1.101 or newer",
        ));
    }
    findings.extend(round_trips(&line.round_trips_us));
    findings
}

/// Judges sorted round trips.
fn round_trips(sorted_us: &[f64]) -> Option<Finding> {
    let max = sorted_us.last()?;
    let at = |percent: usize| sorted_us[(sorted_us.len() - 1) * percent / 100];
    let (median, p99) = (at(50), at(99));
    Some(finding(
        "round trip",
        pass_or_warn(median <= ROUND_TRIP_US.0 && p99 <= ROUND_TRIP_US.1),
        format!(
            "{} requests: median {median:.0} µs, p99 {p99:.0} µs, max {max:.0} µs",
            sorted_us.len()
        ),
        "a direct cable to a network port of its own, no switch, no wireless, interrupt coalescing off",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Facts {
        Facts {
            kernel: "6.1".to_owned(),
            preempt_rt: true,
            priority_max: 95,
            lock_max_bytes: u64::MAX,
            governors: vec!["performance".to_owned()],
            isolated: "3".to_owned(),
            clock: "tsc".to_owned(),
            rope_kernel: Some(Kernel::Avx2F32),
            dead_runs: Vec::new(),
            cameras: vec!["video0".to_owned()],
            shared_memory_mb: Some(1000),
            disk_mb: Some(50_000),
        }
    }

    /// Names of findings that are not a pass, with their verdicts.
    fn wrong(facts: &Facts) -> Vec<(&'static str, Verdict)> {
        let findings = judge(facts);
        for f in &findings {
            assert_eq!(f.remedy.is_empty(), f.verdict == Verdict::Pass, "{f:?}");
            assert!(!f.found.is_empty(), "{f:?}");
        }
        findings
            .iter()
            .filter(|f| f.verdict != Verdict::Pass)
            .map(|f| (f.name, f.verdict))
            .collect()
    }

    #[test]
    fn each_fact_is_judged_by_itself() {
        type Case = (fn(&mut Facts), &'static str, Verdict);
        assert!(wrong(&good()).is_empty());
        let cases: [Case; 10] = [
            (|f| f.preempt_rt = false, "kernel", Verdict::Warn),
            (|f| f.priority_max = 79, "real-time priority", Verdict::Warn),
            (|f| f.lock_max_bytes = 8 << 20, "memory lock", Verdict::Warn),
            (
                |f| f.governors.push("powersave".to_owned()),
                "frequency governor",
                Verdict::Warn,
            ),
            (|f| f.isolated.clear(), "isolated core", Verdict::Warn),
            (
                |f| f.clock = "hpet".to_owned(),
                "clock source",
                Verdict::Warn,
            ),
            (
                |f| f.rope_kernel = Some(Kernel::ScalarF64),
                "vector instructions",
                Verdict::Warn,
            ),
            (
                |f| f.shared_memory_mb = Some(64),
                "shared memory",
                Verdict::Fail,
            ),
            (|f| f.disk_mb = Some(500), "disk", Verdict::Warn),
            (
                |f| f.dead_runs.push("run-7".to_owned()),
                "leftovers of dead runs",
                Verdict::Warn,
            ),
        ];
        for (worsen, name, verdict) in cases {
            let mut facts = good();
            worsen(&mut facts);
            assert_eq!(wrong(&facts), [(name, verdict)]);
        }
        // A machine that says nothing has neither passed nor failed.
        assert!(
            wrong(&Facts::default())
                .iter()
                .all(|(_, v)| *v == Verdict::Warn)
        );
    }

    #[test]
    fn a_slow_line_is_warned_of_and_a_silent_port_fails() {
        let quick: Vec<f64> = (0..200).map(|i| 100.0 + f64::from(i)).collect();
        assert_eq!(round_trips(&quick).unwrap().verdict, Verdict::Pass);
        let mut stalls = quick;
        stalls.truncate(190);
        stalls.extend([190_000.0; 10]);
        let slow = round_trips(&stalls).unwrap();
        assert_eq!(slow.verdict, Verdict::Warn);
        assert!(slow.found.contains("max 190000 µs"), "{}", slow.found);
        let line = ArmLine {
            address: "10.0.0.1:502".parse().unwrap(),
            version: Err("nobody there".to_owned()),
            round_trips_us: Vec::new(),
            reports: vec![(30000, false)],
        };
        let found = judge_line(&line);
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|f| f.verdict == Verdict::Fail));
        assert!(found[0].found.contains("nobody there"));
    }
}
