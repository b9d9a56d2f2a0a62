//! `wag latency --stops` on a simulated arm.

use super::support::{alone, json_in, moved_in, refused_in};
use std::path::Path;
use xarm_sim::{ArmConfig, SimulatedArm};

#[test]
fn stops_are_measured_at_rising_speeds_by_the_brake_and_by_the_arm() {
    let _alone = alone();
    let arm = SimulatedArm::start(ArmConfig {
        command_port: 0,
        report_ports: [0; 4],
        ..ArmConfig::default()
    })
    .unwrap();
    let ports = arm.ports();
    let [joints, _, status, _] = ports.reports;
    let dir = tempfile::tempdir().unwrap();
    let line = format!(
        "latency --arm 127.0.0.1 --command-port {} --report-port {joints} --status-port {status} --stops",
        ports.command
    );
    let reported = moved_in(dir.path(), &line, "run");
    let number = |stop: &serde_json::Value, key: &str| stop[key].as_f64().unwrap();
    let stops = reported["stops"].as_array().unwrap();
    let told: Vec<_> = stops
        .iter()
        .map(|s| format!("{} {}", s["operating_mode"], s["by"]))
        .collect();
    assert_eq!(stops.len(), 6, "{told:?}");
    for pair in stops.chunks(2) {
        assert!(
            pair[0]["by"].as_str().unwrap().contains("brake"),
            "{told:?}"
        );
        assert!(
            pair[1]["by"].as_str().unwrap().contains("state 4"),
            "{told:?}"
        );
        for stop in pair {
            let (speed_m_s, time_s) = (number(stop, "speed_m_s"), number(stop, "time_s"));
            let distance_m = number(stop, "distance_m");
            // It slows down from the speed that it had, and does not take long.
            assert!(time_s > 0.01 && time_s < 0.6, "{stop}");
            assert!(distance_m > 0.1 * speed_m_s * time_s, "{stop}");
            assert!(distance_m < 1.05 * speed_m_s * time_s, "{stop}");
        }
    }
    let speeds: Vec<f64> = stops.iter().map(|s| number(s, "speed_m_s")).collect();
    // What set-up motions, wiggles (whose tool is the bound) and throws may be.
    for (speeds_m_s, allowed_m_s) in speeds.chunks(2).zip([0.25, 0.5, 1.2]) {
        for speed_m_s in speeds_m_s {
            let part = speed_m_s / allowed_m_s;
            assert!((0.7..1.1).contains(&part), "{speeds:?}");
        }
    }
    let standing = arm.history().latest().unwrap().state.qd.max_abs();
    assert!(standing < 2e-3, "{standing} rad/s");
    let replayed = json_in(dir.path(), "replay run");
    assert_eq!(replayed["replay"]["differing_bytes"], 0);

    let nobody = refused_in(Path::new("."), 2, "latency --stops");
    assert!(nobody.contains("--arm ADDR"), "{nobody}");
}
