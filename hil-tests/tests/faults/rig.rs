//! Control core and simulated arm together in virtual time.
#![cfg(test)]

use arm_model::JointVector;
use hil_tests::scenario::{entry, swing};
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlSettings, Thresholds};
use shared_types::ipc::ControllerMode;
use shared_types::{CommandInterface, FaultCode};

fn rig(script: &str) -> VirtualRig {
    rig_by(CommandInterface::ServoPosition, script)
}

fn rig_by(interface: CommandInterface, script: &str) -> VirtualRig {
    let settings = ControlSettings {
        interface,
        ..Thresholds::strict().into()
    };
    let mut rig = VirtualRig::new(VirtualRigConfig::new(settings, script.parse().unwrap()));
    rig.bring_up().unwrap();
    assert_eq!(rig.mode(), ControllerMode::Idle, "{:?}", rig.log.causes);
    rig
}

fn run_swing(rig: &mut VirtualRig) {
    rig.start(swing(rig.commanded()).unwrap());
    rig.run_for(2.5);
}

/// Largest distance of the true motion from the swing as commanded, whatever
/// the lag (rad).
fn worst_distance(rig: &VirtualRig) -> f64 {
    let motion = swing(rig.commanded()).unwrap();
    let began = rig
        .log
        .records
        .iter()
        .find(|r| r.trajectory_s >= 0.0)
        .unwrap()
        .deadline_ns;
    let at = |t_s: f64| motion.state_at(t_s.clamp(0.0, motion.duration_s())).q;
    let off = |lag_s: f64| {
        rig.log
            .truth
            .iter()
            .filter(|s| s.at.0 >= began)
            .map(|s| {
                let t_s = (s.at.0 - began) as f64 * 1e-9 - lag_s;
                (s.state.q - at(t_s)).max_abs()
            })
            .fold(0.0, f64::max)
    };
    (0..40)
        .map(|k| off(f64::from(k) * 1e-3))
        .fold(1.0, f64::min)
}

#[test]
fn a_healthy_throw_passes_and_the_arm_follows() {
    let mut rig = rig("");
    run_swing(&mut rig);
    assert!(rig.log.causes.is_empty(), "{:?}", rig.log.causes);
    assert_eq!(rig.mode(), ControllerMode::Idle);
    let setpoints: Vec<_> = rig.log.setpoints().collect();
    assert!(
        setpoints
            .windows(2)
            .all(|w| (3_900_000..4_100_000).contains(&(w[1].0.0 - w[0].0.0))),
        "one setpoint per cycle"
    );
    let counters = rig.with_arm(|arm| arm.model().counters());
    assert_eq!((counters.dropped, counters.ignored), (0, 0));
    assert!(worst_distance(&rig) < 0.01, "{}", worst_distance(&rig));
}

/// The position loop keeps an arm that follows velocities on its path: beside what
/// a pure delay explains, less than half of what the tracking monitor allows. It
/// ends where servo mode ends, standing.
#[test]
fn a_throw_by_velocities_follows_its_path_and_ends_where_it_should() {
    let mut worst = Vec::new();
    for interface in [
        CommandInterface::ServoPosition,
        CommandInterface::JointVelocity,
    ] {
        let mut rig = rig_by(interface, "");
        run_swing(&mut rig);
        assert!(rig.log.causes.is_empty(), "{:?}", rig.log.causes);
        worst.push(worst_distance(&rig));
        let end = rig.with_arm(|arm| arm.model().true_motion());
        assert!((end.q - rig.commanded()).max_abs() < 1e-3, "{interface:?}");
        assert!(end.qd.max_abs() < 1e-3, "{interface:?}");
    }
    println!(
        "beside a pure delay: servo {} rad, velocity {} rad",
        worst[0], worst[1]
    );
    let allowed = Thresholds::strict().tracking_error_max_rad;
    assert!(worst[0] < 0.01 && worst[1] < 0.5 * allowed, "{worst:?}");
}

