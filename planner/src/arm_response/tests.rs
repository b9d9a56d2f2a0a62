//! Recordings of known lags, whole and damaged. The arm model itself, wire and
//! all, is met in the tests of the commands.

use super::excitation::sweep;
use super::lag::Lag;
use super::*;
use arm_model::Pole;
use arm_model::response::Excitation;
use arm_model::{JointVector, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Pause between two sweeps (s).
const PAUSE_S: f64 = 0.6;

/// Setpoints of the sweeps of `joints`, sent up to 0.6 ms late.
fn setpoints(joints: &[usize], seed: u64) -> Vec<Setpoint> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let e = Excitation {
        seed,
        ..Excitation::default()
    };
    let sweeps: Vec<_> = joints
        .iter()
        .map(|j| sweep(&e, &Limits::default(), &Pole::default(), *j).unwrap())
        .collect();
    let each_s = e.duration_s + PAUSE_S;
    let cycles = (each_s * joints.len() as f64 / 0.004) as usize;
    (0..cycles)
        .map(|k| {
            let t_s = 0.004 * k as f64;
            let which = ((t_s / each_s) as usize).min(sweeps.len() - 1);
            Setpoint {
                sent_s: t_s + rng.random_range(0.0..6e-4),
                q: sweeps[which].state_at(t_s - each_s * which as f64 - 0.2).q,
            }
        })
        .collect()
}

/// What an arm with these lags reports: encoder steps, f32, stamps off by up to
/// 0.3 ms.
fn recording(joints: &[usize], lags: &[Lag; JOINTS], seed: u64) -> Recording {
    let setpoints = setpoints(joints, seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xABCD);
    let end_s = setpoints.last().unwrap().sent_s;
    let times_s: Vec<f64> = (0..(end_s / 0.004) as usize)
        .map(|k| 0.0017 + 0.004 * k as f64)
        .collect();
    let mut samples: Vec<Sample> = times_s
        .iter()
        .map(|t| Sample {
            at_s: t + rng.random_range(-3e-4..3e-4),
            q: JointVector::ZERO,
            q_target: None,
        })
        .collect();
    for (j, lag) in lags.iter().enumerate() {
        let window = Window {
            setpoints: setpoints.iter().map(|s| (s.sent_s, s.q[j])).collect(),
            samples: times_s.iter().map(|t| (*t, 0.0)).collect(),
        };
        let mut at = samples.iter_mut();
        lag.follow(&window, |q, _| {
            let steps = (q / 1e-5).round() * 1e-5;
            at.next().unwrap().q[j] = f64::from(steps as f32);
        });
    }
    Recording {
        setpoints,
        samples,
        round_trip_s: 2e-4,
    }
}

fn lags(dead_time_s: f64, hz: f64, damping_ratio: f64) -> [Lag; JOINTS] {
    core::array::from_fn(|j| Lag {
        dead_time_s: dead_time_s + 0.003 * j as f64,
        natural_frequency_rad_s: core::f64::consts::TAU * (hz + j as f64),
        damping_ratio,
    })
}

/// Within a dead time (s), and fractions of natural frequency and damping.
fn assert_found(found: &JointResponse, truth: &Lag, [dead_time_s, part, damping]: [f64; 3]) {
    let lag = found.lag().unwrap();
    let hz = truth.natural_frequency_rad_s / core::f64::consts::TAU;
    let off = |e: &Estimate, truth: f64| (e.value / truth - 1.0).abs();
    assert!(
        (lag.dead_time_s.value - truth.dead_time_s).abs() < dead_time_s,
        "{lag:?}"
    );
    assert!(off(&lag.natural_frequency_hz, hz) < part, "{lag:?}");
    assert!(
        off(&lag.damping_ratio, truth.damping_ratio) < damping,
        "{lag:?}"
    );
}

#[test]
fn known_lags_are_found_within_their_intervals_and_resting_joints_are_not_guessed() {
    let truth = lags(0.012, 9.0, 0.8);
    let found = identify(&recording(&[0, 3, 6], &truth, 7), |_| ()).unwrap();
    for (j, response) in found.iter().enumerate() {
        if ![0, 3, 6].contains(&j) {
            assert_eq!(*response, JointResponse::NotExcited(NotExcited::Still));
            continue;
        }
        assert_found(response, &truth[j], [5e-4, 0.02, 0.04]);
        let [low, high] = response.lag().unwrap().dead_time_s.interval;
        assert!(low < high && high - low < 2e-3, "{response:?}");
    }
}

#[test]
fn wild_and_missing_reports_do_little_harm() {
    let truth = lags(0.035, 12.0, 0.6);
    let mut bad = recording(&[5], &truth, 3);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    bad.samples.retain(|_| rng.random_bool(0.8));
    for sample in &mut bad.samples {
        if rng.random_bool(0.03) {
            sample.q[5] += rng.random_range(-0.05..0.05);
        }
    }
    let found = identify(&bad, |_| ()).unwrap();
    assert_found(&found[5], &truth[5], [1e-3, 0.04, f64::INFINITY]);
}

/// A joint that is stuck, and one that follows at half the amplitude.
#[test]
fn motions_that_no_lag_explains_are_said_to_be_unexplained() {
    for gain in [0.0, 0.5] {
        let mut odd = recording(&[2], &lags(0.02, 10.0, 0.9), 5);
        let rest = odd.samples[0].q[2];
        for sample in &mut odd.samples {
            sample.q[2] = rest + gain * (sample.q[2] - rest);
        }
        let found = identify(&odd, |_| ()).unwrap();
        assert_eq!(
            found[2],
            JointResponse::NotExcited(NotExcited::Unexplained),
            "{gain}"
        );
    }
}

/// A swing of four seconds under reports as coarse as half a milliradian.
#[test]
fn slow_motion_under_coarse_reports_is_indistinct() {
    let mut slow = recording(&[1], &lags(0.02, 20.0, 0.9), 5);
    for (k, setpoint) in slow.setpoints.iter_mut().enumerate() {
        setpoint.q[1] = 0.8 + 0.003 * (0.004 * k as f64 * 1.5).sin();
    }
    let window = Window {
        setpoints: slow.setpoints.iter().map(|s| (s.sent_s, s.q[1])).collect(),
        samples: slow.samples.iter().map(|s| (s.at_s, 0.0)).collect(),
    };
    let mut at = slow.samples.iter_mut();
    lags(0.02, 20.0, 0.9)[1].follow(&window, |q, _| {
        at.next().unwrap().q[1] = (q / 5e-4).round() * 5e-4;
    });
    // From rest, as every motion that is used.
    for setpoint in &mut slow.setpoints[..100] {
        setpoint.q[1] = 0.8;
    }
    let found = identify(&slow, |_| ()).unwrap();
    assert!(found[1].lag().is_none(), "{:?}", found[1]);
}

#[test]
fn damaged_recordings_are_refused_with_place() {
    let good = recording(&[0], &lags(0.02, 10.0, 0.9), 1);
    type Change = fn(&mut Recording);
    let cases: [(Change, &str); 4] = [
        (|r| r.samples.truncate(20), "20 joint reports"),
        (|r| r.setpoints[40].sent_s = 0.0, "setpoint 40"),
        (|r| r.samples[9].q[3] = f64::NAN, "joint report 9"),
        (
            |r| r.samples.iter_mut().for_each(|s| s.at_s += 1e6),
            "another clock",
        ),
    ];
    for (change, said) in cases {
        let mut bad = good.clone();
        change(&mut bad);
        let error = identify(&bad, |_| ()).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
