//! The controller is killed in the middle of a motion: the guardian stops the
//! arm on its own connection, before it comes to rest by silence alone.
#![cfg(test)]

use rt_controller::session::ArmSession;
use rt_controller::xarm::ArmState;
use std::fs;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Five free ports: commands and four reports.
fn free_ports() -> [u16; 5] {
    let held = [(); 5].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    held.map(|l| l.local_addr().unwrap().port())
}

fn wag(args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_wag"))
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Process of a run by its name.
fn process_of(run: &Path, name: &str) -> Option<u32> {
    let run = run.display().to_string();
    fs::read_dir("/proc").unwrap().find_map(|entry| {
        let pid: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let line = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let args: Vec<_> = line
            .split(|b| *b == 0)
            .map(String::from_utf8_lossy)
            .collect();
        let is_it = args
            .windows(2)
            .any(|pair| pair[0] == "process" && pair[1] == name);
        (is_it && args.iter().any(|a| a.starts_with(&run))).then_some(pid)
    })
}

fn kill_9(pid: u32) {
    let pid = rustix::process::Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
}

fn until<T>(what: &str, within: Duration, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < within, "{what} never came");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_controller_killed_in_motion_leaves_a_stopped_arm() {
    let folder = tempfile::tempdir().unwrap();
    let [command, joints, normal, rich, real] = free_ports();
    let [command_text, joints_text, rich_text] =
        [command, joints, rich].map(|port| port.to_string());
    let reports = format!("{joints},{normal},{rich},{real}");
    let mut rig = wag(&[
        "rig",
        "--command-port",
        &command_text,
        "--report-ports",
        &reports,
    ]);
    let address: SocketAddr = ([127, 0, 0, 1], command).into();
    let ask = Duration::from_secs(2);
    let mut arm = until("the arm", Duration::from_secs(20), || {
        ArmSession::connect(address, ask).ok()
    });
    let run = folder.path().join("run");
    let run_text = run.display().to_string();
    let throw = wag(&[
        "wiggle",
        "--arm",
        "127.0.0.1",
        "--command-port",
        &command_text,
        "--report-port",
        &joints_text,
        "--status-port",
        &rich_text,
        "--out",
        &run_text,
    ]);
    // The move to the start pose is the first motion.
    until("the motion", Duration::from_secs(30), || {
        (arm.state().unwrap() == ArmState::Moving).then_some(())
    });
    let controller = until("the controller", ask, || process_of(&run, "rt-controller"));
    std::thread::sleep(Duration::from_millis(300));
    kill_9(controller);
    let killed = Instant::now();
    let bound = Duration::from_secs(2);
    until("the stop", bound, || {
        (arm.state().unwrap() == ArmState::Stopped).then_some(())
    });
    println!(
        "state 4 read {:.1} ms after SIGKILL",
        killed.elapsed().as_secs_f64() * 1e3
    );
    let said = throw.wait_with_output().unwrap();
    assert_eq!(said.status.code(), Some(1));
    let log = fs::read_to_string(run.join("log/guardian.log")).unwrap();
    assert!(log.contains("lost while the arm moved"), "{log}");
    assert!(log.contains("seen stopped"), "{log}");
    rig.kill().unwrap();
    rig.wait().unwrap();
}
