//! What a machine's system says about itself in `/proc`, `/sys` and `/dev`, and what that
//! means for a throw.

use super::{Finding, REQUIRED_OF_A_REAL_ARM, Verdict};
use rope_sim::{Kernel, Precision};
use std::path::Path;

/// Capabilities to raise priorities and to lock memory, bits of `CapEff`.
const CAP_SYS_NICE: u32 = 23;
const CAP_IPC_LOCK: u32 = 14;
/// Priority the control thread asks for.
const PRIORITY: u64 = 80;
/// Memory the controller locks, generously (bytes).
const LOCKED_BYTES: u64 = 1 << 30;
/// Shared memory a controller begins with, and what leaves room beside it (MB).
const SHARED_MEMORY_MB: (u64, u64) = (128, 250);
/// Disk a run needs, and what lasts for a day of runs (MB).
const DISK_MB: (u64, u64) = (100, 2000);

/// A machine; `None` where the system does not say.
#[derive(Debug)]
pub struct Machine<'a> {
    /// Where `proc`, `sys` and `dev` are: `/` on a real machine.
    root: &'a Path,
    /// What ropes are simulated with.
    rope_kernel: Option<Kernel>,
    /// Free shared memory (MB).
    shared_memory_mb: Option<u64>,
    /// Free room on the disk of the current folder (MB).
    disk_mb: Option<u64>,
}

impl Machine<'static> {
    /// The one that this runs on.
    #[must_use]
    pub fn here() -> Self {
        let disk = rustix::fs::statvfs(".").ok();
        Self {
            root: Path::new("/"),
            rope_kernel: Some(Precision::F32.fastest_kernel()),
            shared_memory_mb: rt_controller::os::shared_memory_free_mb(),
            disk_mb: disk.map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize) / 1_000_000),
        }
    }
}

