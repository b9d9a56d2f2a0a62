//! A command of this very program as a child: how it is started, heard and ended.

use anyhow::Context;
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Starts `wag` with these arguments, in a process group of its own: Ctrl-C reaches the studio
/// alone, which then ends its children in order.
pub(crate) fn start(arguments: &[String]) -> anyhow::Result<Child> {
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
        .with_context(|| format!("cannot start `wag {}`", arguments.join(" ")))
}

/// Asks it to end, as Ctrl-C would.
pub(crate) fn interrupt(child: &Child) {
    if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        // One that has ended already is as it should be.
        let _ = kill_process(pid, Signal::INT);
    }
}

/// Waits for its end, and kills it after `patience`.
pub(crate) fn end(child: &mut Child, patience: Duration) {
    interrupt(child);
    let began = Instant::now();
    while matches!(child.try_wait(), Ok(None)) {
        if began.elapsed() >= patience {
            let _ = child.kill();
            let _ = child.wait();
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}
