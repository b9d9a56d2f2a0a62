//! The ropes and motions that are simulated, all drawn from one seed.

use crate::bench::spent::{Spent, least};
use arm_model::trajectory::TrajectoryError;
use arm_model::{JointTrajectory, JointVector, Pole};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{
    AttachMotion, Candidate, Kernel, Obstacle, PlannedArm, Precision, Rollout, Scene, SimOptions,
    SimulateError, Start, Watch, roll_out_in_with,
};
use shared_types::rope::RANGES;
use shared_types::{BendingFriction, RopeExtras, RopeParams};

/// Links of a typical rope.
pub const LINKS: u32 = 22;
/// Ropes drawn: the wiggle job needs most of them.
const ROPES: usize = 3000;
/// Throws drawn: the largest batch needs most of them.
const THROWS: usize = 4096;
/// Pose the motions start from (rad).
const POSE: [f64; 7] = [0.0, -0.5, 0.0, 1.0, 0.0, 1.6, 0.0];
/// Point whose distance to the lead is watched (m).
const TARGET_M: [f64; 3] = [1.2, 0.0, 0.6];
/// Friction of the floor.
const FRICTION: f64 = 0.5;

/// Ropes and motions.
#[derive(Debug)]
pub struct Workload {
    /// Uniform in the parameter ranges, all with [`LINKS`] links.
    pub ropes: Vec<RopeParams>,
    /// The same with a rest curvature, friction in bending and a clamp of its own stiffness.
    pub real: Vec<RopeParams>,
    /// A spline of its own for every candidate: seven waypoints 0.15 s apart, joints 2,
    /// 4 and 6 walking at random by up to 0.15 rad, then held.
    pub throws: Vec<PlannedArm>,
    /// Joint 6 swinging by 25 degrees at 0.75 Hz for 4.9 s, then held.
    pub wiggle: PlannedArm,
    /// An arm that stands still.
    pub still: PlannedArm,
}

impl Workload {
    /// Draws everything from `seed`.
    pub fn new(seed: u64) -> Result<Self, TrajectoryError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let ropes: Vec<RopeParams> = (0..ROPES).map(|_| rope(&mut random)).collect();
        let throws = (0..THROWS)
            .map(|_| throw(&mut random))
            .collect::<Result<_, _>>()?;
        let still = JointTrajectory::hold(JointVector(POSE), 1.0)?;
        Ok(Self {
            real: ropes.iter().map(with_discrepancy).collect(),
            ropes,
            throws,
            wiggle: wiggle()?,
            still: PlannedArm::new(still, Pole::default()),
        })
    }

    /// The first `count` throws, each with a rope of its own.
    pub fn throwing(&self, count: usize) -> Vec<Candidate<'_>> {
        self.throwing_with(&self.ropes, count)
    }

    /// The same with some ropes, in turn.
    pub fn throwing_with<'a>(
        &'a self,
        ropes: &'a [RopeParams],
        count: usize,
    ) -> Vec<Candidate<'a>> {
        self.throws
            .iter()
            .zip(ropes.iter().cycle())
            .take(count)
            .map(|(motion, rope)| Candidate::new(rope, motion))
            .collect()
    }

    /// The first `count` ropes on one motion.
    pub fn on<'a>(&'a self, motion: &'a dyn AttachMotion, count: usize) -> Vec<Candidate<'a>> {
        self.ropes
            .iter()
            .take(count)
            .map(|rope| Candidate::new(rope, motion))
            .collect()
    }

    /// A floor this far below the clamp of the arm that stands still.
    pub fn floor(&self, below_m: f64) -> Scene {
        let clamp_m = self.still.at(0.0).p_m;
        Scene::with(vec![Obstacle::floor(clamp_m.z - below_m, FRICTION)])
    }
}

/// Throws: steps of 0.5 ms, closest approach watched, nothing recorded.
pub fn throw_options(horizon_s: f64, threads: usize) -> SimOptions {
    SimOptions {
        watch: Watch::point(TARGET_M),
        threads,
        ..SimOptions::new(5e-4, Precision::F32, horizon_s)
    }
}

/// The same from a straight rope whose first joint is turned (rad).
pub fn released(joint0_rotvec: [f64; 3], options: SimOptions) -> SimOptions {
    SimOptions {
        start: Start::Straight { joint0_rotvec },
        ..options
    }
}

/// A batch simulated several times.
pub struct Timed {
    /// Least times of one simulation.
    pub spent: Spent,
    /// Processor time per rope and step (ns), repeats not counted as steps.
    pub ns_per_rope_step: f64,
    pub rollouts: Vec<Rollout>,
}

/// Simulates a batch so many times.
pub fn timed(
    repeats: usize,
    scene: &Scene,
    kernel: Kernel,
    candidates: &[Candidate],
    options: &SimOptions,
) -> Result<Timed, SimulateError> {
    let (spent, rollouts) = least(repeats, || {
        roll_out_in_with(kernel, scene, candidates, options)
    })?;
    let rope_steps = options.horizon_s / options.step_s * rollouts.len() as f64;
    Ok(Timed {
        spent,
        ns_per_rope_step: 1e9 * spent.cpu_s / rope_steps,
        rollouts,
    })
}

fn rope(random: &mut ChaCha8Rng) -> RopeParams {
    let numbers = RANGES.map(|r| random.random_range(r.min..r.max));
    RopeParams {
        links: LINKS,
        ..RopeParams::from_array(numbers)
    }
}

/// As a fit beyond the nine parameters finds ropes.
fn with_discrepancy(rope: &RopeParams) -> RopeParams {
    rope.with_extras(RopeExtras {
        rest_curvature_per_m: [0.3, -0.2, 0.0],
        clamp_stiffness: 1.4,
        friction: Some(BendingFriction {
            moment_max_nm: 0.2 * rope.bending_stiffness_nm2(),
            slip_curvature_per_m: 0.5,
        }),
        ..RopeExtras::NONE
    })
}

fn throw(random: &mut ChaCha8Rng) -> Result<PlannedArm, TrajectoryError> {
    let mut q = POSE;
    spline(7, 0.15, |_| {
        for joint in [1, 3, 5] {
            q[joint] += random.random_range(-0.15..0.15);
        }
        q
    })
}

fn wiggle() -> Result<PlannedArm, TrajectoryError> {
    spline(50, 0.1, |t_s| {
        let mut q = POSE;
        q[5] += 25_f64.to_radians() * (core::f64::consts::TAU * 0.75 * t_s).sin();
        q
    })
}

/// An arm through the poses of so many times, which are `period_s` apart.
fn spline(
    count: u32,
    period_s: f64,
    pose: impl FnMut(f64) -> [f64; 7],
) -> Result<PlannedArm, TrajectoryError> {
    let times_s: Vec<f64> = (0..count).map(|i| period_s * f64::from(i)).collect();
    let poses = times_s.iter().copied().map(pose);
    let waypoints: Vec<JointVector> = poses.map(JointVector).collect();
    JointTrajectory::new(&times_s, &waypoints).map(|path| PlannedArm::new(path, Pole::default()))
}