impl Machine<'_> {
    /// All there is to say about it.
    pub fn judge(&self) -> Vec<Finding> {
        let mut findings = self.real_time().to_vec();
        findings.extend(self.room());
        findings.push(Finding::new(
            "vector instructions",
            Verdict::warn_unless(self.rope_kernel.is_some_and(Kernel::is_single_precision)),
            match self.rope_kernel {
                None => said(""),
                Some(Kernel::ScalarF64) => "neither AVX2 with FMA nor AVX-512".to_owned(),
                Some(kernel) => format!("{} rope(s) at a time", kernel.lanes()),
            },
            "ropes are simulated one by one without them: identify and plan on another machine",
        ));
        let mut cameras = self.names("dev");
        cameras.retain(|name| name.starts_with("video"));
        findings.push(Finding::new(
            "camera",
            Verdict::warn_unless(!cameras.is_empty()),
            listed(&cameras, "no /dev/video*"),
            "plug the camera in; not needed for the simulated rig or for films",
        ));
        findings
    }

    fn real_time(&self) -> [Finding; 6] {
        let preempt_rt = self.text("sys/kernel/realtime") == "1"
            || self.text("proc/version").contains("PREEMPT_RT");
        let flavour = if preempt_rt { "" } else { "not " };
        let release = said(&self.text("proc/sys/kernel/osrelease"));
        let priority_max = self.allowed(CAP_SYS_NICE, "Max realtime priority");
        let lock_max_bytes = self.allowed(CAP_IPC_LOCK, "Max locked memory");
        let governors = self.governors();
        let isolated = self.text("sys/devices/system/cpu/isolated");
        let clock = self.text("sys/devices/system/clocksource/clocksource0/current_clocksource");
        [
            Finding::new(
                "kernel",
                Verdict::warn_unless(preempt_rt),
                format!("{release}, {flavour}PREEMPT_RT"),
                "install your distribution's PREEMPT_RT kernel; without it rare delays of milliseconds are to be expected",
            ),
            Finding::new(
                REQUIRED_OF_A_REAL_ARM[0],
                Verdict::warn_unless(priority_max >= PRIORITY),
                match priority_max {
                    u64::MAX => "any".to_owned(),
                    0 => "none".to_owned(),
                    max => format!("up to {max}"),
                },
                "put `@wag - rtprio 95` into /etc/security/limits.d/wag.conf (packaging/limits.d), join the group, log in again",
            ),
            Finding::new(
                REQUIRED_OF_A_REAL_ARM[1],
                Verdict::warn_unless(lock_max_bytes >= LOCKED_BYTES),
                match lock_max_bytes {
                    u64::MAX => "unlimited".to_owned(),
                    bytes => format!("{} MB", bytes / 1_000_000),
                },
                "put `@wag - memlock unlimited` into /etc/security/limits.d/wag.conf (packaging/limits.d), join the group, log in again",
            ),
            Finding::new(
                "frequency governor",
                Verdict::warn_unless(governors == ["performance"]),
                said(&governors.join(", ")),
                "cpupower frequency-set -g performance; on a virtual machine the host decides",
            ),
            Finding::new(
                "isolated core",
                Verdict::warn_unless(!isolated.is_empty()),
                listed(std::slice::from_ref(&isolated), "none"),
                "isolcpus=N nohz_full=N rcu_nocbs=N on the kernel's command line, cpu = N in `[real_time]` of rt-controller.toml",
            ),
            Finding::new(
                "clock source",
                Verdict::warn_unless(clock == "tsc"),
                said(&clock),
                "clocksource=tsc on the kernel's command line if the processor's counter is steady; others cost time at every reading",
            ),
        ]
    }

    fn room(&self) -> [Finding; 3] {
        let enough = |free: Option<u64>, (needed, ample): (u64, u64)| match free {
            Some(mb) if mb < needed => Verdict::Fail,
            Some(mb) if mb >= ample => Verdict::Pass,
            _ => Verdict::Warn,
        };
        let free = |mb: Option<u64>| mb.map_or_else(|| said(""), |mb| format!("{mb} MB free"));
        let dead = self.dead_runs();
        [
            Finding::new(
                "shared memory",
                enough(self.shared_memory_mb, SHARED_MEMORY_MB),
                free(self.shared_memory_mb),
                "mount -o remount,size=1G /dev/shm; for a container --shm-size=1g",
            ),
            Finding::new(
                "leftovers of dead runs",
                Verdict::warn_unless(dead.is_empty()),
                listed(&dead, "none"),
                "they take room but disturb nobody: rm /dev/shm/wag_run-PID_*",
            ),
            Finding::new(
                "disk",
                enough(self.disk_mb, DISK_MB),
                free(self.disk_mb),
                "make room, or name another folder with --out; a run with its film takes 20 to 90 MB",
            ),
        ]
    }

    /// A file's text without its line end; empty where there is none.
    fn text(&self, path: &str) -> String {
        let text = std::fs::read_to_string(self.root.join(path)).unwrap_or_default();
        text.trim().to_owned()
    }

    /// Names in a folder, in alphabetical order.
    fn names(&self, folder: &str) -> Vec<String> {
        let entries = self.root.join(folder).read_dir().into_iter().flatten();
        let names = entries.flatten().map(|entry| entry.file_name());
        let mut names: Vec<String> = names.filter_map(|name| name.into_string().ok()).collect();
        names.sort_unstable();
        names
    }

    /// What this process may take: without bound by a capability, else a soft limit.
    fn allowed(&self, capability: u32, limit: &str) -> u64 {
        let value = |path: &str, key: &str| {
            let text = self.text(path);
            let rest = text.lines().find_map(|line| line.strip_prefix(key));
            rest.and_then(|rest| Some(rest.split_whitespace().next()?.to_owned()))
        };
        let capabilities = value("proc/self/status", "CapEff:");
        let capabilities = capabilities.and_then(|hex| u64::from_str_radix(&hex, 16).ok());
        if (capabilities.unwrap_or(0) >> capability) & 1 == 1 {
            return u64::MAX;
        }
        match value("proc/self/limits", limit).as_deref() {
            Some("unlimited") => u64::MAX,
            number => number.and_then(|n| n.parse().ok()).unwrap_or(0),
        }
    }

    /// Frequency governors in use, each once.
    fn governors(&self) -> Vec<String> {
        const CPUS: &str = "sys/devices/system/cpu";
        let cpus = self.names(CPUS).into_iter();
        let mut governors: Vec<String> = cpus
            .map(|cpu| self.text(&format!("{CPUS}/{cpu}/cpufreq/scaling_governor")))
            .filter(|governor| !governor.is_empty())
            .collect();
        governors.sort_unstable();
        governors.dedup();
        governors
    }

    /// Domains `run-PID` in shared memory without a process PID.
    fn dead_runs(&self) -> Vec<String> {
        let of = |name: &String| {
            let rest = name.strip_prefix("wag_run-")?;
            let pid = rest.split_once(|c: char| !c.is_ascii_digit())?.0;
            let gone = !pid.is_empty() && !self.root.join("proc").join(pid).exists();
            gone.then(|| format!("run-{pid}"))
        };
        let mut dead: Vec<String> = self.names("dev/shm").iter().filter_map(of).collect();
        dead.dedup();
        dead
    }
}

/// What the system says, if anything.
fn said(text: &str) -> String {
    let silent = "the system does not say";
    if text.is_empty() { silent } else { text }.to_owned()
}

