//! The nine wiggles of the paper's ablation.
//!
//! Six of joint 6 with 20 or 30 degrees at 0.5, 0.75 or 1 Hz, two random ones, and the
//! main one, which here is the configured one. The paper's text gives neither how its
//! wiggles begin and end nor what its random ones are. Here a sine fades in and out
//! within 0.8 s, and a random one goes through random poses of joints 2, 4 and 6 (the
//! planar ones). Large ones may break a limit of the arm; they are simulated all the
//! same, and [`AblatedWiggle::breaks`] reports it.

use arm_model::{JointTrajectory, JointVector, Limits};
use experiments::trials::PAPER;
use planner::wiggle::{WiggleConfig, WiggleError, unlimited};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use shared_types::rope::ROPE_PARAMETERS;

/// The paper's mean absolute errors with one wiggle: thousandths of the parameters' units,
/// in the order of their ranges.
type Thousandths = [u16; ROPE_PARAMETERS];

/// Amplitude (degrees), frequency (Hz) and the paper's errors: "Wiggle Study: Mean Absolute
/// Error across wiggle variants", columns 1 to 6.
const SINES: [(f64, f64, Thousandths); 6] = [
    (20.0, 0.5, [122, 7, 10, 118, 2, 6, 5, 8, 153]),
    (20.0, 0.75, [127, 13, 33, 257, 3, 10, 11, 8, 160]),
    (20.0, 1.0, [225, 17, 38, 258, 3, 10, 14, 8, 160]),
    (30.0, 0.5, [205, 15, 18, 224, 3, 13, 8, 8, 179]),
    (30.0, 0.75, [206, 18, 31, 244, 4, 12, 11, 8, 169]),
    (30.0, 1.0, [360, 22, 96, 336, 6, 14, 18, 8, 241]),
];
/// The same with its two random wiggles.
const RANDOM: [Thousandths; 2] = [
    [2098, 57, 36, 388, 3, 19, 21, 7, 205],
    [1453, 28, 40, 322, 4, 14, 16, 8, 208],
];
/// Time over which a sine fades in and out (s).
const FADE_S: f64 = 0.8;
/// Time between the poses of a random wiggle (s).
const POSE_S: f64 = 0.7;
/// Joints of a random wiggle (0-based) and the most that each is turned (degrees).
const TURNED: [(usize, f64); 3] = [(1, 4.0), (3, 6.0), (5, 15.0)];
/// Seed of the random wiggles.
const SEED: u64 = 0x0b1a_7100;

/// One wiggle of the ablation.
#[derive(Debug, Clone)]
pub(super) struct AblatedWiggle {
    /// What it is.
    pub name: String,
    /// Mean absolute errors of the paper's network, order of the parameter ranges.
    pub paper: [f64; ROPE_PARAMETERS],
    /// Limit of the arm that it breaks, if one.
    pub breaks: Option<String>,
    pub trajectory: JointTrajectory,
}

/// The nine wiggles; `main` is the configured one.
pub(super) fn ablated_wiggles(main: &WiggleConfig) -> Result<Vec<AblatedWiggle>, WiggleError> {
    let limits = Limits::default();
    let one = |name, paper, trajectory: Result<JointTrajectory, WiggleError>| {
        let trajectory = trajectory?;
        Ok(AblatedWiggle {
            name,
            paper,
            breaks: limits.worst_violation(&trajectory).map(|m| m.describe()),
            trajectory,
        })
    };
    let units = |thousandths: Thousandths| thousandths.map(|t| f64::from(t) / 1e3);
    let sines = SINES.into_iter().map(|(degrees, frequency_hz, paper)| {
        let config = WiggleConfig {
            amplitude_rad: degrees.to_radians(),
            frequency_hz,
            ramp_s: FADE_S,
            ..*main
        };
        let name = format!("{degrees:.0} degrees, {frequency_hz} Hz");
        one(name, units(paper), unlimited(&config))
    });
    let random = (1_u64..).zip(RANDOM).map(|(number, paper)| {
        let trajectory = random_wiggle(main, SEED + number);
        one(format!("random {number}"), units(paper), trajectory)
    });
    let name = format!(
        "main: {:.1} degrees, {} Hz",
        main.amplitude_rad.to_degrees(),
        main.frequency_hz
    );
    sines
        .chain(random)
        .chain([one(name, PAPER, unlimited(main))])
        .collect()
}

/// Random poses about that of `main`, which it begins and ends with, at rest as long.
fn random_wiggle(main: &WiggleConfig, seed: u64) -> Result<JointTrajectory, WiggleError> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut times_s = vec![0.0];
    let mut poses: Vec<JointVector> = vec![main.pose_rad];
    let mut time_s = POSE_S;
    while time_s < main.duration_s - 0.5 * POSE_S {
        let mut q = main.pose_rad;
        for (joint, most) in TURNED {
            q[joint] += rng.random_range(-most..=most).to_radians();
        }
        times_s.push(time_s);
        poses.push(q);
        time_s += POSE_S;
    }
    // Knots close to each other hold the still end still.
    let mut time_s = main.duration_s;
    while time_s < main.filmed_s {
        times_s.push(time_s);
        poses.push(main.pose_rad);
        time_s += 0.1;
    }
    times_s.push(main.filmed_s.max(time_s));
    poses.push(main.pose_rad);
    Ok(JointTrajectory::new(&times_s, &poses)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_wiggles_last_as_long_as_the_film_and_end_at_rest() {
        let main = WiggleConfig::default();
        let all = ablated_wiggles(&main).unwrap();
        assert_eq!(all.len(), 9);
        for wiggle in &all {
            let t = &wiggle.trajectory;
            assert!(t.duration_s() >= 400.0 / 60.0, "{}", wiggle.name);
            assert!(
                t.state_at(main.filmed_s).qd.max_abs() < 0.02,
                "{}",
                wiggle.name
            );
            let middle = t.state_at(1.6).q;
            let turned = (0..7).filter(|j| (middle[*j] - main.pose_rad[*j]).abs() > 1e-6);
            let planar = turned.clone().all(|j| [1, 3, 5].contains(&j));
            assert!(planar && turned.count() > 0, "{}", wiggle.name);
        }
        assert!(all.last().unwrap().breaks.is_none());
        // 30 degrees at 1 Hz turn joint 6 by 3.3 rad/s.
        assert!(all[5].breaks.is_some());
        let again = ablated_wiggles(&main).unwrap();
        assert!(
            all.iter()
                .zip(&again)
                .all(|(a, b)| a.trajectory == b.trajectory)
        );
    }
}
