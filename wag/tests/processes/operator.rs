//! What the operator at the terminal can do: Ctrl-C, and the dead-man switch.

use super::shell::{arm, on_arm, recorded, said};
use crate::support::{refused_in, send, until};
use rustix::process::Signal;
use shared_types::FaultCode;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};
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
    let (code, said) = said(child);
    assert_eq!(code, Some(1), "{said}");
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
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    let child = on_arm(&arm, "wiggle", &run).spawn().unwrap();
    wait_for_speed(&arm);
    send(child.id(), Signal::INT);
    was_braked(&arm, child, &run, FaultCode::OperatorStop);
}

#[test]
fn closing_standard_input_lets_go_of_the_dead_man_switch() {
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
    let folder = tempfile::tempdir().unwrap();
    let (arm, run) = (arm(), folder.path().join("run"));
    // Standard input is at its end from the beginning.
    let child = on_arm(&arm, "wiggle --dead-man", &run).spawn().unwrap();
    let (code, said) = said(child);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("DeadManReleased"), "{said}");
    let (cycles, _) = recorded(&run);
    assert!(
        cycles.iter().all(|c| c.trajectory_s < 0.0),
        "no motion began"
    );
}

/// Through a tunnel an arm answers at this machine's address. With a serial number of the
/// vendor's it is real, and nothing begins before somebody declares the area clear.
#[test]
fn an_arm_behind_a_tunnel_needs_a_clear_area() {
    let arm = arm();
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    let arm_port = arm.ports().command;
    let tunnel = std::thread::spawn(move || {
        let (mut near, _) = listener.accept().unwrap();
        let mut far = TcpStream::connect((Ipv4Addr::LOCALHOST, arm_port)).unwrap();
        let mut bytes = [0; 256];
        let n = near.read(&mut bytes).unwrap();
        far.write_all(&bytes[..n]).unwrap();
        let n = far.read(&mut bytes).unwrap();
        let at = bytes.windows(9).position(|w| w == b"SIMULATED").unwrap();
        bytes[at..at + 9].copy_from_slice(b"XS1305000");
        near.write_all(&bytes[..n]).unwrap();
    });
    let folder = tempfile::tempdir().unwrap();
    let line = format!("wiggle --arm 127.0.0.1 --command-port {port}");
    let said = refused_in(folder.path(), 2, &line);
    assert!(
        said.contains("does not prove") && said.contains("--yes"),
        "{said}"
    );
    tunnel.join().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
