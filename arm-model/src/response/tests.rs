//! Files that are taken, and files that are refused with joint and key.

use super::*;
use crate::JOINTS;

fn around(value: f64) -> Estimate {
    Estimate {
        value,
        interval: [0.9 * value, 1.1 * value],
    }
}

fn lag(dead_time_s: f64, natural_frequency_hz: f64, damping_ratio: f64) -> TrackingLag {
    TrackingLag {
        dead_time_s: around(dead_time_s),
        natural_frequency_hz: around(natural_frequency_hz),
        damping_ratio: around(damping_ratio),
        residual_rad: 1e-5,
        samples: 700,
    }
}

fn measured() -> ArmResponse {
    let mut joints = [JointResponse::NotExcited(NotExcited::Still); JOINTS];
    joints[0] = JointResponse::Excited(lag(0.021, 12.5, 0.8));
    joints[5] = JointResponse::NotExcited(NotExcited::Indistinct);
    ArmResponse {
        version: "1.2.3".to_owned(),
        source: "a test".to_owned(),
        command_to_target_s: Some([1e-4, 9e-4]),
        excitation: Some(Excitation::default()),
        joints,
    }
}

#[test]
fn a_response_survives_its_file() {
    let text = toml::to_string(&measured()).unwrap();
    assert_eq!(toml::from_str::<ArmResponse>(&text).unwrap(), measured());
    assert!(text.contains("excited = false\nwhy = \"still\""), "{text}");
}

#[test]
fn damaged_files_are_refused_with_joint_and_key() {
    let good = toml::to_string(&measured()).unwrap();
    let refused = |from: &str, to: &str| {
        let changed = good.replacen(from, to, 1);
        assert_ne!(changed, good, "{from}");
        toml::from_str::<ArmResponse>(&changed)
            .unwrap_err()
            .to_string()
    };
    for (from, to, said) in [
        ("format = 1", "format = 9", "`format` is 9"),
        ("joint = 2", "joint = 3", "entry 2"),
        ("dead_time_s = 0.021", "dead_time_s = nan", "`dead_time_s`"),
        ("dead_time_s = 0.021", "dead_time_s = -0.1", "joint 1"),
        ("dead_time_s = 0.021", "", "`dead_time_s`"),
        (
            "damping_ratio = 0.8",
            "damping_ratio = 0.95",
            "`damping_ratio_interval`",
        ),
        ("excited = true", "excited = false", "`dead_time_s`"),
        ("why = \"still\"", "", "`why`"),
        ("samples = 700", "samples = 700\ncolour = 3", "colour"),
    ] {
        let error = refused(from, to);
        assert!(error.contains(said), "{to}: {error}");
    }
    let cut = good.rsplit_once("[[joints]]").unwrap().0;
    let error = toml::from_str::<ArmResponse>(cut).unwrap_err().to_string();
    assert!(error.contains("6 entries"), "{error}");
}

/// A Butterworth lag (damping 1/sqrt 2) has its bandwidth at its natural
/// frequency; a critically damped one at 0.6436 of it.
#[test]
fn bandwidth_of_two_lags_known_by_heart() {
    let butterworth = lag(0.0, 10.0, core::f64::consts::FRAC_1_SQRT_2);
    assert!((butterworth.bandwidth_hz() - 10.0).abs() < 1e-9);
    let critical = lag(0.02, 10.0, 1.0);
    assert!((critical.bandwidth_hz() - 6.436).abs() < 1e-3);
    assert!((critical.slow_delay_s() - 0.02 - 1.0 / (10.0 * core::f64::consts::PI)).abs() < 1e-12);
}