/// Fault by fault: exactly one cause, of the kind expected, and rest.
#[test]
fn faults_of_the_arm_end_in_one_cause_each() {
    use FaultCode as F;
    let when = "on = \"speed:0.3\"";
    let cases: [(&str, &[FaultCode]); 9] = [
        ("kind = \"stall\"\nduration_s = 0.19", &[F::ReplyStalled]),
        ("kind = \"connection_reset\"", &[F::LinkLost]),
        ("kind = \"half_open\"", &[F::ReplyStalled]),
        (
            "kind = \"raise_error\"\ncode = 60",
            &[F::ArmError, F::ArmNotReady],
        ),
        (
            "kind = \"mode_changed\"\nmode = 0",
            &[F::ArmNotReady, F::ArmModeChanged],
        ),
        ("kind = \"report_stop\"", &[F::ReportStale]),
        (
            "kind = \"tracking_lag\"\nlag_s = 0.2",
            &[F::TrackingError, F::JointStuck, F::ReportFrozen],
        ),
        (
            "kind = \"joint_stuck\"\njoint = 6",
            &[F::TrackingError, F::JointStuck],
        ),
        (
            "kind = \"encoder_jump\"\njoint = 4\nby_rad = 0.0873",
            &[F::TrackingError, F::EncoderJump],
        ),
    ];
    for (kind, want) in cases {
        let mut rig = rig(&entry(when, kind));
        run_swing(&mut rig);
        let causes: Vec<_> = rig.log.causes.iter().map(|c| c.fault()).collect();
        assert_eq!(causes.len(), 1, "{kind}: {causes:?}");
        assert!(want.contains(&causes[0]), "{kind}: {causes:?}");
        assert_eq!(rig.mode(), ControllerMode::Faulted, "{kind}");
        let speed = rig.with_arm(|arm| arm.model().true_motion().qd.max_abs());
        assert!(speed < 1e-3, "{kind}: {speed}");
        // Nothing moves it again without an acknowledgement.
        let before = rig.log.setpoints().count();
        rig.start(swing(rig.commanded()).unwrap());
        rig.run_for(0.5);
        assert_eq!(rig.log.setpoints().count(), before, "{kind}");
    }
}

#[test]
fn after_a_stop_and_an_acknowledgement_it_works_again() {
    let mut rig = rig(&entry(
        "on = \"speed:0.3\"",
        "kind = \"raise_error\"\ncode = 31",
    ));
    run_swing(&mut rig);
    assert_eq!(rig.log.causes.len(), 1);
    rig.bring_up().unwrap();
    assert_eq!(rig.mode(), ControllerMode::Idle);
    assert_eq!(rig.log.causes.len(), 1);
}

/// Same set-up, same bits; another seed, another arm.
#[test]
fn two_runs_are_equal_bit_for_bit() {
    let script = entry(
        "at_s = 0.5",
        "kind = \"replies_lost\"\nshare = 0.02\nduration_s = 1",
    ) + &entry("at_s = 0.6", "kind = \"report_garbage\"\nframes = 2")
        + &entry(
            "on = \"speed:0.3\"",
            "kind = \"replies_duplicated\"\nduration_s = 0.5",
        );
    let run = |seed: u64| {
        let relaxed = Thresholds::relaxed().into();
        let mut config = VirtualRigConfig::new(relaxed, script.parse().unwrap());
        (config.arm.seed, config.delay_s) = (seed, 0.0003);
        let mut rig = VirtualRig::new(config);
        rig.bring_up().unwrap();
        rig.oversleep([0, 0, 900_000, 0, 5_000_000, 0]);
        run_swing(&mut rig);
        let last: JointVector = rig.log.truth.last().unwrap().state.q;
        (format!("{:?}{:?}", rig.log.records, rig.log.inputs), last)
    };
    let (first, second) = (run(1), run(1));
    assert!(first.0 == second.0 && first.1 == second.1);
    assert!(run(2).0 != first.0);
}
