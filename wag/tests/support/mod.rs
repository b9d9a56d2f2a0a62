//! `wag` as its users start it, and a simulated arm to start it against.
#![allow(dead_code, reason = "each test uses a part")]

use serde_json::Value;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

/// A command that hears nothing and whose words are kept.
pub(crate) fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wag"));
    command
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs `wag` to its end.
pub(crate) fn wag(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

/// What it said to people.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a command that must succeed; what `--json` prints.
pub(crate) fn json(args: &[&str]) -> Value {
    let output = wag(&[args, &["--json"]].concat());
    let said = said(&output);
    assert!(output.status.success(), "wag {}: {said}", args.join(" "));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// `wag rig` on free ports; it ends with the test.
pub(crate) struct Rig {
    process: Child,
    /// What it printed as JSON, which is all it ever prints there.
    pub(crate) told: Value,
}

impl Rig {
    pub(crate) fn start(more: &[&str]) -> Self {
        let free = [
            "rig",
            "--json",
            "--command-port",
            "0",
            "--report-ports",
            "0,0,0,0",
        ];
        let mut process = command(&[&free, more].concat())
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        // The object ends with a brace at the begin of a line.
        let (mut text, mut byte) = (Vec::new(), [0]);
        while !text.ends_with(b"\n}\n") {
            process
                .stdout
                .as_mut()
                .unwrap()
                .read_exact(&mut byte)
                .unwrap();
            text.push(byte[0]);
        }
        Self {
            process,
            told: serde_json::from_slice(&text).unwrap(),
        }
    }

    /// Command port, then those of the four reports.
    pub(crate) fn ports(&self) -> [String; 5] {
        let report = |n: usize| self.told["report_ports"][n].to_string();
        let command = self.told["command_port"].to_string();
        [command, report(0), report(1), report(2), report(3)]
    }

    /// `wag wiggle` on it, into `run`, from the folder that `run` lies in.
    pub(crate) fn wiggle(&self, run: &Path) -> Child {
        let [port, joints, _, rich, _] = self.ports();
        command(&["wiggle", "--arm", "localhost", "--command-port", &port])
            .args(["--report-port", &joints, "--status-port", &rich, "--out"])
            .arg(run)
            .current_dir(run.parent().unwrap())
            .spawn()
            .unwrap()
    }

    /// Ends it as Ctrl-C does; returns its exit code and what else it printed.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let pid = self.process.id().to_string();
        let status = Command::new("kill").args(["-INT", &pid]).status().unwrap();
        assert!(status.success());
        let mut rest = String::new();
        self.process
            .stdout
            .take()
            .unwrap()
            .read_to_string(&mut rest)
            .unwrap();
        (self.process.wait().unwrap().code(), rest)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
