//! Shards as tasks of a HyperQueue server, which gives those of a worker that is lost to another.

use super::engine::Engine;
use super::shards::Shards;
use crate::args::SubmitArgs;
use anyhow::{Context, bail};
use serde_json::json;
use std::fs::File;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// HyperQueue's own client in Python does it: the server's protocol is nobody else's.
const CLIENT: &str = include_str!("hyperqueue.py");

/// Tasks of the server in the folder `HQ_SERVER_DIR`, or the user's own server without it.
/// Dropped, tasks that no worker has begun make nothing; those begun end by themselves.
#[derive(Debug)]
pub struct HyperQueue {
    python: PathBuf,
    threads: u16,
    log: PathBuf,
    client: Option<Child>,
}

impl HyperQueue {
    /// For shards in `folder`.
    pub fn new(folder: &Path, args: &SubmitArgs) -> Self {
        Self {
            python: args.python.clone(),
            threads: args.threads,
            log: folder.join("hyperqueue.log"),
            client: None,
        }
    }

    fn failed(&self) -> anyhow::Error {
        let cause = super::last_line(&self.log);
        let remedy = if cause.contains("ModuleNotFoundError") {
            let python = self.python.display();
            format!(
                "install the package hyperqueue for `{python}` (pip install hyperqueue), in the server's version, or name another by --python"
            )
        } else {
            "does a server run, of the package's version, in the folder HQ_SERVER_DIR, or in ~/.hq-server without it?".to_owned()
        };
        let log = self.log.display();
        anyhow::anyhow!(
            "HyperQueue's client failed: {cause}; {remedy} All that it said is in `{log}`"
        )
    }
}

impl Engine for HyperQueue {
    fn submit(&mut self, shards: &Shards, numbers: &[u64]) -> anyhow::Result<()> {
        let log = File::options()
            .create(true)
            .append(true)
            .open(&self.log)
            .with_context(|| format!("`{}`", self.log.display()))?;
        let tasks: Vec<_> = numbers.iter().map(|n| (*n, shards.log(*n))).collect();
        let given = json!({
            "script": shards.script(), "token": shards.token(), "threads": self.threads,
            "shards": tasks,
        });
        // Ctrl-C is this program's to answer.
        let mut command = Command::new(&self.python);
        command.args(["-c", CLIENT]).process_group(0);
        command.stdin(Stdio::piped());
        command.stdout(log.try_clone()?).stderr(log);
        let mut client = command
            .spawn()
            .with_context(|| format!("cannot start `{}` (--python)", self.python.display()))?;
        // It stays open: by its end the client knows that this program has ended.
        if let Some(input) = &mut client.stdin {
            // A client that has ended has said why in its log.
            let _ = writeln!(input, "{given}");
        }
        self.client = Some(client);
        Ok(())
    }

    fn is_over(&mut self, _shards: &Shards) -> anyhow::Result<bool> {
        let Some(client) = &mut self.client else {
            return Ok(true);
        };
        let Some(status) = client.try_wait()? else {
            return Ok(false);
        };
        self.client = None;
        if !status.success() {
            bail!(self.failed());
        }
        Ok(true)
    }
}

impl Drop for HyperQueue {
    fn drop(&mut self) {
        if let Some(client) = &mut self.client {
            // It may have ended by itself.
            let _ = client.kill();
            let _ = client.wait();
        }
    }
}
