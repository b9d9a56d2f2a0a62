//! Shards as processes of this machine.

use super::engine::Engine;
use super::shards::Shards;
use crate::args::SubmitArgs;
use anyhow::Context;
use rustix::process::{Pid, Signal, kill_process_group};
use std::collections::VecDeque;
use std::fs::File;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};

/// Processes of this machine, so many at once, each in a group of its own. Dropped, they are
/// told to end, and waited for: they keep what they have made.
#[derive(Debug)]
pub struct Local {
    workers: usize,
    waiting: VecDeque<u64>,
    running: Vec<Child>,
}

impl Local {
    /// For shards of these arguments.
    pub fn new(args: &SubmitArgs) -> Self {
        Self {
            workers: usize::try_from(args.workers).unwrap_or(usize::MAX),
            waiting: VecDeque::new(),
            running: Vec::new(),
        }
    }
}

impl Engine for Local {
    fn submit(&mut self, _shards: &Shards, numbers: &[u64]) -> anyhow::Result<()> {
        self.waiting.extend(numbers);
        Ok(())
    }

    /// Starts what there is room for, too.
    fn is_over(&mut self, shards: &Shards) -> anyhow::Result<bool> {
        let mut left = Vec::new();
        for mut child in self.running.drain(..) {
            if child.try_wait()?.is_none() {
                left.push(child);
            }
        }
        self.running = left;
        while self.running.len() < self.workers {
            let Some(number) = self.waiting.pop_front() else {
                break;
            };
            self.running.push(start(shards, number)?);
        }
        Ok(self.running.is_empty())
    }
}

fn start(shards: &Shards, number: u64) -> anyhow::Result<Child> {
    let path = shards.log(number);
    let log = File::options().create(true).append(true).open(&path);
    let log = log.with_context(|| format!("`{}`", path.display()))?;
    let mut command = Command::new(shards.script());
    command.arg(number.to_string()).process_group(0);
    command.stdin(Stdio::null()).stdout(log.try_clone()?);
    let child = command.stderr(log).spawn();
    child.with_context(|| format!("cannot start `{}`", shards.script().display()))
}

impl Drop for Local {
    fn drop(&mut self) {
        for child in &mut self.running {
            let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
            if let Some(group) = group {
                // It may have ended by itself.
                let _ = kill_process_group(group, Signal::TERM);
            }
            let _ = child.wait();
        }
    }
}
