//! A HyperQueue server with two workers, of which one is killed.

use crate::support::missing;
use crate::{Daemon, Submission, by_one, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

struct Cluster {
    python: PathBuf,
    _server: Daemon,
    folder: PathBuf,
}

impl Cluster {
    fn start(dir: &Path) -> Option<Self> {
        let python = missing::named("WAG_SDK_PYTHON", "Python with hyperqueue")?;
        let python = PathBuf::from(python);
        let folder = dir.join("server");
        let mut command = script(&python);
        command.arg("server").arg(&folder);
        let mut server = Daemon::start(&mut command, &dir.join("server.log"));
        let access = folder.join("hq-current/access.json");
        server.wait_until(|| access.exists());
        Some(Self {
            python,
            _server: server,
            folder,
        })
    }

    fn worker(&self, name: &str) -> Daemon {
        let folder = self.folder.with_file_name(name);
        let log = folder.with_extension("log");
        let mut command = script(&self.python);
        command.arg("worker").arg(folder).arg(&self.folder);
        let mut worker = Daemon::start(&mut command, &log);
        let is_ready = || std::fs::read_to_string(&log).is_ok_and(|said| said.contains("ready"));
        worker.wait_until(is_ready);
        worker
    }

    fn submit(&self, dir: &Path) -> Submission {
        let engine = format!("hyperqueue --python {}", self.python.display());
        Submission::start(dir, &engine, ("HQ_SERVER_DIR", &self.folder))
    }
}

fn script(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.arg(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/clusters/cluster.py"
    ));
    command
}

#[test]
fn a_worker_that_is_killed_costs_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let Some(cluster) = Cluster::start(dir.path()) else {
        return;
    };
    let one = by_one(dir.path());
    let (mut first, _second) = (cluster.worker("first"), cluster.worker("second"));
    let submission = cluster.submit(dir.path());
    wait_for("a shard", || submission.marks() > 0);
    first.kill();
    assert!(submission.marks() < 12, "it was killed too late");
    assert_eq!(submission.report(&one)["trials"], 24);
}

#[test]
fn interrupted_what_waits_makes_nothing_and_the_same_command_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let Some(cluster) = Cluster::start(dir.path()) else {
        return;
    };
    let one = by_one(dir.path());
    let worker = cluster.worker("first");
    let submission = cluster.submit(dir.path());
    wait_for("a shard", || submission.marks() > 0);
    let pid = submission.child.as_ref().map(std::process::Child::id);
    let pid = Pid::from_raw(i32::try_from(pid.unwrap()).unwrap()).unwrap();
    kill_process(pid, Signal::INT).unwrap();
    let output = submission.output();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("the same command goes on"), "{said}");
    // Tasks that wait end in a moment each; a shard that was begun ends by itself, and may be made
    // twice.
    let again = cluster.submit(dir.path());
    let out = again.out.clone();
    assert_eq!(again.report(&one)["trials"], 24);
    let runs = Submission::runs(&out);
    assert!(runs <= 13, "{runs} runs of 12 shards");
    drop(worker);
}

#[test]
fn without_a_server_it_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let Some(python) = missing::named("WAG_SDK_PYTHON", "Python with hyperqueue") else {
        return;
    };
    let nowhere = dir.path().join("nowhere");
    let without = dir.path().join("without");
    let words =
        "#!/bin/sh\necho \"ModuleNotFoundError: No module named 'hyperqueue'\" >&2\nexit 1\n";
    std::fs::write(&without, words).unwrap();
    std::fs::set_permissions(&without, PermissionsExt::from_mode(0o755)).unwrap();
    for (python, words) in [
        (Path::new(&python), ["failed: ", "does a server run"]),
        (&without, ["No module named", "pip install hyperqueue"]),
        (Path::new("/no/python"), ["/no/python", "--python"]),
    ] {
        let engine = format!("hyperqueue --python {}", python.display());
        let output = Submission::start(dir.path(), &engine, ("HQ_SERVER_DIR", &nowhere)).output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        for word in words {
            assert!(said.contains(word), "{said} lacks {word}");
        }
        assert!(!said.contains("it said nothing"), "{said}");
    }
}