/// The first names with commas between them, or that there are none.
fn listed(names: &[String], none: &str) -> String {
    const SHOWN: usize = 4;
    let shown = names.get(..SHOWN).unwrap_or(names).join(", ");
    match names.len().saturating_sub(SHOWN) {
        _ if shown.is_empty() => none.to_owned(),
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The files of a machine that is set up, each with its text.
    const GOOD: &str = "
        proc/sys/kernel/osrelease = 6.1.0-rt
        proc/version = Linux version 6.1 #1 SMP PREEMPT_RT
        proc/self/status = CapEff: 0000000000004000
        proc/self/limits = Max realtime priority     95       95
        sys/devices/system/cpu/cpu0/cpufreq/scaling_governor = performance
        sys/devices/system/cpu/cpu1/cpufreq/scaling_governor = performance
        sys/devices/system/cpu/isolated = 1
        sys/devices/system/clocksource/clocksource0/current_clocksource = tsc
        dev/video0 =
        dev/null =
        proc/77/stat =
        dev/shm/wag_run-77_abc.dynamic =
        dev/shm/wag_run-x_def.data =";
    /// What is changed of it, and what alone is not a pass then.
    const WORSE: &str = "
        proc/version = Linux => kernel: 6.1.0-rt, not PREEMPT_RT
        proc/self/limits = Max realtime priority 79 => real-time priority: up to 79
        proc/self/status = CapEff: 0 => memory lock: 0 MB
        sys/devices/system/cpu/cpu1/cpufreq/scaling_governor = powersave => frequency governor: performance, powersave
        sys/devices/system/cpu/isolated = => isolated core: none
        sys/devices/system/clocksource/clocksource0/current_clocksource = hpet => clock source: hpet
        dev/shm/wag_run-78_a.data = => leftovers of dead runs: run-78";

    /// What is found on the good machine with a file changed and something else worse.
    fn findings(changed: &str, worsen: impl Fn(&mut Machine<'_>)) -> Vec<Finding> {
        let root = tempfile::tempdir().unwrap();
        for line in GOOD.lines().chain([changed]).skip(1) {
            let (path, text) = line.split_once('=').unwrap();
            let path = root.path().join(path.trim());
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, format!("{}\n", text.trim())).unwrap();
        }
        let mut machine = Machine {
            root: root.path(),
            rope_kernel: Some(Kernel::Avx2F32),
            shared_memory_mb: Some(1000),
            disk_mb: Some(50_000),
        };
        worsen(&mut machine);
        let findings = machine.judge();
        for f in &findings {
            assert_eq!(f.remedy.is_empty(), f.verdict == Verdict::Pass, "{f:?}");
            assert!(!f.found.is_empty(), "{f:?}");
        }
        findings
    }

    /// The only finding that is not a pass.
    fn wrong(changed: &str, worsen: impl Fn(&mut Machine<'_>)) -> Finding {
        let mut wrong = findings(changed, worsen);
        wrong.retain(|f| f.verdict != Verdict::Pass);
        assert_eq!(wrong.len(), 1, "{wrong:?}");
        wrong.remove(0)
    }

    #[test]
    fn of_many_names_the_first_are_listed() {
        let names = ["a", "b", "c", "d", "e", "f"].map(String::from);
        assert_eq!(listed(&names, "none"), "a, b, c, d and 2 more");
        assert_eq!(listed(&names[..4], "none"), "a, b, c, d");
        assert_eq!(listed(&[], "none"), "none");
    }

    #[test]
    fn each_file_is_judged_by_itself() {
        let all = findings("dev/zero =", |_| ());
        let found: Vec<_> = all.iter().map(|f| f.found.as_str()).collect();
        let expected = "6.1.0-rt, PREEMPT_RT; up to 95; unlimited; performance; 1; tsc; \
                        1000 MB free; none; 50000 MB free; 8 rope(s) at a time; video0";
        assert_eq!(found.join("; "), expected);
        assert!(all.iter().all(|f| f.verdict == Verdict::Pass), "{all:?}");
        for line in WORSE.lines().skip(1) {
            let (changed, expected) = line.split_once(" => ").unwrap();
            let wrong = wrong(changed, |_| ());
            assert_eq!(format!("{}: {}", wrong.name, wrong.found), expected);
            assert_eq!(wrong.verdict, Verdict::Warn, "{expected}");
        }
    }

    #[test]
    fn room_vectors_and_silence_are_judged() {
        type Case = (fn(&mut Machine<'_>), &'static str, Verdict);
        let scalar = |m: &mut Machine<'_>| m.rope_kernel = Some(Kernel::ScalarF64);
        let full = |m: &mut Machine<'_>| m.shared_memory_mb = Some(64);
        let cases: [Case; 4] = [
            (scalar, "vector instructions", Verdict::Warn),
            (full, "shared memory", Verdict::Fail),
            (|m| m.disk_mb = Some(500), "disk", Verdict::Warn),
            (|m| m.disk_mb = Some(50), "disk", Verdict::Fail),
        ];
        for (worsen, name, verdict) in cases {
            let wrong = wrong("dev/zero =", worsen);
            assert_eq!((wrong.name, wrong.verdict), (name, verdict));
        }
        // A machine that says nothing has neither passed nor failed, but has no leftovers.
        let mut silent = findings("dev/zero =", |m| {
            m.root = Path::new("/nowhere");
            (m.rope_kernel, m.shared_memory_mb, m.disk_mb) = (None, None, None);
        });
        silent.retain(|f| f.verdict != Verdict::Warn);
        let silent: Vec<_> = silent.iter().map(|f| (f.name, f.verdict)).collect();
        assert_eq!(silent, [("leftovers of dead runs", Verdict::Pass)]);
    }
}
