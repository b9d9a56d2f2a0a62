//! Batches of simulations: checks, grouping into lanes, threads, repeats.

use crate::approach::ClosestApproach;
use crate::base_path::{BasePath, NotFinite, attitude};
use crate::equilibrium::hanging_links;
use crate::error::SimulateError;
use crate::frames::{FrameTimes, NodeTrack};
use crate::group::{GroupTask, Member, MemberResult};
use crate::lanes::Kernel;
use crate::motion::AttachMotion;
use nalgebra::{UnitQuaternion, Vector3};
use shared_types::RopeParams;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// How much smaller the steps of a repeated rollout are.
const REPEAT_DIVISOR: f64 = 4.0;
/// Most steps of one rollout; more is a mistake in step or horizon.
const MAX_STEPS: f64 = 1e8;

/// Number type of the simulation. Errors of [`Precision::F32`] level off at 0.01-0.13
/// mm after seconds of motion; it is about twice as fast.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl Precision {
    /// Fastest kernel of this precision on this processor.
    #[must_use]
    pub fn fastest_kernel(self) -> Kernel {
        let single = self == Self::F32;
        let portable = if single {
            Kernel::PortableF32
        } else {
            Kernel::PortableF64
        };
        Kernel::ALL
            .into_iter()
            .find(|k| k.is_single_precision() == single && k.is_available())
            .unwrap_or(portable)
    }
}

/// State of the rope at t = 0, at rest in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Straight along -z of the attach frame, joint 0 turned.
    Straight {
        /// Rotation vector of joint 0 in the attach frame (rad).
        joint0_rotvec: [f64; 3],
    },
    /// Hanging still below the attach frame's first pose.
    Equilibrium,
}

/// How to simulate; the same for all candidates of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimOptions {
    /// Longest time step (s); 0.5 ms for throws, 1 ms for wiggles.
    pub step_s: f64,
    /// Number type.
    pub precision: Precision,
    /// State at t = 0.
    pub start: Start,
    /// When to record node positions.
    pub frames: FrameTimes,
    /// Point (m, world) whose distance to the lead is watched.
    pub closest_to_m: Option<[f64; 3]>,
    /// End of the simulation (s), from t = 0.
    pub horizon_s: f64,
    /// Worker threads; results do not depend on it.
    pub threads: usize,
}

/// One rope on one motion.
#[derive(Clone, Copy)]
pub struct Candidate<'a> {
    /// The rope.
    pub rope: &'a RopeParams,
    /// Motion of its attach frame. Candidates with the very same motion (the same
    /// reference) share its evaluation.
    pub motion: &'a dyn AttachMotion,
}

impl core::fmt::Debug for Candidate<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Candidate")
            .field("rope", self.rope)
            .finish_non_exhaustive()
    }
}

/// How a rollout went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Within the steps asked for.
    Clean,
    /// It blew up and was repeated in steps of a quarter, which went well.
    RerunAtQuarterStep,
    /// It blew up both times: the numbers are finite but mean nothing.
    Diverged,
}

/// One simulated motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// Node positions at the frame times. After [`Outcome::Diverged`] the last finite
    /// frame is repeated.
    pub nodes: NodeTrack,
    /// Closest approach of the lead to [`SimOptions::closest_to_m`], in continuous
    /// time; `None` if not asked for or [`Outcome::Diverged`].
    pub closest: Option<ClosestApproach>,
    /// Highest speed of the lead at step ends (m/s); 0 after [`Outcome::Diverged`].
    pub peak_tip_speed_m_s: f64,
    /// How it went.
    pub outcome: Outcome,
    /// Largest joint angle (rad). Beyond about 2.6 the model's own law (torque flips
    /// at pi) makes the motion ill-posed.
    pub max_joint_angle_rad: f64,
}

/// Simulates all candidates; results in their order. Candidates are grouped by link
/// count into lanes and lane groups are spread over threads; a candidate's result does
/// not depend on its neighbours, its lane, or the number of threads.
///
/// # Errors
/// The first option or candidate that cannot be simulated, by name.
pub fn roll_out(
    candidates: &[Candidate],
    options: &SimOptions,
) -> Result<Vec<Rollout>, SimulateError> {
    roll_out_with(options.precision.fastest_kernel(), candidates, options)
}

