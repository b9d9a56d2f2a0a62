//! What goes wrong between client and arm.

use super::scenario::{CYCLE_S, Scenario};
use arm_model::JointVector;
use hil_tests::scenario::entry;
use rt_controller::xarm::{Command, Mode, Status};
use xarm_sim::{Closing, ConnectRefused, ReportKind, Service};

#[test]
fn a_stall_freezes_the_arm_and_then_lets_everything_go_at_once() {
    let script = entry("on = 'setpoint:50'", "stall, duration_s = 0.19");
    let mut b = Scenario::new(&script);
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.5, 1.0);
    assert_eq!(b.replies.len(), 250);
    let [(begins, true), (ends, false)] = b.fault_times()[..] else {
        panic!("{:?}", b.fault_times());
    };
    assert_eq!(ends - begins, 190);
    let burst = b.replies.iter().filter(|r| r.ms == ends).count();
    assert!((47..=49).contains(&burst), "{burst}");
    assert!(!b.replies.iter().any(|r| (begins..ends).contains(&r.ms)));
    // Only the newest of the burst counts.
    let counters = b.arm.model().counters();
    assert!((46..=48).contains(&counters.dropped), "{counters:?}");
    b.wait(0.3);
    assert!((b.arm.model().true_motion().q[6] - 0.5).abs() < 1e-6);
    assert_eq!(b.errors(), [0; 0]);
}

#[test]
fn resets_half_open_links_and_pulled_cables_differ_for_the_client() {
    // A reset ends the connection, a half-open one stays but nothing comes any more; a
    // new one works.
    for (kind, closing) in [
        ("connection_reset", Some(Closing::Reset)),
        ("half_open", None),
    ] {
        let mut b = Scenario::new(&entry("on = 'setpoint:10'", kind));
        b.bring_up(Mode::Servo);
        b.replies.clear();
        b.stream(0.1, 0.1);
        let found = (b.replies.len(), b.arm.closing(b.client));
        assert_eq!(found, (9, closing), "{kind}");
        let listens = b.arm.receive(b.client, b.now, &[0; 3]);
        assert_eq!(listens, kind != "half_open");
        b.client = b.arm.connect(Service::Commands, b.now).unwrap();
        b.send(&Command::GetState);
        assert_eq!(b.replies.len(), 10, "{kind}");
    }

    // A pulled cable: silence everywhere, no new connection, then a reset.
    let script = entry("on = 'setpoint:10'", "cable_pull, duration_s = 0.5");
    let mut b = Scenario::new(&script);
    let reports = b.reports(ReportKind::Realtime);
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.1, 0.1);
    while b.arm.take_frame(reports, b.now).is_some() {}
    b.wait(0.3);
    assert_eq!((b.replies.len(), b.arm.closing(b.client)), (9, None));
    assert!(b.arm.take_frame(reports, b.now).is_none());
    let refused = b.arm.connect(Service::Commands, b.now);
    assert_eq!(refused, Err(ConnectRefused::Unreachable));
    b.wait(0.2);
    for client in [b.client, reports] {
        assert_eq!(b.arm.closing(client), Some(Closing::Reset));
    }
    assert!(b.arm.connect(Service::Commands, b.now).is_ok());
}

#[test]
fn replies_come_late_swapped_twice_or_not_at_all() {
    let run = |kind: &str| {
        let mut b = Scenario::new(&entry("at_s = 0.1", kind));
        b.wait(0.2);
        for _ in 0..40 {
            b.send(&Command::GetState);
            b.wait(CYCLE_S);
        }
        b.wait(0.1);
        let ids: Vec<_> = b.replies.iter().map(|r| r.transaction).collect();
        (ids, b.replies[0].ms)
    };
    let in_order: Vec<u16> = (1..=40).collect();
    let (ids, first_ms) = run("replies_delayed, delay_s = 0.02");
    assert_eq!((ids, first_ms), (in_order.clone(), 220));
    let (ids, _) = run("replies_reordered");
    assert_eq!(ids[..4], [2, 1, 4, 3]);
    let (ids, _) = run("replies_duplicated");
    assert_eq!(ids[..4], [1, 1, 2, 2]);
    let (ids, _) = run("replies_lost, share = 0.5");
    assert!((10..30).contains(&ids.len()), "{ids:?}");
    let (ids, _) = run("replies_foreign");
    assert_eq!(ids[..4], [0x4001, 1, 0x4002, 2]);
}

/// A reply that waits for another one to pass does not wait for ever.
#[test]
fn a_lonely_reply_is_only_delayed_by_reordering() {
    let mut b = Scenario::new(&entry("at_s = 0", "replies_reordered"));
    b.wait(0.01);
    b.send(&Command::GetState);
    b.wait(0.1);
    assert_eq!(b.replies.len(), 1);
    assert!((30..=33).contains(&b.replies[0].ms), "{:?}", b.replies);
}

#[test]
fn status_bits_lie_without_anything_else_changing() {
    for (kind, bit) in [
        ("error_bit", Status::ERROR),
        ("warning_bit", Status::WARNING),
        ("not_ready_bit", Status::NOT_READY),
    ] {
        let script = entry("on = 'setpoint:5'", &format!("{kind}, duration_s = 0.02"));
        let mut b = Scenario::new(&script);
        b.bring_up(Mode::Servo);
        b.replies.clear();
        b.stream(0.2, 0.1);
        let lies = b.replies.iter().filter(|r| r.status == bit).count();
        assert!((5..=6).contains(&lies), "{kind}: {lies}");
        assert_eq!(b.arm.model().counters().motion_commands, 25);
    }
}

/// A client that asks for it is told about the beginning and end of its moves.
#[test]
fn feedback_is_pushed_when_asked_for() {
    let mut b = Scenario::new("");
    b.bring_up(Mode::Position);
    b.send(&Command::FeedbackMask(3));
    let mut target = JointVector::ZERO;
    target[6] = 0.1;
    b.replies.clear();
    b.send(&Command::MoveJoint {
        target,
        speed_rad_s: 1.0,
        acceleration_rad_s2: 10.0,
        checked: None,
    });
    let requested = b.transaction;
    b.wait(1.0);
    let pushes: Vec<_> = b.replies.iter().filter(|r| r.register == 0xFF).collect();
    assert_eq!(pushes.len(), 2, "{:?}", b.replies);
    assert!(pushes.iter().all(|p| p.transaction == requested));
}
