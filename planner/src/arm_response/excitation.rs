//! A motion that shows how a joint follows: a small sine sweep, ever faster.
//!
//! Slow swings tell the whole delay, fast ones how it splits into dead time and
//! lag. At each frequency the amplitude is what the part of speed,
//! acceleration, jerk and tool speed that may be used allows, so that every
//! frequency is as loud as it can safely be. One joint moves at a time.

use crate::wiggle::smooth_step;
use arm_model::kinematics::tool_speed_m_s;
use arm_model::response::Excitation;
use arm_model::trajectory::MAX_WAYPOINTS;
use arm_model::{JOINTS, JointTrajectory, JointVector, Limits, Pole, unit_hint};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Part of a sweep over which it fades in, and out again.
const FADE_PART: f64 = 0.1;
/// Fewest knots of the spline in a swing.
const KNOTS_PER_SWING: f64 = 4.0;
/// What fading and the spline may add to the sine's own peaks.
const PEAK_RESERVE: f64 = 0.8;

/// Why there is no sweep.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct ExcitationError(String);

fn check(e: &Excitation, limits: &Limits) -> Result<(), ExcitationError> {
    let highest_max_hz = (MAX_WAYPOINTS - 1) as f64 / e.duration_s / KNOTS_PER_SWING;
    let tool_speeds_m_s = [0.01, limits.tcp_speed_max_m_s];
    let rules = [
        ("duration_s", e.duration_s, [1.0, 20.0]),
        ("lowest_hz", e.lowest_hz, [0.2, 5.0]),
        (
            "highest_hz",
            e.highest_hz,
            [2.0 * e.lowest_hz, highest_max_hz],
        ),
        ("amplitude_max_rad", e.amplitude_max_rad, [1e-3, 0.2]),
        ("limits_fraction", e.limits_fraction, [0.01, 0.9]),
        ("tool_speed_max_m_s", e.tool_speed_max_m_s, tool_speeds_m_s),
    ];
    for (key, value, [low, high]) in rules {
        if !(low..=high).contains(&value) {
            let hint = unit_hint(key, value, high);
            return Err(ExcitationError(format!(
                "`{key}` is {value}, but must be from {low:.3} to {high:.3}{hint}"
            )));
        }
    }
    match limits.position_violation(&e.pose_rad) {
        Some(j) => Err(ExcitationError(format!(
            "joint {} of `pose_rad` is {}, but must be from {:.3} to {:.3}{}",
            j + 1,
            e.pose_rad[j],
            limits.position_min_rad[j],
            limits.position_max_rad[j],
            unit_hint("pose_rad", e.pose_rad[j].abs(), core::f64::consts::TAU)
        ))),
        None => Ok(()),
    }
}

/// Joint speed at which flange or pole reach the allowed tool speed (rad/s).
fn speed_allowed_rad_s(e: &Excitation, limits: &Limits, pole: &Pole, joint: usize) -> f64 {
    let mut unit = JointVector::ZERO;
    unit[joint] = 1.0;
    let lever_m = [limits.tcp_offset(), pole.end_m()]
        .iter()
        .map(|point| tool_speed_m_s(&e.pose_rad, &unit, point))
        .fold(1e-9, f64::max);
    (e.tool_speed_max_m_s / lever_m).min(e.limits_fraction * limits.velocity_max_rad_s[joint])
}

/// A little less than the smallest of some positive numbers, without the kink
/// that would show up as a blow in the jerk.
fn smooth_min<const N: usize>(values: [f64; N]) -> f64 {
    values.iter().map(|v| v.powi(-4)).sum::<f64>().powf(-0.25)
}

/// Phases that the joints' sweeps begin with (rad).
fn phases_rad(seed: u64) -> [f64; JOINTS] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    core::array::from_fn(|_| rng.random_range(0.0..core::f64::consts::TAU))
}

