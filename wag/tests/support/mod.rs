//! `wag` as its users start it, a simulated arm to start it against, and what it recorded.
#![allow(dead_code, reason = "each test uses a part")]

#[path = "../../../hil-tests/support/missing.rs"]
pub(crate) mod missing;

use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, Limits};
use camera_ingest::calib::keep_calibration;
use rt_controller::control::{ControlState, Thresholds};
use rt_controller::recording::{ChunkWriter, RecordedCycle, Snapshot};
use run_log::{Channel, McapFile, files};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use shared_types::ipc::{ControllerMode, CycleRecord};
use shared_types::plan::trajectory_hash_hex;
use shared_types::{RopeParams, StereoCamera};
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::{Duration, Instant};

static MACHINE: RwLock<()> = RwLock::new(());

/// For tests that want the whole machine, in real time: one at a time.
pub(crate) fn alone() -> RwLockWriteGuard<'static, ()> {
    MACHINE.write().unwrap_or_else(PoisonError::into_inner)
}

/// For tests that may run beside each other, but not beside one that wants to be alone.
pub(crate) fn beside_others() -> RwLockReadGuard<'static, ()> {
    MACHINE.read().unwrap_or_else(PoisonError::into_inner)
}

/// A command that hears nothing and whose words are kept; its line is split at spaces.
pub(crate) fn command(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wag"));
    command
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs `wag` to its end.
pub(crate) fn wag(line: &str) -> Output {
    command(line).output().unwrap()
}

/// The same in a folder.
pub(crate) fn wag_in(folder: &Path, line: &str) -> Output {
    command(line).current_dir(folder).output().unwrap()
}

/// What it said to people.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a child said on both streams, once it has ended as it must, with an exit code.
#[track_caller]
pub(crate) fn ended(child: Child, code: i32) -> String {
    let output = child.wait_with_output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    let said = format!("{printed}{}", said(&output));
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

/// What a child says to people up to some words and these; all there is where they never come.
pub(crate) fn heard(child: &mut Child, words: &str) -> Result<String, String> {
    let stderr = child.stderr.as_mut().unwrap();
    let (mut text, mut byte) = (Vec::new(), [0]);
    while !text.ends_with(words.as_bytes()) {
        if stderr.read(&mut byte).unwrap() == 0 {
            return Err(String::from_utf8_lossy(&text).into_owned());
        }
        text.extend(byte);
    }
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// All of these words must be in a text.
#[track_caller]
pub(crate) fn has(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "`{word}` is not in\n{text}");
    }
}

/// Runs a command that must succeed; what `--json` prints.
pub(crate) fn json(line: &str) -> Value {
    json_in(Path::new("."), line)
}

/// The same in a folder.
pub(crate) fn json_in(folder: &Path, line: &str) -> Value {
    let output = wag_in(folder, &format!("{line} --json"));
    assert!(output.status.success(), "wag {line}: {}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What a command says that gave up because other programs kept the machine busy.
const TOO_BUSY: [&str; 5] = [
    "(DeadlineMissed)",
    "(LateCycles)",
    "the machine is too busy, stop other programs",
    "planning takes too long here; stop other programs",
    "no camera frame arrived",
];

/// Whether a command gave up because other programs kept the machine busy; said aloud then.
pub(crate) fn too_busy(said: &str) -> bool {
    let busy = TOO_BUSY.iter().any(|cause| said.contains(cause));
    if busy {
        // Seen where the test passes, too.
        let _ = writeln!(std::io::stderr(), "begun again: {said}");
    }
    busy
}

/// Runs a command that moves an arm in real time and keeps its run in `out`; what `--json`
/// prints.
///
/// One that gave up because the machine was too busy is begun again, twice, its run aside;
/// a service that stopped for it is acknowledged.
pub(crate) fn moved_in(folder: &Path, line: &str, out: &str) -> Value {
    let mut line = format!("{line} --out {out} --json");
    let mut output = wag_in(folder, &line);
    for attempt in 0..2 {
        if output.status.success() || !too_busy(&said(&output)) {
            break;
        }
        let aside = folder.join(format!("{out}-{attempt}"));
        if folder.join(out).exists() {
            fs::rename(folder.join(out), aside).unwrap();
        }
        if line.contains("--controller") && !line.contains("--acknowledge") {
            line += " --acknowledge";
        }
        output = wag_in(folder, &line);
    }
    assert!(output.status.success(), "wag {line}: {}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs a command that must fail with an exit code; its error.
pub(crate) fn refused_in(folder: &Path, code: i32, line: &str) -> String {
    let output = wag_in(folder, line);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(code), "wag {line}: {said}");
    said
}

/// Runs commands that must fail with an exit code, one a line, and leave nothing behind;
/// behind `=>` are the words that must be in the one clear line of the error.
pub(crate) fn are_refused_in(folder: &Path, code: i32, cases: &str) {
    let count = || fs::read_dir(folder).unwrap().count();
    let before = count();
    for case in cases.lines().filter(|case| !case.trim().is_empty()) {
        let (line, words) = case.split_once("=>").unwrap();
        let said = refused_in(folder, code, line);
        for word in words.split('|').map(str::trim) {
            let told = said.contains(word);
            assert!(told, "wag {line}: `{word}` is not in: {said}");
        }
        for word in ["panicked", ".tmp"] {
            assert!(!said.contains(word), "wag {line}: {said}");
        }
        let errors = said.lines().filter(|l| l.starts_with("error: ")).count();
        assert_eq!(errors.max(1), 1, "wag {line}: {said}");
        assert_eq!(count(), before, "wag {line} left something");
    }
}

/// The calibration of a camera, as `camera.toml` of a folder.
pub(crate) fn calibrate(folder: &Path, camera: &StereoCamera) -> PathBuf {
    let path = folder.join("camera.toml");
    keep_calibration(&path, camera).unwrap();
    path
}

/// A throw of one second from the start pose: joints 2 and 6 go back by these (rad).
pub(crate) fn throw(back_rad: [f64; 2]) -> JointTrajectory {
    let mut end = START_POSE;
    end[1] -= back_rad[0];
    end[5] -= back_rad[1];
    let middle = (START_POSE + end) * 0.5;
    JointTrajectory::new(&[0.0, 0.5, 1.0], &[START_POSE, middle, end]).unwrap()
}

/// A plan of a motion as `plan.json` contains it.
pub(crate) fn plan_json(motion: &JointTrajectory, rope: &RopeParams) -> Value {
    json!({
        "version": "0", "seed": 5, "task": "strike", "target_m": [0.9, 0.1, 0.0],
        "rope": rope, "trajectory": motion, "predicted_error_m": 0.0125,
        "predicted_time_s": 0.9, "fitness": -1.0, "simulations": 1, "resampled": 0,
        "margins": [], "trajectory_sha256": trajectory_hash_hex(motion),
    })
}

/// A file or folder of the data beside the checkout; `None`, said aloud, where it is not
/// there.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    missing::shared(path)
}

/// Files of a domain in shared memory.
pub(crate) fn shared_memory_of(domain: &str) -> Vec<String> {
    let files = fs::read_dir("/dev/shm").unwrap().flatten();
    files
        .map(|f| f.file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(&format!("wag_{domain}_")))
        .collect()
}

/// Waits for something that comes within a time.
pub(crate) fn until<T>(what: &str, within: Duration, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < within, "{what} never came");
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub(crate) fn send(pid: u32, signal: Signal) {
    kill_process(Pid::from_raw(pid.try_into().unwrap()).unwrap(), signal).unwrap();
}

/// Processes of `wag` that belong to a run folder or have a parent, with their names.
pub(crate) fn processes_of(run_or_parent: &str) -> Vec<(u32, String)> {
    let inside = format!("{run_or_parent}/");
    let of = |entry: std::io::Result<fs::DirEntry>| {
        let pid: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let line = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let words = line.split(|b| *b == 0).map(String::from_utf8_lossy);
        let args: Vec<_> = words.collect();
        let is_of = |a: &str| a == run_or_parent || a.starts_with(&inside);
        let named = args.windows(2).find(|pair| pair[0] == "process");
        let name = named.map_or("wag", |pair| &pair[1]);
        let belongs = args.iter().skip(1).any(|a| is_of(a));
        belongs.then(|| (pid, name.to_owned()))
    };
    fs::read_dir("/proc").unwrap().filter_map(of).collect()
}

/// One of them by its name, `None` while it is not there.
pub(crate) fn process_of(run_or_parent: &str, name: &str) -> Option<u32> {
    let mut found = processes_of(run_or_parent).into_iter();
    found.find_map(|(pid, n)| (n == name).then_some(pid))
}

/// Waits until so many control cycles lie in the file of a run under way.
pub(crate) fn until_recorded(run: &Path, cycles: usize) {
    until_among(run, |recorded| recorded.len() >= cycles);
}

/// Waits until a run's recording has a cycle of a motion.
pub(crate) fn until_moving(run: &Path) {
    let moves = |cycle: &CycleRecord| ControllerMode::from_raw(cycle.mode).is_moving();
    until_among(run, |recorded| recorded.iter().any(moves));
}

fn until_among(run: &Path, are_there: impl Fn(&[CycleRecord]) -> bool) {
    until("the recording", Duration::from_secs(60), || {
        std::thread::sleep(Duration::from_millis(20));
        let recording = run_log::Run::open(run).ok()?.recording().ok()?;
        are_there(&recording.cycles().ok()?.cycles).then_some(())
    });
}

/// Records these cycles in a run folder as the controller and its recorder do.
pub(crate) fn record(run: &Path, cycles: impl IntoIterator<Item = RecordedCycle>) {
    let control = ControlState::new(Limits::default(), Thresholds::strict());
    let mut writer = ChunkWriter::default();
    let mut file = McapFile::create(&run.join(files::RUN)).unwrap();
    writer.keyframe(&Snapshot::of(&control).unwrap());
    for cycle in cycles {
        if let Some(chunk) = writer.cycle(&cycle) {
            file.bytes(Channel::Replay, 1, chunk).unwrap();
        }
    }
    if let Some(chunk) = writer.flush() {
        file.bytes(Channel::Replay, 1, chunk).unwrap();
    }
    file.finish().unwrap();
}

/// A process that is killed when dropped.
#[derive(Debug)]
pub(crate) struct Running(pub(crate) Child);

impl Running {
    /// Starts a command that prints its JSON object and goes on; that object.
    pub(crate) fn start(line: &str) -> (Self, Value) {
        let mut started = command(&format!("{line} --json"));
        let mut process = started.stderr(Stdio::inherit()).spawn().unwrap();
        // The object ends with a brace at the begin of a line.
        let (mut text, mut byte) = (Vec::new(), [0]);
        let stdout = process.stdout.as_mut().unwrap();
        while !text.ends_with(b"\n}\n") {
            stdout.read_exact(&mut byte).unwrap();
            text.push(byte[0]);
        }
        (Self(process), serde_json::from_slice(&text).unwrap())
    }

    /// Ends it in order; returns its exit code and what else it printed.
    pub(crate) fn end(&mut self, signal: Signal) -> (Option<i32>, String) {
        send(self.0.id(), signal);
        let mut rest = String::new();
        if let Some(stdout) = &mut self.0.stdout {
            stdout.read_to_string(&mut rest).unwrap();
        }
        (self.0.wait().unwrap().code(), rest)
    }

    pub(crate) fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
    }
}

/// `wag rig` on free ports; it ends with the test.
pub(crate) struct Rig {
    pub(crate) process: Running,
    /// What it printed as JSON, which is all it ever prints there.
    pub(crate) reported: Value,
}

impl Rig {
    pub(crate) fn start(more: &str) -> Self {
        let line = format!("rig --command-port 0 --report-ports 0,0,0,0 {more}");
        let (process, reported) = Running::start(&line);
        Self { process, reported }
    }

    /// Command port, then those of the four reports.
    pub(crate) fn ports(&self) -> [String; 5] {
        let report = |n: usize| self.reported["report_ports"][n].to_string();
        let command = self.reported["command_port"].to_string();
        [command, report(0), report(1), report(2), report(3)]
    }

    /// `wag wiggle` on it, into `run`, from the folder that `run` lies in.
    pub(crate) fn wiggle(&self, run: &Path) -> Child {
        let [port, joints, _, rich, _] = self.ports();
        let ports = format!("--command-port {port} --report-port {joints} --status-port {rich}");
        command(&format!("wiggle --arm localhost {ports} --out"))
            .arg(run)
            .current_dir(run.parent().unwrap())
            .spawn()
            .unwrap()
    }
}
