//! Real-time scheduling, locked memory and a core of its own for the calling
//! thread. Each thing that cannot be had is reported by itself, in words.

use serde::{Deserialize, Serialize};
use std::io::Error;

/// What the control thread asks of the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RealTimeSettings {
    /// `SCHED_FIFO` priority of the control thread, 1 to 99; the report
    /// receiver runs ten below. Absent: ordinary scheduling.
    pub priority: Option<u8>,
    /// Core to run on alone. Absent: any.
    pub cpu: Option<usize>,
    /// Lock all memory, so that no page fault can delay a cycle.
    pub lock_memory: bool,
    /// Refuse to start when any of these cannot be had, for the simulated arm too.
    pub require: bool,
    /// How long before each deadline the control thread wakes (us): it warms up
    /// the cycle and waits by looking at the clock. 0: it sleeps to the deadline.
    pub warm_up_us: u32,
}

impl Default for RealTimeSettings {
    fn default() -> Self {
        Self {
            priority: Some(80),
            cpu: None,
            lock_memory: true,
            require: false,
            warm_up_us: 300,
        }
    }
}

#[cfg(test)]
impl RealTimeSettings {
    /// An ordinary thread.
    pub(crate) fn ordinary() -> Self {
        Self {
            priority: None,
            lock_memory: false,
            warm_up_us: 0,
            ..Self::default()
        }
    }
}

/// Applies `settings` to the calling thread (memory: to the process) and
/// returns what could not be had, in words. Call it before the loop; not RT-safe.
#[must_use]
pub fn enter_real_time(settings: &RealTimeSettings) -> Vec<String> {
    let mut warnings = Vec::new();
    if settings.lock_memory
        && let Err(reason) = lock_memory()
    {
        warnings.push(format!(
            "memory is not locked ({reason}): a page fault can delay setpoints; \
             allow it with `ulimit -l unlimited` or run the controller with CAP_IPC_LOCK"
        ));
    }
    if let Some(cpu) = settings.cpu
        && let Err(reason) = run_on(&[cpu])
    {
        warnings.push(format!(
            "cannot run on core {cpu} alone ({reason}): choose a core that exists"
        ));
    }
    if let Some(priority) = settings.priority
        && let Err(reason) = set_fifo(priority)
    {
        warnings.push(format!(
            "no real-time priority {priority} ({reason}): other programs can delay setpoints; \
             allow it with `ulimit -r {priority}` or run the controller with CAP_SYS_NICE"
        ));
    }
    touch_stack();
    warnings
}

/// What a system call that gives 0 for success said.
pub(super) fn done(code: libc::c_int) -> Result<(), Error> {
    match code {
        0 => Ok(()),
        _ => Err(Error::last_os_error()),
    }
}

fn lock_memory() -> Result<(), Error> {
    // SAFETY: takes flags only and changes no memory content.
    done(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

/// `SCHED_FIFO` for the calling thread.
///
/// # Errors
/// What the system says, usually a missing privilege.
pub fn set_fifo(priority: u8) -> Result<(), Error> {
    let parameters = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: pid 0 is the calling thread; `parameters` is a valid sched_param
    // for the duration of the call.
    done(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) })
}

/// Runs the calling thread, and threads it starts later, on `cpus` only.
///
/// # Errors
/// What the system says; `InvalidInput` for a core beyond any machine's.
pub fn run_on(cpus: &[usize]) -> Result<(), Error> {
    let most = usize::try_from(libc::CPU_SETSIZE).unwrap_or_default();
    if cpus.iter().any(|cpu| *cpu >= most) {
        return Err(Error::from(std::io::ErrorKind::InvalidInput));
    }
    // SAFETY: an all-zero cpu_set_t is the empty set, by its documentation.
    let mut set: libc::cpu_set_t = unsafe { core::mem::zeroed() };
    for cpu in cpus {
        // SAFETY: `cpu` is below CPU_SETSIZE, checked above.
        unsafe { libc::CPU_SET(*cpu, &mut set) };
    }
    // SAFETY: pid 0 is the calling thread; the size is that of the set passed.
    done(unsafe { libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) })
}

/// Touches the stack the loop will use, so that its pages are there.
fn touch_stack() {
    let page = [0_u8; 256 * 1024];
    core::hint::black_box(&page);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_missing_thing_is_named() {
        let settings = RealTimeSettings {
            priority: Some(200),
            cpu: Some(1_000_000),
            ..RealTimeSettings::ordinary()
        };
        let entered = std::thread::spawn(move || enter_real_time(&settings));
        let words = entered.join().unwrap();
        assert_eq!(words.len(), 2, "{words:?}");
        assert!(words[0].contains("core 1000000") && words[1].contains("priority 200"));
    }
}