/// The sweep of one joint (0-based) of an arm with this pole, from the pose and back to it, checked
/// against the limits with the reduced tool speed.
///
/// # Errors
/// A value out of range, a pose outside the joints' ranges, a motion that breaks a limit.
pub fn sweep(
    e: &Excitation,
    limits: &Limits,
    pole: &Pole,
    joint: usize,
) -> Result<JointTrajectory, ExcitationError> {
    check(e, limits)?;
    let speed = PEAK_RESERVE * speed_allowed_rad_s(e, limits, pole, joint);
    let part = PEAK_RESERVE * e.limits_fraction;
    let acceleration = part * limits.acceleration_max_rad_s2[joint];
    let jerk = part * limits.jerk_max_rad_s3[joint];
    let phase_rad = phases_rad(e.seed)[joint];
    let rise_per_s = (e.highest_hz / e.lowest_hz).ln() / e.duration_s;
    let at = |t_s: f64| {
        let w = core::f64::consts::TAU * e.lowest_hz * (rise_per_s * t_s).exp();
        let turned_rad = (w - core::f64::consts::TAU * e.lowest_hz) / rise_per_s;
        let allowed_rad = [
            e.amplitude_max_rad,
            speed / w,
            acceleration / w.powi(2),
            jerk / w.powi(3),
        ];
        let amplitude_rad = smooth_min(allowed_rad);
        let fade_s = FADE_PART * e.duration_s;
        let fade = smooth_step(t_s / fade_s) * smooth_step((e.duration_s - t_s) / fade_s);
        amplitude_rad * fade * (turned_rad + phase_rad).sin()
    };
    let segments = MAX_WAYPOINTS - 1;
    let (times_s, poses): (Vec<f64>, Vec<JointVector>) = (0..=segments)
        .map(|k| {
            let t_s = e.duration_s * k as f64 / segments as f64;
            let mut q = e.pose_rad;
            q[joint] += at(t_s);
            (t_s, q)
        })
        .unzip();
    let trajectory = JointTrajectory::new(&times_s, &poses);
    let trajectory = trajectory.map_err(|e| ExcitationError(e.to_string()))?;
    match broken_limit(&trajectory, e, limits, joint) {
        None => Ok(trajectory),
        Some(what) => Err(ExcitationError(format!(
            "the sweep of joint {} breaks a limit: {what}; use a smaller `limits_fraction`",
            joint + 1
        ))),
    }
}

/// A limit that the sweep breaks, with value and time.
fn broken_limit(
    trajectory: &JointTrajectory,
    e: &Excitation,
    limits: &Limits,
    joint: usize,
) -> Option<String> {
    if let Some(margin) = limits.worst_violation(trajectory) {
        return Some(margin.describe());
    }
    let (tool, tool_max) = (limits.tcp_margin(trajectory).value, e.tool_speed_max_m_s);
    if tool > tool_max {
        return Some(format!(
            "tool speed {tool:.3} m/s against {tool_max:.3} m/s"
        ));
    }
    let jerk = trajectory.extrema(joint).qddd.value.abs();
    let jerk_max = limits.jerk_max_rad_s3[joint];
    (jerk > jerk_max).then(|| format!("jerk {jerk:.0} rad/s³ against {jerk_max:.0} rad/s³"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_move_one_joint_within_all_limits_for_any_seed() {
        let limits = Limits::default();
        for seed in 0..20 {
            let e = Excitation {
                seed,
                ..Excitation::default()
            };
            for joint in 0..JOINTS {
                let t = sweep(&e, &limits, &Pole::default(), joint).unwrap();
                assert!((t.end() - e.pose_rad).max_abs() < 1e-12);
                for other in 0..JOINTS {
                    let x = t.extrema(other);
                    let travel = x.q_max.value - x.q_min.value;
                    assert_eq!(other == joint, travel > 0.01, "{joint} {other}: {travel}");
                }
                let x = t.extrema(joint);
                assert!(x.qdd.value.abs() < 0.6 * limits.acceleration_max_rad_s2[joint]);
                assert!(limits.tcp_margin(&t).value <= e.tool_speed_max_m_s);
            }
        }
    }

    #[test]
    fn values_out_of_range_are_refused_by_key() {
        for wrong in [
            "highest_hz = 60.0",
            "lowest_hz = nan",
            "duration_s = 0.0",
            "limits_fraction = 2.0",
            "tool_speed_max_m_s = 9.0",
            "pose_rad = [6.2, 6.2, 6.2, 6.2, 6.2, 6.2, 6.2]",
        ] {
            let e: Excitation = toml::from_str(wrong).unwrap();
            let refusal = sweep(&e, &Limits::default(), &Pole::default(), 0).unwrap_err();
            let (said, key) = (refusal.to_string(), wrong.split(' ').next().unwrap());
            assert!(said.contains(&format!("`{key}`")), "{said}");
        }
    }
}
