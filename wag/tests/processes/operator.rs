//! What the operator at the terminal can do: Ctrl-C, and stops by standard input.

use super::shell::{arm, on_arm, recorded};
use crate::support::{beside_others, ended, has, heard, refused_in, send, until};
use arm_model::response::{Estimate, JointResponse, TrackingLag};
use arm_model::{ArmResponse, JOINTS};
use rustix::process::Signal;
use serde_json::Value;
use shared_types::FaultCode;
use shared_types::ipc::{ControllerMode, CycleRecord};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use xarm_sim::SimulatedArm;

/// Speed of a motion under way; the move to the pose before it is slower
/// (rad/s).
const AT_SPEED_RAD_S: f64 = 0.4;

/// Waits until the wiggle is at speed.
fn wait_for_speed(arm: &SimulatedArm) {
    until("the motion", Duration::from_secs(60), || {
        let sample = arm.history().latest()?;
        (sample.state.qd.max_abs() > AT_SPEED_RAD_S).then_some(())
    });
}

/// The command has failed, said so, braked the arm gently and left it standing.
fn was_braked(arm: &SimulatedArm, child: Child, run: &Path, fault: FaultCode) {
    let said = ended(child, 1);
    let standing = arm.history().latest().unwrap().state.qd.max_abs();
    assert!(standing < 2e-3, "{standing} rad/s: {said}");
    let (cycles, causes) = recorded(run);
    let met: Vec<_> = causes
        .iter()
        .map(|c| (c.fault(), c.path, c.stop_arm))
        .collect();
    // Braked in joint space, and the arm left ready.
    assert_eq!(met, [(fault, 2, 0)], "{said}");
    let rest = causes[0].rest_cycle;
    let later = cycles.iter().filter(|c| c.cycle > rest && c.sent != 0);
    assert_eq!(later.count(), 0, "setpoints after the stop");
}

#[test]
fn one_ctrl_c_brakes_the_arm_and_ends_everything() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    let child = on_arm(&arm, "wiggle", &run).spawn().unwrap();
    wait_for_speed(&arm);
    send(child.id(), Signal::INT);
    was_braked(&arm, child, &run, FaultCode::OperatorStop);
}

#[test]
fn closing_standard_input_lets_go_of_the_dead_man_switch() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    let mut child = on_arm(&arm, "wiggle --dead-man", &run)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_speed(&arm);
    drop(child.stdin.take());
    was_braked(&arm, child, &run, FaultCode::DeadManReleased);
}

#[test]
fn a_dead_man_switch_that_is_not_held_moves_nothing() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    // Standard input is at its end from the beginning.
    let child = on_arm(&arm, "wiggle --dead-man", &run).spawn().unwrap();
    has(&ended(child, 1), &["DeadManReleased"]);
    let (cycles, _) = recorded(&run);
    let still = cycles.iter().all(|c| c.trajectory_s < 0.0);
    assert!(still, "no motion began");
}

/// Reads what a child says to people up to `words`.
fn read_until(child: &mut Child, words: &str) {
    heard(child, words).unwrap();
}

/// A wiggle that asks as a real arm's does, answered by `word` in the start pose; what it said
/// until it ended with an exit code.
fn rehearsed(run: &Path, word: &str, code: i32) -> String {
    let arm = arm();
    let mut command = on_arm(&arm, "wiggle --ask --yes --operator Ada", run);
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    read_until(&mut child, "type WIGGLE ");
    let mut stdin = child.stdin.take().unwrap();
    writeln!(stdin, "{word}").unwrap();
    let said = ended(child, code);
    drop(stdin);
    said
}

#[test]
fn a_rehearsal_is_confirmed_in_the_start_pose_and_its_record_says_by_whom() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    rehearsed(&run, "WIGGLE", 0);
    let summary = std::fs::read_to_string(run.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["operator"], "Ada", "{summary:#}");
    let confirmed = &summary["confirmed"][0];
    assert_eq!(confirmed["word"], "WIGGLE", "{summary:#}");
    let ns = |value: &Value| value.as_u64().unwrap();
    let [confirmed_ns, start_ns] = [ns(&confirmed["at_ns"]), ns(&summary["start_ns"])];
    assert!(confirmed_ns < start_ns, "{summary:#}");
    let steps = summary["bring_up"].as_array().unwrap();
    let named = |name: &str| steps.iter().any(|s| s["step"] == name);
    assert!(named("identify") && named("enable"), "{summary:#}");
}