/// [`roll_out`] with a chosen kernel, whose number type overrides
/// [`SimOptions::precision`].
///
/// # Errors
/// As [`roll_out`].
pub fn roll_out_with(
    kernel: Kernel,
    candidates: &[Candidate],
    options: &SimOptions,
) -> Result<Vec<Rollout>, SimulateError> {
    check(candidates, options)?;
    let all: Vec<usize> = (0..candidates.len()).collect();
    let batch = Batch {
        kernel,
        candidates,
        options,
        step_s: options.step_s,
    };
    let mut results = batch.run(&all)?;
    let failed: Vec<usize> = all.into_iter().filter(|i| !results[*i].survived).collect();
    let mut rollouts: Vec<Rollout> = results
        .drain(..)
        .map(|r| rollout(r, Outcome::Clean))
        .collect();
    if !failed.is_empty() {
        let batch = Batch {
            step_s: options.step_s / REPEAT_DIVISOR,
            ..batch
        };
        for (index, result) in failed.iter().zip(batch.run(&failed)?) {
            rollouts[*index] = rollout(result, Outcome::RerunAtQuarterStep);
        }
    }
    Ok(rollouts)
}

fn rollout(mut result: MemberResult, success: Outcome) -> Rollout {
    if !result.survived {
        result.nodes.hold_last_finite();
        return Rollout {
            nodes: result.nodes,
            closest: None,
            peak_tip_speed_m_s: 0.0,
            outcome: Outcome::Diverged,
            max_joint_angle_rad: result.max_joint_angle_rad,
        };
    }
    Rollout {
        nodes: result.nodes,
        closest: result.closest,
        peak_tip_speed_m_s: result.peak_tip_speed_m_s,
        outcome: success,
        max_joint_angle_rad: result.max_joint_angle_rad,
    }
}

/// Candidates to run with one kernel and step.
struct Batch<'a> {
    kernel: Kernel,
    candidates: &'a [Candidate<'a>],
    options: &'a SimOptions,
    step_s: f64,
}

/// A motion several candidates share, evaluated by whoever comes first.
type SharedPath = OnceLock<Result<BasePath, NotFinite>>;

impl Batch<'_> {
    /// Runs the candidates with these indices; results in the same order.
    fn run(&self, indices: &[usize]) -> Result<Vec<MemberResult>, SimulateError> {
        let groups = self.groups(indices);
        let shared = self.shared_paths(indices);
        let threads = self.options.threads.clamp(1, groups.len().max(1));
        let mut results: Vec<Option<MemberResult>> = Vec::new();
        results.resize_with(self.candidates.len(), || None);
        let work = |first: usize| -> Result<Vec<(usize, MemberResult)>, SimulateError> {
            let mut out = Vec::new();
            for group in groups.iter().skip(first).step_by(threads) {
                out.extend(group.iter().copied().zip(self.run_group(group, &shared)?));
            }
            Ok(out)
        };
        let mut finished = Vec::with_capacity(threads);
        std::thread::scope(|scope| {
            let handles: Vec<_> = (1..threads)
                .map(|first| scope.spawn(move || work(first)))
                .collect();
            finished.push(work(0));
            for handle in handles {
                finished.push(handle.join().unwrap_or(Err(SimulateError::WorkerPanicked)));
            }
        });
        for part in finished {
            for (index, result) in part? {
                results[index] = Some(result);
            }
        }
        indices
            .iter()
            .map(|i| results[*i].take().ok_or(SimulateError::WorkerPanicked))
            .collect()
    }

    /// Indices by link count, cut into lane groups.
    fn groups(&self, indices: &[usize]) -> Vec<Vec<usize>> {
        let mut buckets: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for index in indices {
            buckets
                .entry(self.candidates[*index].rope.links)
                .or_default()
                .push(*index);
        }
        buckets
            .values()
            .flat_map(|bucket| bucket.chunks(self.kernel.lanes()))
            .map(<[usize]>::to_vec)
            .collect()
    }

    /// A slot for every motion that more than one candidate has.
    fn shared_paths(&self, indices: &[usize]) -> BTreeMap<usize, SharedPath> {
        let mut users: BTreeMap<usize, usize> = BTreeMap::new();
        for index in indices {
            *users
                .entry(address(self.candidates[*index].motion))
                .or_default() += 1;
        }
        users
            .into_iter()
            .filter(|(_, count)| *count > 1)
            .map(|(address, _)| (address, SharedPath::new()))
            .collect()
    }

    fn run_group(
        &self,
        group: &[usize],
        shared: &BTreeMap<usize, SharedPath>,
    ) -> Result<Vec<MemberResult>, SimulateError> {
        let build = |motion| BasePath::new(motion, self.step_s, self.options.horizon_s);
        let mut own = Vec::with_capacity(group.len());
        for index in group {
            let motion = self.candidates[*index].motion;
            let is_own = !shared.contains_key(&address(motion));
            own.push(is_own.then(|| build(motion)));
        }
        let mut members = Vec::with_capacity(group.len());
        for (index, own) in group.iter().zip(&own) {
            let candidate = &self.candidates[*index];
            let path = match (own, shared.get(&address(candidate.motion))) {
                (Some(path), _) => path,
                (None, Some(slot)) => slot.get_or_init(|| build(candidate.motion)),
                (None, None) => continue,
            };
            let path = path
                .as_ref()
                .map_err(|bad| SimulateError::MotionNotFinite {
                    candidate: *index,
                    time_s: bad.time_s,
                })?;
            let links = start_attitudes(candidate.rope, path, self.options.start);
            members.push(Member {
                rope: candidate.rope,
                path,
                links,
            });
        }
        Ok(self.kernel.run(GroupTask {
            members: &members,
            frames: self.options.frames,
            closest_to_m: self.options.closest_to_m,
            single_precision: self.kernel.is_single_precision(),
        }))
    }
}

