//! Shards as processes of this machine.

use crate::args::SubmitArgs;
use anyhow::Context;
use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Processes of this machine, so many at once.
#[derive(Debug, Default)]
pub struct Local {
    waiting: Vec<Command>,
    running: Vec<Child>,
    workers: usize,
}

impl Local {
    /// Hands over shards, each to be made by the script with its number.
    pub fn submit(
        &mut self,
        script: &Path,
        shards: &[u64],
        args: &SubmitArgs,
    ) -> anyhow::Result<()> {
        self.workers = usize::try_from(args.workers)?;
        for number in shards.iter().rev() {
            let log = script.with_file_name(format!("shard-{number}.log"));
            let log = File::create(&log).with_context(|| format!("`{}`", log.display()))?;
            let mut command = Command::new(script);
            command.arg(number.to_string()).stdin(Stdio::null());
            command.stdout(log.try_clone()?).stderr(log);
            self.waiting.push(command);
        }
        self.start()
    }

    /// Whether nothing of what was handed over is left to do, well or badly done.
    pub fn is_over(&mut self) -> anyhow::Result<bool> {
        let mut left = Vec::new();
        for mut child in self.running.drain(..) {
            if child.try_wait()?.is_none() {
                left.push(child);
            }
        }
        self.running = left;
        self.start()?;
        Ok(self.running.is_empty())
    }

    /// Waits for what still runs, and starts no more: it was interrupted as this program was, and
    /// keeps what it has made.
    pub fn cancel(&mut self) {
        self.waiting.clear();
        for child in &mut self.running {
            let _ = child.wait();
        }
    }

    fn start(&mut self) -> anyhow::Result<()> {
        while self.running.len() < self.workers {
            let Some(mut command) = self.waiting.pop() else {
                break;
            };
            let child = command.spawn().context("cannot start a shard")?;
            self.running.push(child);
        }
        Ok(())
    }
}
