//! Studies on engines that nobody here wrote: the bytes of one process, whatever is killed.
#![cfg(test)]

#[path = "../support/mod.rs"]
mod support;

mod hyperqueue;
mod slurm;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use support::report;

/// Longer than any of this takes on a slow machine.
const TIMEOUT: Duration = Duration::from_secs(180);

/// A process that does not outlive its test.
struct Daemon {
    child: Child,
    log: PathBuf,
}

impl Daemon {
    fn start(command: &mut Command, log: &Path) -> Self {
        let file = std::fs::File::create(log).unwrap();
        command
            .stdin(Stdio::null())
            .stdout(file.try_clone().unwrap());
        let child = command.stderr(file).spawn();
        Self {
            child: child.unwrap_or_else(|e| panic!("{command:?}: {e}")),
            log: log.to_owned(),
        }
    }

    /// Kills it with all that it has started, as a machine that fails would.
    fn kill(&mut self) {
        kill_with_children(self.child.id());
        self.child.wait().unwrap();
    }

    /// Waits until it is ready, which it does not live to be where something is wrong.
    fn wait_until(&mut self, is_ready: impl Fn() -> bool) {
        wait_for("a daemon", || {
            let ended = self.child.try_wait().unwrap();
            let said = || std::fs::read_to_string(&self.log).unwrap();
            assert!(ended.is_none(), "{}: {}", self.log.display(), said());
            is_ready()
        });
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn kill_with_children(pid: u32) {
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children"));
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    // It may have ended by itself.
    let _ = pid.map(|pid| kill_process(pid, Signal::KILL));
    let children = children.unwrap_or_default();
    let children = children.split_whitespace();
    children.for_each(|child| kill_with_children(child.parse().unwrap()));
}

fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < TIMEOUT, "{what}: not within {TIMEOUT:?}");
        sleep(Duration::from_millis(100));
    }
}

/// A study small enough for a test, with some work in each shard.
const STUDY: &str = "sysid --ropes 24 --seed 5 --method nn";

/// Its result file by one process.
fn by_one(dir: &Path) -> Vec<u8> {
    let path = dir.join("one.json");
    report(&format!("{STUDY} --out {}", path.display()));
    std::fs::read(path).unwrap()
}

/// A submission of the study in twelve shards that is under way.
struct Submission {
    child: Option<Child>,
    out: PathBuf,
}

impl Submission {
    fn start(dir: &Path, engine: &str, environment: (&str, &Path)) -> Self {
        let out = dir.join("all.json");
        let line = format!(
            "--json submit --engine {engine} --workers 2 --shards 12 --out {} -- {STUDY}",
            out.display()
        );
        let mut command = Command::new(env!("CARGO_BIN_EXE_experiments"));
        command.args(line.split_whitespace());
        command.env(environment.0, environment.1);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Self {
            child: Some(command.spawn().unwrap()),
            out,
        }
    }

    /// How often a shard was made to its end, or begun where it was made already.
    fn runs(out: &Path) -> usize {
        let folder = out.with_file_name("all.json.shards");
        let log = |n: u32| std::fs::read_to_string(folder.join(format!("shard-{n}.log")));
        let runs = |n| log(n).map_or(0, |said| said.matches("joins it").count());
        (1..=12).map(runs).sum()
    }

    fn marks(&self) -> usize {
        let folder = self.out.with_file_name("all.json.shards");
        let done = |n: &u32| folder.join(format!("shard-{n}.done")).exists();
        (1..=12).filter(done).count()
    }

    fn output(mut self) -> Output {
        wait_for("the submission's end", || {
            self.child.as_mut().unwrap().try_wait().unwrap().is_some()
        });
        self.child.take().unwrap().wait_with_output().unwrap()
    }

    /// What it reports, having made the bytes of `one`.
    fn report(self, one: &[u8]) -> Value {
        let out = self.out.clone();
        let output = self.output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(std::fs::read(out).unwrap() == one, "other bytes");
        serde_json::from_slice(&output.stdout).expect("standard output is JSON")
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
