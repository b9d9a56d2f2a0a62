//! Child processes: started with a log file each, watched, ended without
//! leaving any behind.
//!
//! Each child runs in a process group of its own, so that Ctrl-C reaches only
//! the supervisor, which then ends the children in order. A child whose parent
//! is gone ends itself.

use anyhow::{Context, anyhow};
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How long a child may take to end itself after it was asked.
const GRACE: Duration = Duration::from_millis(1500);
/// The same for a child that may have to brake an arm first, and to confirm its stop.
const BRAKE_GRACE: Duration = Duration::from_millis(8000);

/// A process of this very program.
#[derive(Debug)]
pub struct ProcessSpec {
    /// Name, as `wag process NAME` knows it.
    pub name: &'static str,
    /// Its configuration file.
    pub config: PathBuf,
    /// Whether it holds an arm: it ends before everything the arm may need.
    pub holds_arm: bool,
}

#[derive(Debug)]
struct Running {
    name: &'static str,
    child: Child,
    log: PathBuf,
    holds_arm: bool,
}

/// Owns child processes; ends them when dropped.
#[derive(Debug, Default)]
pub struct Supervisor {
    children: Vec<Running>,
}

fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        (None, None) => "ended".to_owned(),
    }
}

/// The last line a process logged, for its epitaph.
fn last_words(log: &Path) -> String {
    let text = std::fs::read_to_string(log).unwrap_or_default();
    match text.lines().rev().find(|l| !l.trim().is_empty()) {
        Some(line) => format!("; its last words: {}", line.trim()),
        None => String::new(),
    }
}

impl Supervisor {
    /// Starts a process of this very program, logging to `log_folder/NAME.log`.
    pub fn start(&mut self, spec: &ProcessSpec, log_folder: &Path) -> anyhow::Result<()> {
        let program = std::env::current_exe().context("cannot find this program's own file")?;
        let log = log_folder.join(format!("{}.log", spec.name));
        let file =
            File::create(&log).with_context(|| format!("cannot write `{}`", log.display()))?;
        let child = Command::new(program)
            .args(["process", spec.name, "--config"])
            .arg(&spec.config)
            .arg("--parent")
            .arg(std::process::id().to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(file)
            .process_group(0)
            .spawn()
            .with_context(|| format!("cannot start the {} process", spec.name))?;
        tracing::debug!(name = spec.name, pid = child.id(), "started");
        self.children.push(Running {
            name: spec.name,
            child,
            log,
            holds_arm: spec.holds_arm,
        });
        Ok(())
    }

    /// Fails when any child has ended on its own.
    pub fn check(&mut self) -> anyhow::Result<()> {
        self.check_those(|_| true)
    }

    /// Fails when a child that holds the arm has ended on its own.
    pub fn check_arm(&mut self) -> anyhow::Result<()> {
        self.check_those(|running| running.holds_arm)
    }

    fn check_those(&mut self, which: impl Fn(&Running) -> bool) -> anyhow::Result<()> {
        for running in self.children.iter_mut().filter(|r| which(r)) {
            if let Some(status) = running
                .child
                .try_wait()
                .context("cannot watch a child process")?
            {
                return Err(bad_end(running, &describe(status)));
            }
        }
        Ok(())
    }

    /// Asks every child to end and kills what does not: first those that hold an
    /// arm, then the others, each time last started first.
    pub fn stop(&mut self) {
        let (arm, others) = self.children.drain(..).partition(|child| child.holds_arm);
        // How they end does not matter any more.
        let _ = end_together(arm, BRAKE_GRACE);
        let _ = end_together(others, GRACE);
    }

    /// Asks every child to end and gives them `grace` to finish their work. Fails
    /// when one of them did not.
    pub fn finish(&mut self, grace: Duration) -> anyhow::Result<()> {
        end_together(self.children.drain(..).collect(), grace)
    }
}

/// Why a child that has ended, or had to be ended, is not what was wished for.
fn bad_end(running: &Running, how: &str) -> anyhow::Error {
    anyhow!(
        "the {} process {how}{} (log: `{}`)",
        running.name,
        last_words(&running.log),
        running.log.display()
    )
}

/// Ends all of them, whatever happens; the error is the first bad end.
fn end_together(mut children: Vec<Running>, grace: Duration) -> anyhow::Result<()> {
    for running in children.iter_mut().rev() {
        if matches!(running.child.try_wait(), Ok(None))
            && let Some(pid) = i32::try_from(running.child.id())
                .ok()
                .and_then(Pid::from_raw)
        {
            let _ = kill_process(pid, Signal::TERM);
        }
    }
    let requested = Instant::now();
    let mut first_bad = Ok(());
    for mut running in children.into_iter().rev() {
        loop {
            match running.child.try_wait() {
                Ok(None) if requested.elapsed() < grace => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Ok(None) => {
                    tracing::warn!(name = running.name, "did not end in time and is killed");
                    let _ = running.child.kill();
                    let _ = running.child.wait();
                    first_bad = first_bad.and(Err(bad_end(&running, "did not end in time")));
                    break;
                }
                Ok(Some(status)) if !status.success() => {
                    first_bad = first_bad.and(Err(bad_end(&running, &describe(status))));
                    break;
                }
                Ok(Some(_)) | Err(_) => break,
            }
        }
    }
    first_bad
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        self.stop();
    }
}
