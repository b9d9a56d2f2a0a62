//! `wag rig` as in a terminal of its own: a simulated arm and a camera that whoever throws did not
//! start.

use anyhow::{Context, anyhow};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Deserializer, Value};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running rig with a hidden rope and a camera; it ends with this value.
#[derive(Debug)]
pub struct Rig {
    process: Child,
    reported: Value,
    domain: String,
}

impl Rig {
    /// Starts it on free ports and waits until it serves.
    pub fn start(wag: &Path, seed: u64) -> anyhow::Result<Self> {
        let domain = format!("figures-{}-{seed}", std::process::id());
        let seed = seed.to_string();
        let process = Command::new(wag)
            .args(["rig", "--json", "--rope", "random", "--seed", &seed])
            .args(["--command-port", "0", "--report-ports", "0,0,0,0"])
            .args([
                "--camera",
                &domain,
                "--parent",
                &std::process::id().to_string(),
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot run `{}`", wag.display()))?;
        let mut rig = Self {
            process,
            reported: Value::Null,
            domain,
        };
        let stdout = rig.process.stdout.take().context("the rig has no output")?;
        let mut objects = Deserializer::from_reader(stdout).into_iter();
        rig.reported = objects.next().unwrap_or(Ok(Value::Null))?;
        Ok(rig)
    }

    /// Arguments of a command for its arm and its camera.
    pub fn arguments(&self) -> anyhow::Result<Vec<String>> {
        let port = |pointer: &str| {
            let port = self.reported.pointer(pointer).and_then(Value::as_u64);
            port.map(|p| p.to_string()).with_context(|| {
                anyhow!(
                    "the rig did not start (`wag rig` says why): no `{pointer}` in {}",
                    self.reported
                )
            })
        };
        let mut arguments = vec!["--arm".to_owned(), "127.0.0.1".to_owned()];
        for (name, pointer) in [
            ("--command-port", "/command_port"),
            ("--report-port", "/report_ports/0"),
            ("--status-port", "/report_ports/2"),
        ] {
            arguments.extend([name.to_owned(), port(pointer)?]);
        }
        arguments.extend(["--camera".to_owned(), self.domain.clone()]);
        Ok(arguments)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // In order, so that its shared memory goes with it.
        if let Some(pid) = Pid::from_raw(self.process.id().cast_signed()) {
            let _ = kill_process(pid, Signal::TERM);
        }
        let _ = self.process.wait();
    }
}
