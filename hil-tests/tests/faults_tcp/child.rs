//! The processes of a stand: this very program again, told by its environment
//! what to be. A child ends when its parent is gone or closes its input.

use rt_controller::ControllerConfig;
use shared_types::ipc::{Bus, OperatorEnd};
use std::fs::File;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The child's role.
const ROLE: &str = "WAG_TEST_CHILD_ROLE";
/// Its configuration, as TOML; for a subscriber the domain.
const CONFIG: &str = "WAG_TEST_CHILD_CONFIG";

/// What a child is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The real-time controller.
    Controller,
    /// The guardian.
    Guardian,
    /// An operator who beats and does nothing else.
    Operator,
    /// A viewer that attaches to everything and takes in what comes.
    Viewer,
    /// A recorder that attaches and never takes anything in.
    Sleeper,
}

/// The test that a child runs.
const CHILD: &str = "child::is_what_it_is_told_to_be";

/// A child; it is asked to end, then made to, when dropped.
#[derive(Debug)]
pub struct Process {
    child: Child,
    input: Option<ChildStdin>,
    log: PathBuf,
}

impl Process {
    /// Starts a child that logs into a file named after `name` and its role.
    pub fn start(role: Role, name: &str, config: &str) -> Self {
        Self::of(this_program(), role, name, config).unwrap()
    }

    /// The same as another user; `None` when that user may not run this program.
    pub fn start_as_nobody(role: Role, name: &str, config: &str) -> Option<Self> {
        const NOBODY: u32 = 65_534;
        let mut command = this_program();
        command.uid(NOBODY).gid(NOBODY);
        Self::of(command, role, name, config).ok()
    }

    /// Starts the controller where shared memory has room for 16 MB only; `None`
    /// where no such place can be made, which takes the superuser.
    pub fn start_with_little_room(name: &str, config: &str) -> Option<Self> {
        const SMALL: &str = "mount -t tmpfs -o size=16m tmpfs /dev/shm";
        let this = std::env::current_exe().ok()?;
        let place = |then: &str| {
            let mut command = Command::new("unshare");
            command.args(["-m", "sh", "-c", &format!("{SMALL} && {then}")]);
            command
        };
        let can = place("true").stderr(Stdio::null()).status().ok()?;
        if !can.success() {
            return None;
        }
        let command = place(&format!(
            "exec '{}' --exact {CHILD} --nocapture",
            this.display()
        ));
        Self::of(command, Role::Controller, name, config).ok()
    }

    fn of(mut command: Command, role: Role, name: &str, config: &str) -> std::io::Result<Self> {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let log = folder.join(format!("{name}-{role:?}.log"));
        command
            .env(ROLE, format!("{role:?}"))
            .env(CONFIG, config)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(File::create(&log)?);
        let mut child = command.spawn()?;
        Ok(Self {
            input: child.stdin.take(),
            child,
            log,
        })
    }

    /// Waits until it ends by itself; its exit code.
    pub fn wait(&mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }

    /// What it logged.
    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// SIGKILL.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Asks it to end and waits.
    pub fn end(&mut self) {
        drop(self.input.take());
        let began = Instant::now();
        while self.child.try_wait().unwrap().is_none() {
            if began.elapsed() > Duration::from_secs(10) {
                self.kill();
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
    }
}

fn this_program() -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", CHILD, "--nocapture"]);
    command
}

/// Not a test by itself, where no environment says what to be.
#[test]
fn is_what_it_is_told_to_be() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    static STOP: AtomicBool = AtomicBool::new(false);
    let config = std::env::var(CONFIG).unwrap();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .init();
    std::thread::spawn(|| {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        STOP.store(true, Ordering::SeqCst);
    });
    let bus = || Bus::join(&config).unwrap();
    match role.as_str() {
        "Controller" => tell(&rt_controller::run(toml::from_str(&config).unwrap(), &STOP)),
        "Guardian" => {
            let config: ControllerConfig = toml::from_str(&config).unwrap();
            tell(&rt_controller::guardian::run(&config, &STOP));
        }
        "Operator" => {
            let mut operator = OperatorEnd::take(&bus()).unwrap();
            until(&STOP, Duration::from_millis(5), || operator.beat());
        }
        "Viewer" => {
            let bus = bus();
            let (cycles, joints) = (
                bus.cycle_subscriber().unwrap(),
                bus.joint_subscriber().unwrap(),
            );
            until(&STOP, Duration::from_millis(1), || {
                while cycles.receive().unwrap().is_some() {}
                while joints.receive().unwrap().is_some() {}
            });
        }
        "Sleeper" => {
            let bus = bus();
            let _cycles = bus.cycle_subscriber().unwrap();
            let _chunks = bus.chunk_subscriber().unwrap();
            let _joints = bus.joint_subscriber().unwrap();
            until(&STOP, Duration::from_millis(10), || ());
        }
        other => panic!("{other} is no role"),
    }
}

/// Says why a process could not do its work, as its program would.
fn tell(end: &Result<(), rt_controller::ControllerError>) {
    if let Err(error) = end {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// Does something again and again, with a pause between.
fn until(stop: &AtomicBool, pause: Duration, mut work: impl FnMut()) {
    while !stop.load(Ordering::SeqCst) {
        work();
        std::thread::sleep(pause);
    }
}
