//! The simulated rig of a studio without an arm: one rope hangs there until another is wanted.

use crate::child;
use anyhow::{Context, bail, ensure};
use serde_json::Value;
use shared_types::Task;
use std::io::{BufRead, BufReader, Read};
use std::process::Child;
use std::sync::mpsc::channel;
use std::time::Duration;

/// How long it may take to come up, and to end.
const STARTUP: Duration = Duration::from_secs(20);
const GRACE: Duration = Duration::from_secs(5);
/// Most bytes of what it says when it comes up.
const ANNOUNCEMENT_MAX: u64 = 1 << 16;

#[derive(Debug)]
pub(crate) struct Rig {
    child: Child,
    /// Arguments of `wag run` that name its arm and its camera.
    pub(crate) reached_by: Vec<String>,
    pub(crate) seed: u64,
    pub(crate) task: Task,
}

/// The shared-memory domain of a studio's rig.
pub(crate) fn domain() -> String {
    format!("studio-{}", std::process::id())
}

impl Rig {
    /// Starts one whose camera sees what `task` needs, with the arguments `of_all` commands;
    /// returns once its arm listens.
    ///
    /// # Errors
    /// It does not come up; its own words say why.
    pub(crate) fn start(seed: u64, task: Task, of_all: &[String]) -> anyhow::Result<Self> {
        let camera = domain();
        let line = format!(
            "--json rig --rope random --camera {camera} --seed {seed} --task {} \
             --command-port 0 --report-ports 0,0,0,0 --parent {}",
            task.name(),
            std::process::id()
        );
        let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        words.extend_from_slice(of_all);
        let mut child = child::start(&words)?;
        let (Some(stdout), Some(stderr)) = (child.stdout.take(), child.stderr.take()) else {
            bail!("the rig has no streams");
        };
        let (sender, announced) = channel();
        std::thread::spawn(move || {
            let mut lines = BufReader::new(stdout.take(ANNOUNCEMENT_MAX)).lines();
            let mut text = String::new();
            // The object ends with a brace at the begin of a line.
            while let Some(Ok(line)) = lines.next() {
                text.push_str(&line);
                if line == "}" {
                    break;
                }
            }
            let _ = sender.send(text);
        });
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                tracing::info!("rig: {line}");
            }
        });
        let mut rig = Self {
            child,
            reached_by: Vec::new(),
            seed,
            task,
        };
        let text = announced
            .recv_timeout(STARTUP)
            .context("the simulated rig does not come up")?;
        let said: Value = serde_json::from_str(&text)
            .with_context(|| format!("the simulated rig does not come up: {text}"))?;
        ensure!(
            said["ok"] == true,
            "the simulated rig does not come up: {}",
            said["error"]
        );
        let reported = &said["report_ports"];
        let (command, joints, status) = (&said["command_port"], &reported[0], &reported[2]);
        let reached_by = format!(
            "--arm 127.0.0.1 --command-port {command} --report-port {joints} \
             --status-port {status} --camera {camera}"
        );
        rig.reached_by = reached_by.split_whitespace().map(str::to_owned).collect();
        Ok(rig)
    }

    /// Whether it still runs.
    pub(crate) fn is_there(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        child::end(&mut self.child, GRACE);
    }
}