/// Identity of a motion: the address of its data.
fn address(motion: &dyn AttachMotion) -> usize {
    core::ptr::from_ref(motion).cast::<()>().addr()
}

fn start_attitudes(rope: &RopeParams, path: &BasePath, start: Start) -> Vec<[f64; 4]> {
    match start {
        Start::Straight { joint0_rotvec } => {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(joint0_rotvec));
            let q = attitude(&path.start) * turn;
            vec![[q.w, q.i, q.j, q.k]; rope.links as usize]
        }
        Start::Equilibrium => hanging_links(rope, &path.start.r),
    }
}

fn check(candidates: &[Candidate], options: &SimOptions) -> Result<(), SimulateError> {
    let positive = |field: &'static str, value: f64| {
        if value.is_finite() && value > 0.0 {
            Ok(())
        } else {
            Err(SimulateError::Option {
                field,
                value,
                need: "must be finite and above 0",
            })
        }
    };
    positive("step_s", options.step_s)?;
    positive("horizon_s", options.horizon_s)?;
    let steps = options.horizon_s / options.step_s;
    if steps > MAX_STEPS {
        let need = "gives more than 1e8 steps; shorten the horizon or lengthen the step";
        return Err(SimulateError::Option {
            field: "step_s",
            value: options.step_s,
            need,
        });
    }
    if options.frames.count > 0 {
        positive("frames.period_s", options.frames.period_s)?;
        let last_s = options.frames.time_s(options.frames.count - 1);
        if !(options.frames.first_s >= 0.0 && last_s <= options.horizon_s + 1e-9) {
            return Err(SimulateError::FramesOutsideHorizon {
                first_s: options.frames.first_s,
                last_s,
                horizon_s: options.horizon_s,
            });
        }
    }
    let watched = options.closest_to_m.unwrap_or([0.0; 3]);
    let turned = match options.start {
        Start::Straight { joint0_rotvec } => joint0_rotvec,
        Start::Equilibrium => [0.0; 3],
    };
    for (field, vector) in [("closest_to_m", watched), ("start.joint0_rotvec", turned)] {
        if let Some(value) = vector.into_iter().find(|v| !v.is_finite()) {
            return Err(SimulateError::Option {
                field,
                value,
                need: "must be finite",
            });
        }
    }
    for (index, candidate) in candidates.iter().enumerate() {
        candidate
            .rope
            .validate()
            .map_err(|source| SimulateError::Rope {
                candidate: index,
                source,
            })?;
        let ends_s = candidate.motion.duration_s();
        let long_enough = candidate.motion.holds_after_end() || ends_s >= options.horizon_s - 1e-9;
        if !long_enough {
            let horizon_s = options.horizon_s;
            return Err(SimulateError::MotionTooShort {
                candidate: index,
                ends_s,
                horizon_s,
            });
        }
    }
    Ok(())
}
