//! Batches of simulations: grouping into lanes, threads, repeats of what blew up.

use crate::base_path::{BasePath, Interval, NotFinite};
use crate::contact::check_start;
use crate::equilibrium::{hanging_links, swaying_links};
use crate::error::SimulateError;
use crate::group::{GroupTask, Member};
use crate::knot::attitude;
use crate::lanes::Kernel;
use crate::motion::AttachMotion;
use crate::rollout::{Candidate, Outcome, Rollout, SimOptions, Start, check};
use crate::scene::{ContactSummary, DominoOutcome, Scene};
use crate::watch::Watched;
use nalgebra::{UnitQuaternion, Vector3};
use shared_types::RopeState;
use shared_types::rope_state::Sway;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How much smaller the steps of a repeated rollout are.
pub(crate) const REPEAT_DIVISOR: f64 = 4.0;

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
    roll_out_in(&Scene::EMPTY, candidates, options)
}

/// [`roll_out`] among obstacles and a domino. Use steps of at most 0.5 ms.
///
/// # Errors
/// As [`roll_out`], and what is wrong with the scene.
pub fn roll_out_in(
    scene: &Scene,
    candidates: &[Candidate],
    options: &SimOptions,
) -> Result<Vec<Rollout>, SimulateError> {
    let kernel = options.precision.fastest_kernel();
    roll_out_in_with(kernel, scene, candidates, options)
}

/// [`roll_out_in`] with a chosen kernel, whose number type overrides
/// [`SimOptions::precision`].
///
/// # Errors
/// As [`roll_out_in`], and a kernel that this processor lacks.
pub fn roll_out_in_with(
    kernel: Kernel,
    scene: &Scene,
    candidates: &[Candidate],
    options: &SimOptions,
) -> Result<Vec<Rollout>, SimulateError> {
    if !kernel.is_available() {
        return Err(SimulateError::new(format_args!(
            "this processor cannot run the kernel {kernel:?}"
        )));
    }
    check(candidates, options)?;
    scene.check()?;
    let all: Vec<usize> = (0..candidates.len()).collect();
    let batch = Batch {
        kernel,
        scene,
        candidates,
        options,
        step_s: options.step_s,
    };
    let mut rollouts = batch.run(&all)?;
    let diverged = |index: &usize| rollouts[*index].outcome == Outcome::Diverged;
    let failed: Vec<usize> = all.into_iter().filter(diverged).collect();
    if !failed.is_empty() {
        let batch = Batch {
            step_s: options.step_s / REPEAT_DIVISOR,
            ..batch
        };
        for (index, mut repeated) in failed.iter().zip(batch.run(&failed)?) {
            if repeated.outcome == Outcome::Clean {
                repeated.outcome = Outcome::RerunAtQuarterStep;
            } else {
                forget_measures(&mut repeated);
            }
            rollouts[*index] = repeated;
        }
    }
    Ok(rollouts)
}

/// Leaves of a rollout that blew up what is finite.
fn forget_measures(rollout: &mut Rollout) {
    rollout.nodes.hold_last_finite();
    rollout.watched = Watched::default();
    rollout.peak_tip_speed_m_s = 0.0;
    rollout.contacts.fill(ContactSummary::default());
    rollout.domino = rollout.domino.map(|_| DominoOutcome::default());
    rollout.end = None;
}

/// Candidates to run with one kernel and step.
struct Batch<'a> {
    kernel: Kernel,
    scene: &'a Scene,
    candidates: &'a [Candidate<'a>],
    options: &'a SimOptions,
    step_s: f64,
}

/// A motion several candidates share, evaluated by whoever comes first.
type SharedPath = OnceLock<Result<BasePath, NotFinite>>;

