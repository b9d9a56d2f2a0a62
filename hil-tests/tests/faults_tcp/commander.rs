//! Somebody else commands the arm.

use super::stand::{PATIENCE, Stand};
use rt_controller::xarm::Command;
use shared_types::FaultCode;
use shared_types::ipc::message::ControllerEvent;
use std::time::Instant;

#[test]
fn fault_13_replies_to_commands_never_sent_mean_a_second_commander() {
    let mut stand = Stand::ready("foreign");
    let fault = "replies_foreign, duration_s = 0.4";
    stand.stopped_by(fault, &[FaultCode::SecondCommander]);
    stand.recovers();
}

/// A client of its own that holds the arm where the motion began, as a second
/// program would that does not know of the first.
#[test]
fn fault_13_a_second_program_that_streams_is_noticed() {
    let mut stand = Stand::ready("second");
    let mut second = stand.other_client();
    second.ask(&Command::FeedbackCheck).unwrap();
    let held = stand.commanded();
    let pending = stand.begin();
    stand.wait_for_speed();
    let began = Instant::now();
    let answer = loop {
        // 50 times a second, whatever the arm says to it.
        let _ = second.ask(&Command::ServoJoint(held));
        for _ in 0..8 {
            stand.turn();
        }
        if let Ok(Some(event)) = pending.try_next()
            && !matches!(event, ControllerEvent::Started { .. })
        {
            break event;
        }
        assert!(began.elapsed() < PATIENCE);
    };
    drop(second);
    println!("{answer:?}");
    let ControllerEvent::Stopped {
        fault, arm_error, ..
    } = answer
    else {
        panic!("{answer:?}");
    };
    // The arm may find the jumps between the two before the controller does: C24,
    // whose stop may be seen before the error itself.
    let by_the_arm = fault == FaultCode::ArmError && arm_error == 24;
    assert!(
        fault == FaultCode::SecondCommander || by_the_arm,
        "{answer:?}"
    );
    stand.expect(&[
        FaultCode::SecondCommander,
        FaultCode::ArmError,
        FaultCode::ArmNotReady,
        FaultCode::ArmModeChanged,
    ]);
    stand.is_latched();
    stand.recovers();
}
