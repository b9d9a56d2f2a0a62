//! Arms that follow 20 to 120 ms late: a measured lag is no fault, and a joint that sticks is
//! found against it. `WAG_LONG_TESTS=1` makes 10 000 throws instead of 200.

use super::stage::{Stage, config, fastest_through};
use arm_model::{JOINTS, JointTrajectory, Limits, LimitsSpec};
use hil_tests::scenario::entry;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::control::monitor::prediction::{MeasuredLag, MeasuredLags};
use shared_types::ipc::CauseRecord;
use shared_types::{CommandInterface, FaultCode, MonotonicNs};
use xarm_sim::{FaultScript, JointLag};

/// Standard deviation of the reported joints (rad).
const NOISE_RAD: f64 = 2e-4;

/// An arm, what was measured of it, and what it is to throw.
struct Case {
    lags: [JointLag; JOINTS],
    measured: MeasuredLags,
    throw: JointTrajectory,
}

impl Case {
    /// Each joint has a lag of its own, 20 to 120 ms in slow motion, a fifth to three fifths of it
    /// dead time; measured to 2 ms and 3 %.
    fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let lags = core::array::from_fn(|_| {
            let late_s = rng.random_range(0.020..0.120);
            let dead_time_s = late_s * rng.random_range(0.2..0.6);
            let damping_ratio = rng.random_range(0.7..1.1);
            JointLag {
                dead_time_s,
                natural_frequency_rad_s: 2.0 * damping_ratio / (late_s - dead_time_s),
                damping_ratio,
            }
        });
        let measured = lags.map(|lag: JointLag| {
            let mut about = || rng.random_range(0.97..1.03);
            Some(MeasuredLag {
                natural_frequency_rad_s: lag.natural_frequency_rad_s * about(),
                damping_ratio: lag.damping_ratio * about(),
                dead_time_s: (lag.dead_time_s + rng.random_range(-0.002..0.002)).max(0.0),
            })
        });
        let from = arm_model::joint::START_POSE;
        let mut pose = |way_rad: f64| {
            let mut q = from;
            for j in 0..JOINTS {
                q[j] += rng.random_range(-way_rad..way_rad);
            }
            q
        };
        let poses = [from, pose(0.3), pose(0.6), pose(0.3)];
        // As plans do, it leaves a little of the tool's speed to late setpoints.
        let mut spec = LimitsSpec::from(Limits::default());
        spec.tcp_speed_max_m_s *= 0.95;
        let throw = fastest_through(&poses, &spec.try_into().unwrap(), 0.01, 10..400)
            .expect("slow enough, it fits the limits");
        Self {
            lags,
            measured,
            throw,
        }
    }

    /// The arm, about to throw under a script of faults.
    fn stage(&self, measured: MeasuredLags, script: &str) -> Stage {
        let mut rig = config(CommandInterface::ServoPosition, script);
        rig.arm.joint_lags = Some(self.lags);
        rig.arm.encoder_noise_rad = NOISE_RAD;
        rig.lags = measured;
        // The arm is held where noisy encoders say that it stands.
        let throw = |held| {
            let off = held - self.throw.start();
            let poses: Vec<_> = self.throw.waypoints().iter().map(|q| *q + off).collect();
            JointTrajectory::new(self.throw.times_s(), &poses).unwrap()
        };
        let mut stage = Stage::throwing_from(rig, throw);
        stage.begin();
        stage
    }

    /// What stops the throw, in which nothing happens but that `late` cycles are lost.
    fn stopped_by(&self, measured: MeasuredLags, late: u64) -> Option<CauseRecord> {
        let mut stage = self.stage(measured, "");
        stage.run_fraction(0.5);
        stage.rig.oversleep([late * 4_000_000]);
        stage.finish();
        let causes = &stage.rig.log.causes;
        assert_eq!(stage.finished() + causes.len(), 1, "{causes:?}");
        causes.first().copied()
    }
}

#[test]
fn a_measured_lag_of_20_to_120_ms_stops_no_throw() {
    let long = std::env::var_os("WAG_LONG_TESTS").is_some();
    let throws = if long { 10_000 } else { 200 };
    let thrown = |seed: u64| {
        let case = Case::draw(seed);
        let stopped = case.stopped_by(case.measured, seed % 3);
        stopped.map(|cause| (seed, cause.fault(), cause.limit))
    };
    let stopped: Vec<_> = (0..throws).filter_map(thrown).collect();
    assert!(stopped.is_empty(), "of {throws}: {stopped:?}");
    // Without, the tracking window of 80 ms is all there is.
    let unmeasured = |seed: &u64| Case::draw(*seed).stopped_by(MeasuredLags::default(), 0);
    let stopped = (0..40).filter(|seed| unmeasured(seed).is_some()).count();
    println!("{throws} throws, none stopped; unmeasured {stopped} of 40");
    assert!(stopped > 0, "the lags are too small to be told from faults");
}

/// The joint (0-based) that is fastest on the way, and when it first has nearly its top speed (s).
fn fastest(throw: &JointTrajectory) -> (usize, f64) {
    let samples = || (0..500).map(|k| f64::from(k) / 500.0 * throw.duration_s());
    let speed = |j: usize, t_s: f64| throw.state_at(t_s).qd[j].abs();
    let top = |j: usize| samples().map(|t_s| speed(j, t_s)).fold(0.0, f64::max);
    let joint = (0..JOINTS).fold(0, |a, b| if top(b) > top(a) { b } else { a });
    let fast = 0.7 * top(joint);
    let at_s = samples().find(|t_s| speed(joint, *t_s) > fast);
    (joint, at_s.unwrap_or_default())
}

#[test]
fn a_joint_that_sticks_is_found_within_100_ms_beyond_its_lag() {
    let mut beyond_s = Vec::new();
    for seed in 20_000..20_060 {
        let case = Case::draw(seed);
        let (joint, at_s) = fastest(&case.throw);
        let mut stage = case.stage(case.measured, "");
        stage.rig.run_for(at_s);
        let stuck = format!("joint_stuck, joint = {}, duration_s = 8", joint + 1);
        let script: FaultScript = entry("at_s = 0.0", &stuck).parse().unwrap();
        stage.rig.inject(script.faults[0]);
        stage.finish();
        let [cause] = stage.rig.log.causes[..] else {
            panic!("seed {seed}: {:?}", stage.rig.log.causes);
        };
        let found = [FaultCode::JointStuck, FaultCode::TrackingError].contains(&cause.fault());
        assert!(found, "seed {seed}: {cause:?}");
        let lag = case.lags[joint];
        let late_s = lag.dead_time_s + 2.0 * lag.damping_ratio / lag.natural_frequency_rad_s;
        let took_s = MonotonicNs(cause.stamp_ns).since_s(stage.fault_began(1));
        beyond_s.push(took_s - late_s);
    }
    beyond_s.sort_by(f64::total_cmp);
    println!("beyond the lag, sorted (s): {beyond_s:.3?}");
    assert!(
        beyond_s.last().is_some_and(|most| *most <= 0.1),
        "{beyond_s:.3?}"
    );
}
