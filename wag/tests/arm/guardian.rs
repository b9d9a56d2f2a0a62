//! The controller is killed in the middle of a motion: the guardian stops the
//! arm on its own connection, before it comes to rest by silence alone.

use super::support::{Rig, alone, ended, has, process_of, send, until};
use rt_controller::session::ArmSession;
use rt_controller::xarm::ArmState;
use rustix::process::Signal;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

#[test]
fn a_controller_killed_in_motion_leaves_a_stopped_arm() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let rig = Rig::start("");
    let port = rig.ports()[0].parse().unwrap();
    let ask = Duration::from_secs(2);
    let mut arm = ArmSession::connect(SocketAddr::from(([127, 0, 0, 1], port)), ask).unwrap();
    let wiggle = rig.wiggle(&run);
    // The move to the start pose is the first motion.
    until("the motion", Duration::from_secs(30), || {
        (arm.state().unwrap() == ArmState::Moving).then_some(())
    });
    let name = run.display().to_string();
    let controller = until("the controller", ask, || process_of(&name, "rt-controller"));
    std::thread::sleep(Duration::from_millis(300));
    send(controller, Signal::KILL);
    let killed = Instant::now();
    until("the stop", Duration::from_secs(2), || {
        (arm.state().unwrap() == ArmState::Stopped).then_some(())
    });
    println!(
        "state 4 read {:.1} ms after SIGKILL",
        killed.elapsed().as_secs_f64() * 1e3
    );
    ended(wiggle, 1);
    let log = std::fs::read_to_string(run.join("log/guardian.log")).unwrap();
    has(&log, &["lost while the arm moved", "seen stopped"]);
}