#[test]
fn another_word_in_the_start_pose_moves_nothing() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    has(&rehearsed(&run, "wiggle", 1), &["not confirmed clear"]);
    let (cycles, _) = recorded(&run);
    let streamed = |c: &CycleRecord| c.mode == ControllerMode::Streaming as u8;
    assert!(!cycles.iter().any(streamed), "no motion began");
}

#[test]
fn a_key_that_is_released_brakes_the_arm() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    let mut child = on_arm(&arm, "wiggle --hold-to-run", &run)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let mut key = child.stdin.take().unwrap();
    until("the motion", Duration::from_secs(60), || {
        key.write_all(b"\n").unwrap();
        let sample = arm.history().latest()?;
        (sample.state.qd.max_abs() > AT_SPEED_RAD_S).then_some(())
    });
    was_braked(&arm, child, &run, FaultCode::DeadManReleased);
    drop(key);
}

/// Holds Enter down until `words` are said.
fn held_until(child: &mut Child, key: &mut ChildStdin, words: &str) {
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !over.load(Ordering::Relaxed) && key.write_all(b"\n").is_ok() {
                std::thread::sleep(Duration::from_millis(50));
            }
        });
        read_until(child, words);
        over.store(true, Ordering::Relaxed);
    });
    // For less than this a key counts as held that is released.
    std::thread::sleep(Duration::from_millis(400));
}

/// What was clear when the word was typed need not be so when Enter is held at last.
#[test]
fn a_hold_that_comes_long_after_the_word_is_asked_for_anew() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    let mut child = on_arm(
        &arm,
        "wiggle --ask --yes --hold-to-run --operator Ada",
        &run,
    )
    .stdin(Stdio::piped())
    .spawn()
    .unwrap();
    let mut key = child.stdin.take().unwrap();
    held_until(&mut child, &mut key, "type WIGGLE ");
    writeln!(key, "WIGGLE").unwrap();
    std::thread::sleep(Duration::from_millis(9_200));
    held_until(&mut child, &mut key, "it is asked again");
    read_until(&mut child, "type WIGGLE ");
    writeln!(key, "WIGGLE").unwrap();
    while key.write_all(b"\n").is_ok() {
        std::thread::sleep(Duration::from_millis(50));
    }
    ended(child, 0);
}

/// What `wag latency` would have written of an arm at this machine's address.
fn response(folder: &Path) -> PathBuf {
    let known = |value: f64| Estimate {
        value,
        interval: [value, value],
    };
    let lag = TrackingLag {
        dead_time_s: known(0.008),
        natural_frequency_hz: known(25.0),
        damping_ratio: known(0.9),
        residual_rad: 1e-5,
        samples: 900,
    };
    let response = ArmResponse {
        version: "0".to_owned(),
        source: "arm 127.0.0.1:502".to_owned(),
        command_to_target_s: None,
        excitation: None,
        joints: [JointResponse::Excited(lag); JOINTS],
    };
    let path = folder.join("arm-response.toml");
    run_log::files::write_arm_response(&path, &response).unwrap();
    path
}

/// Through a tunnel an arm answers at this machine's address. With a serial number of the
/// vendor's it is real: nothing begins before it was measured, and before somebody says that
/// the area is clear.
#[test]
fn an_arm_behind_a_tunnel_is_measured_and_needs_a_clear_area() {
    let _turn = beside_others();
    let arm = arm();
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    let arm_port = arm.ports().command;
    let tunnel = std::thread::spawn(move || {
        for _ in 0..2 {
            let (mut near, _) = listener.accept().unwrap();
            let mut far = TcpStream::connect((Ipv4Addr::LOCALHOST, arm_port)).unwrap();
            let mut bytes = [0; 256];
            let n = near.read(&mut bytes).unwrap();
            far.write_all(&bytes[..n]).unwrap();
            let n = far.read(&mut bytes).unwrap();
            let at = bytes.windows(9).position(|w| w == b"SIMULATED").unwrap();
            bytes[at..at + 9].copy_from_slice(b"XS1305000");
            near.write_all(&bytes[..n]).unwrap();
        }
    });
    let folder = tempfile::tempdir().unwrap();
    let measured = tempfile::tempdir().unwrap();
    let line = format!("wiggle --arm 127.0.0.1 --command-port {port}");
    let said = refused_in(folder.path(), 2, &line);
    has(&said, &["not measured", "wag latency --arm 127.0.0.1"]);
    let response = response(measured.path());
    let line = format!("{line} --arm-response {}", response.display());
    let said = refused_in(folder.path(), 2, &line);
    has(&said, &["does not prove", "--yes"]);
    tunnel.join().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
