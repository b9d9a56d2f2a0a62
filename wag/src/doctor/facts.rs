//! What the system says about itself in `/proc`, `/sys` and `/dev`.

use rope_sim::{Kernel, Precision};
use std::path::Path;

/// Capability to raise priorities, a bit of `CapEff`.
const CAP_SYS_NICE: u32 = 23;
/// Capability to lock memory.
const CAP_IPC_LOCK: u32 = 14;

/// Facts about a machine; `None` or empty where the system does not say.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Facts {
    /// Release of the kernel.
    pub kernel: String,
    /// Whether it is built with `PREEMPT_RT`.
    pub preempt_rt: bool,
    /// Highest real-time priority this process may take.
    pub priority_max: u64,
    /// Memory this process may lock (bytes).
    pub lock_max_bytes: u64,
    /// Frequency governors in use, each once.
    pub governors: Vec<String>,
    /// Isolated cores, as the kernel lists them.
    pub isolated: String,
    /// Clock source.
    pub clock: String,
    /// What ropes are simulated with.
    pub rope_kernel: Option<Kernel>,
    /// Runs of this program whose process is gone but whose shared memory is not.
    pub dead_runs: Vec<String>,
    /// Camera devices.
    pub cameras: Vec<String>,
    /// Free shared memory (MB).
    pub shared_memory_mb: Option<u64>,
    /// Free room on the disk of the current folder (MB).
    pub disk_mb: Option<u64>,
}

impl Facts {
    /// Reads what lies in files below `root`, `/` on a real machine.
    pub fn read(root: &Path) -> Self {
        let text = |path: &str| std::fs::read_to_string(root.join(path)).unwrap_or_default();
        let trimmed = |path: &str| text(path).trim().to_owned();
        let capabilities = capabilities(&text("proc/self/status"));
        let limits = text("proc/self/limits");
        let allowed = |bit, name| {
            if (capabilities >> bit) & 1 == 1 {
                u64::MAX
            } else {
                soft_limit(&limits, name)
            }
        };
        let mut governors: Vec<String> = names(&root.join("sys/devices/system/cpu"))
            .iter()
            .map(|cpu| {
                trimmed(&format!(
                    "sys/devices/system/cpu/{cpu}/cpufreq/scaling_governor"
                ))
            })
            .filter(|governor| !governor.is_empty())
            .collect();
        governors.sort_unstable();
        governors.dedup();
        Self {
            kernel: trimmed("proc/sys/kernel/osrelease"),
            preempt_rt: trimmed("sys/kernel/realtime") == "1"
                || text("proc/version").contains("PREEMPT_RT"),
            priority_max: allowed(CAP_SYS_NICE, "Max realtime priority"),
            lock_max_bytes: allowed(CAP_IPC_LOCK, "Max locked memory"),
            governors,
            isolated: trimmed("sys/devices/system/cpu/isolated"),
            clock: trimmed("sys/devices/system/clocksource/clocksource0/current_clocksource"),
            dead_runs: dead_runs(root),
            cameras: names(&root.join("dev"))
                .into_iter()
                .filter(|name| name.starts_with("video"))
                .collect(),
            rope_kernel: None,
            shared_memory_mb: None,
            disk_mb: None,
        }
    }

    /// Adds what no file tells: the processor's vectors, and the room there is.
    pub fn with_processor_and_room(self, folder: &Path) -> Self {
        Self {
            rope_kernel: Some(Precision::F32.fastest_kernel()),
            shared_memory_mb: rt_controller::os::shared_memory_free_mb(),
            disk_mb: rustix::fs::statvfs(folder)
                .ok()
                .map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize) / 1_000_000),
            ..self
        }
    }
}

/// Names in a folder, in alphabetical order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    names.sort_unstable();
    names
}

fn capabilities(status: &str) -> u64 {
    status
        .lines()
        .find_map(|line| line.strip_prefix("CapEff:"))
        .and_then(|hex| u64::from_str_radix(hex.trim(), 16).ok())
        .unwrap_or(0)
}

/// The soft limit in a line of `/proc/self/limits`.
fn soft_limit(limits: &str, name: &str) -> u64 {
    let value = limits
        .lines()
        .find_map(|line| line.strip_prefix(name))
        .and_then(|rest| rest.split_whitespace().next());
    match value {
        Some("unlimited") => u64::MAX,
        Some(number) => number.parse().unwrap_or(0),
        None => 0,
    }
}

/// Domains `run-PID` in shared memory without a process PID.
fn dead_runs(root: &Path) -> Vec<String> {
    let mut dead: Vec<String> = names(&root.join("dev/shm"))
        .iter()
        .filter_map(|name| {
            let rest = name.strip_prefix("wag_run-")?;
            let pid = rest.split_once(|c: char| !c.is_ascii_digit())?.0;
            let gone = !pid.is_empty() && !root.join("proc").join(pid).exists();
            gone.then(|| format!("run-{pid}"))
        })
        .collect();
    dead.dedup();
    dead
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn a_machine_that_is_set_up_is_read() {
        let root = machine(&[
            ("proc/sys/kernel/osrelease", "6.1.0-rt\n"),
            (
                "proc/version",
                "Linux version 6.1 #1 SMP PREEMPT_RT Debian\n",
            ),
            (
                "proc/self/status",
                "Name:\twag\nCapEff:\t0000000000004000\n",
            ),
            (
                "proc/self/limits",
                "Limit  Soft  Hard  Units\nMax locked memory  8388608  8388608  bytes\n\
                 Max realtime priority     95       95\n",
            ),
            (
                "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor",
                "performance\n",
            ),
            (
                "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
                "powersave\n",
            ),
            ("sys/devices/system/cpu/isolated", "1\n"),
            (
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "tsc\n",
            ),
            ("dev/video0", ""),
            ("proc/77/stat", ""),
            ("dev/shm/wag_run-77_abc.dynamic", ""),
            ("dev/shm/wag_run-78_abc.dynamic", ""),
            ("dev/shm/wag_run-78_def.data", ""),
            ("dev/shm/wag_run-x_def.data", ""),
        ]);
        let found = Facts::read(root.path());
        assert_eq!(found.kernel, "6.1.0-rt");
        assert!(found.preempt_rt);
        assert_eq!(found.priority_max, 95);
        assert_eq!(found.lock_max_bytes, u64::MAX, "by its capability");
        assert_eq!(found.governors, ["performance", "powersave"]);
        assert_eq!(
            (found.isolated.as_str(), found.clock.as_str()),
            ("1", "tsc")
        );
        assert_eq!(found.cameras, ["video0"]);
        assert_eq!(found.dead_runs, ["run-78"]);
    }

    #[test]
    fn a_machine_that_says_nothing_has_nothing() {
        assert_eq!(Facts::read(machine(&[]).path()), Facts::default());
    }
}
