//! The rig that the faults are judged on: a healthy throw on it passes, and nothing in it
//! is left to chance.

use super::stage::INTERFACES;
use hil_tests::scenario::{entry, swing};
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlSettings, Thresholds};
use shared_types::CommandInterface;
use shared_types::ipc::ControllerMode;

fn run_swing(rig: &mut VirtualRig) {
    rig.start(swing(rig.commanded()).unwrap());
    rig.run_for(2.5);
}

/// Largest distance of the true motion from the swing as commanded, whatever
/// the lag (rad).
fn worst_distance(rig: &VirtualRig) -> f64 {
    let motion = swing(rig.commanded()).unwrap();
    let mut records = rig.log.records.iter();
    let began = records.find(|r| r.trajectory_s >= 0.0).unwrap().deadline_ns;
    let at = |t_s: f64| motion.state_at(t_s.clamp(0.0, motion.duration_s())).q;
    let off = |lag_s: f64| {
        let moving = rig.log.truth.iter().filter(|s| s.at.0 >= began);
        moving
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

/// The position loop keeps an arm that follows velocities on its path: beside what
/// a pure delay explains, less than half of what the tracking monitor allows. It
/// ends where servo mode ends, standing.
#[test]
fn a_healthy_throw_passes_and_the_arm_follows_to_where_it_should_end() {
    let mut worst = Vec::new();
    for interface in INTERFACES {
        let settings = ControlSettings {
            interface,
            ..Thresholds::strict().into()
        };
        let mut rig = VirtualRig::new(VirtualRigConfig::new(settings, "".parse().unwrap()));
        rig.bring_up().unwrap();
        assert_eq!(rig.mode(), ControllerMode::Idle, "{:?}", rig.log.causes);
        run_swing(&mut rig);
        assert!(rig.log.causes.is_empty(), "{:?}", rig.log.causes);
        assert_eq!(rig.mode(), ControllerMode::Idle);
        if interface == CommandInterface::ServoPosition {
            let arrivals: Vec<_> = rig.log.arrivals().map(|(at, _)| at.0).collect();
            let in_step = |w: &[u64]| (3_900_000..4_100_000).contains(&(w[1] - w[0]));
            let once_per_cycle = arrivals.windows(2).all(in_step);
            assert!(once_per_cycle, "one setpoint per cycle");
        }
        let counters = rig.with_arm(|arm| arm.model().counters());
        assert_eq!((counters.dropped, counters.ignored), (0, 0));
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

/// Same set-up, same bits, by either interface; another seed, another arm.
#[test]
fn two_runs_are_equal_bit_for_bit() {
    let script = [
        entry("at_s = 0.5", "replies_lost, share = 0.02, duration_s = 1"),
        entry("at_s = 0.6", "report_garbage, frames = 2"),
        entry("on = 'speed:0.3'", "replies_duplicated, duration_s = 0.5"),
    ]
    .concat();
    let run = |interface, seed: u64, script: &str| {
        let relaxed = ControlSettings {
            interface,
            ..Thresholds::relaxed().into()
        };
        let mut config = VirtualRigConfig::new(relaxed, script.parse().unwrap());
        (config.arm.seed, config.delay_s) = (seed, 0.0003);
        let mut rig = VirtualRig::new(config);
        rig.bring_up().unwrap();
        rig.oversleep([0, 0, 900_000, 0, 5_000_000, 0]);
        run_swing(&mut rig);
        let log = &rig.log;
        let last = log.truth.last().unwrap().state.q;
        (
            format!("{:?}{:?}{:?}", log.records, log.inputs, log.arm_events),
            last,
        )
    };
    for interface in INTERFACES {
        let (first, second) = (run(interface, 1, &script), run(interface, 1, &script));
        assert!(first == second, "{interface:?}");
        assert!(run(interface, 2, &script) != first, "{interface:?}");
        // Also without a script, whose losses are drawn.
        let [(_, one), (_, two)] = [1, 2].map(|seed| run(interface, seed, ""));
        assert!(one != two, "{interface:?}");
    }
}