impl Batch<'_> {
    /// Runs the candidates with these indices; results in the same order.
    fn run(&self, indices: &[usize]) -> Result<Vec<Rollout>, SimulateError> {
        let groups = self.groups(indices);
        let shared = self.shared_paths(indices);
        let threads = self.options.threads.clamp(1, groups.len().max(1));
        let mut results: Vec<Option<Rollout>> = Vec::new();
        results.resize_with(self.candidates.len(), || None);
        let next = AtomicUsize::new(0);
        // A refusal comes with its group: whichever worker met it, the first one counts.
        let work = || -> Result<Vec<(usize, Rollout)>, (usize, SimulateError)> {
            let mut out = Vec::new();
            let mut memory = Vec::new();
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(group) = groups.get(at) else { break };
                let results = self.run_group(group, &shared, &mut memory);
                let results = results.map_err(|error| (at, error))?;
                out.extend(group.iter().copied().zip(results));
            }
            Ok(out)
        };
        let mut finished = Vec::with_capacity(threads);
        std::thread::scope(|scope| {
            let handles: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            finished.push(work());
            for handle in handles {
                let panicked = (usize::MAX, SimulateError::worker_panicked());
                finished.push(handle.join().unwrap_or(Err(panicked)));
            }
        });
        let refusals = finished.iter().filter_map(|part| part.as_ref().err());
        if let Some((_, error)) = refusals.min_by_key(|(group, _)| *group) {
            return Err(error.clone());
        }
        for (index, result) in finished.into_iter().flatten().flatten() {
            results[index] = Some(result);
        }
        indices
            .iter()
            .map(|i| {
                results[*i]
                    .take()
                    .ok_or_else(SimulateError::worker_panicked)
            })
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
            if let Some(address) = address(self.candidates[*index].motion) {
                *users.entry(address).or_default() += 1;
            }
        }
        users
            .into_iter()
            .filter(|(_, count)| *count > 1)
            .map(|(address, _)| (address, SharedPath::new()))
            .collect()
    }

    /// `memory` is that of paths of earlier groups, to be used again.
    fn run_group(
        &self,
        group: &[usize],
        shared: &BTreeMap<usize, SharedPath>,
        memory: &mut Vec<Vec<Interval>>,
    ) -> Result<Vec<Rollout>, SimulateError> {
        let build =
            |motion, memory| BasePath::new_in(memory, motion, self.step_s, self.options.horizon_s);
        let slot_of = |motion| address(motion).and_then(|address| shared.get(&address));
        let mut own = Vec::with_capacity(group.len());
        for index in group {
            let motion = self.candidates[*index].motion;
            let is_own = slot_of(motion).is_none();
            own.push(is_own.then(|| build(motion, memory.pop().unwrap_or_default())));
        }
        let mut members = Vec::with_capacity(group.len());
        for (index, own) in group.iter().zip(&own) {
            let candidate = &self.candidates[*index];
            let path = match (own, slot_of(candidate.motion)) {
                (Some(path), _) => path,
                (None, Some(slot)) => slot.get_or_init(|| build(candidate.motion, Vec::new())),
                (None, None) => continue,
            };
            let path = path
                .as_ref()
                .map_err(|bad| SimulateError::motion_not_finite(*index, bad.time_s))?;
            let start = start_state(candidate, path, self.options.start);
            check_start(
                self.scene,
                candidate.rope,
                &path.start.p_m,
                &start.attitudes,
            )
            .map_err(|reason| SimulateError::of(*index, reason))?;
            members.push(Member {
                rope: candidate.rope,
                path,
                start,
                point_m: candidate.point_m,
            });
        }
        let is_alone = self.scene.is_empty() && members.iter().all(|m| m.rope.extras.is_none());
        let results = if is_alone {
            self.kernel.run(self.task::<true>(&members))
        } else {
            self.kernel.run(self.task::<false>(&members))
        };
        drop(members);
        let finished = own.into_iter().flatten().flatten();
        memory.extend(finished.map(|path| path.intervals));
        Ok(results)
    }

    fn task<'m, const ALONE: bool>(&'m self, members: &'m [Member<'m>]) -> GroupTask<'m, ALONE> {
        GroupTask {
            members,
            scene: self.scene,
            max_step_s: self.step_s,
            frames: self.options.frames,
            watch: self.options.watch,
            horizon_s: self.options.horizon_s,
            keeps_end: self.options.keeps_end,
            single_precision: self.kernel.is_single_precision(),
        }
    }
}

/// Identity of a motion: the address of its data, if it has any.
fn address(motion: &dyn AttachMotion) -> Option<usize> {
    (size_of_val(motion) > 0).then(|| core::ptr::from_ref(motion).cast::<()>().addr())
}

fn start_state(candidate: &Candidate, path: &BasePath, start: Start) -> RopeState {
    let rope = candidate.rope;
    if let Some(state) = candidate.state {
        return state.clone();
    }
    match start {
        Start::Straight { joint0_rotvec } => {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(joint0_rotvec));
            let q = attitude(&path.start) * turn;
            RopeState::at_rest(vec![[q.w, q.i, q.j, q.k]; rope.links as usize])
        }
        Start::Equilibrium if candidate.sway == Sway::NONE => {
            RopeState::at_rest(hanging_links(rope, &path.start.r))
        }
        Start::Equilibrium => swaying_links(rope, &path.start.r, &candidate.sway),
    }
}
