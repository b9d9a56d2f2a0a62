//! One group of ropes with equal link counts, advanced from start to horizon.

use crate::algebra::Vec3;
use crate::base_path::BasePath;
use crate::clock::Clock;
use crate::contact::Contacts;
use crate::environment::Environment;
use crate::frames::{FrameRecorder, FrameTimes, NodeTrack};
use crate::kernel::{Elimination, step};
use crate::lanes::{LaneTask, Lanes};
use crate::load::Unloaded;
use crate::rollout::{Outcome, Rollout};
use crate::scene::Scene;
use crate::state::{Link, RopeLanes};
use crate::watch::{Watch, Watcher};
use shared_types::{RopeParams, RopeState};

/// Steps between health checks.
const HEALTH_PERIOD: usize = 32;
/// Largest sane rotation of the whole rope per step (rad, root of the sum of squares
/// over the links); beyond it the velocity terms, which are explicit, have blown up.
const MAX_TURN_PER_STEP_RAD: f64 = 1.5;
/// Largest sane angular velocity, by the same measure (rad/s).
const MAX_SPIN_RAD_S: f64 = 2e4;

/// One rope of a group.
pub(crate) struct Member<'a> {
    pub(crate) rope: &'a RopeParams,
    pub(crate) path: &'a BasePath,
    pub(crate) start: RopeState,
    /// Point that its lead is to come near to, if it has one of its own (m, world).
    pub(crate) point_m: Option<[f64; 3]>,
}

/// The work of one group; at most as many members as the kernel has lanes, all with
/// the same number of links.
/// With `ALONE` there is nothing but the rope: the loop is compiled without a trace of
/// an environment.
pub(crate) struct GroupTask<'a, const ALONE: bool> {
    pub(crate) members: &'a [Member<'a>],
    pub(crate) scene: &'a Scene,
    pub(crate) max_step_s: f64,
    pub(crate) frames: FrameTimes,
    pub(crate) watch: Watch,
    pub(crate) horizon_s: f64,
    pub(crate) keeps_end: bool,
    pub(crate) single_precision: bool,
}

impl<const ALONE: bool> LaneTask for GroupTask<'_, ALONE> {
    /// Those that blew up are [`Outcome::Diverged`]; their numbers may not be finite.
    type Output = Vec<Rollout>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Self::Output {
        let count = self.members.len();
        let Some(first) = self.members.first() else {
            return Vec::new();
        };
        let n = first.start.attitudes.len();
        let mut rope = rope_lanes::<V>(self.members);
        let mut links = start_links::<V>(self.members);
        let mut scratch = vec![Elimination::empty(); n];
        let paths: Vec<&BasePath> = self.members.iter().map(|m| m.path).collect();
        let ropes: Vec<&RopeParams> = self.members.iter().map(|m| m.rope).collect();
        let mut clock = Clock::new(&paths, &ropes, self.watch.origin_m());
        let mut recorder = FrameRecorder::new(self.frames, &clock, n, self.single_precision);
        let points: Vec<_> = self.members.iter().map(|m| m.point_m).collect();
        let start = clock.base();
        let [hanging, swinging] = tip_from_clamp(&links, rope.link_length);
        let mut watcher = Watcher::new(
            &self.watch,
            [start.position.add(hanging), start.velocity.add(swinging)],
            &points,
            self.horizon_s,
        );
        let mut health = Health::<V>::new(count);
        let mut restarts = Vec::with_capacity(count);
        let mut steps = 0_usize;
        let mut environment = (!ALONE).then(|| {
            let origin_m = self.watch.origin_m();
            let contacts = Contacts::new(self.scene, &ropes, self.max_step_s, origin_m);
            Environment::new(contacts, &ropes)
        });
        if let Some(environment) = &mut environment {
            let friction_nm = self.members.iter().map(|m| &m.start.friction_nm[..]);
            environment.start(friction_nm, &links, &rope, &start);
        }
        let mut ends = vec![None; if self.keeps_end { count } else { 0 }];

        loop {
            let goes_on = clock.next_step(&mut rope, &mut restarts);
            keep_ends(&mut ends, &clock, &links, environment.as_ref());
            if !goes_on {
                break;
            }
            if !restarts.is_empty() {
                clear_memory(&mut links, &restarts);
            }
            recorder.before_step(&clock, &links, rope.link_length);
            let base = clock.base();
            let report = match &mut environment {
                Some(environment) => {
                    environment.step(&mut links, &mut scratch, &rope, &base, &mut clock)
                }
                None => step(
                    &mut links,
                    &mut scratch,
                    &rope,
                    &base.dynamics,
                    &clock.scheme,
                    &Unloaded,
                ),
            };
            recorder.after_step(&clock, &links, rope.link_length);
            health.mark_finished(&clock, &links);
            watcher.after_step(
                base.position,
                [
                    base.position.add(report.tip),
                    base.velocity.add(report.tip_velocity),
                ],
                &clock,
                &links,
                rope.link_length,
                health.running,
            );
            steps += 1;
            if steps.is_multiple_of(HEALTH_PERIOD) && !health.check(&links, clock.scheme.h) {
                break;
            }
        }
        health.check(&links, clock.scheme.h);

        let mut tracks = recorder.tracks.into_iter();
        let mut ends = ends.into_iter();
        (0..count)
            .map(|lane| Rollout {
                end: ends.next().flatten().filter(|_| health.alive[lane]),
                nodes: tracks
                    .next()
                    .unwrap_or_else(|| NodeTrack::zeros(0, n + 1, false)),
                watched: watcher.watched(lane, paths[lane]),
                peak_tip_speed_m_s: watcher.peak_speed_m_s(lane),
                outcome: if health.alive[lane] {
                    Outcome::Clean
                } else {
                    Outcome::Diverged
                },
                contacts: environment
                    .as_ref()
                    .map_or_else(Vec::new, |e| e.contacts.summaries_of(lane)),
                domino: environment
                    .as_ref()
                    .and_then(|e| e.contacts.domino_of(lane)),
            })
            .collect()
    }
}

/// Which lanes run, and which have blown up.
struct Health<V> {
    /// 1 in lanes that are still advancing, else 0.
    running: V,
    /// How many they were when last counted.
    clock_running: usize,
    alive: Vec<bool>,
}

impl<V: Lanes> Health<V> {
    #[inline(always)]
    fn new(count: usize) -> Self {
        Self {
            clock_running: count,
            running: V::splat(1.0),
            alive: vec![true; count],
        }
    }

    /// Notes which lanes have passed their end; a last look at them comes first. They
    /// idle on while others advance, and nothing they do then counts.
    #[inline(always)]
    fn mark_finished(&mut self, clock: &Clock<V>, links: &[Link<V>]) {
        if clock.running() == self.clock_running {
            return;
        }
        self.clock_running = clock.running();
        for lane in 0..self.alive.len() {
            if clock.finished(lane) && self.running.get(lane) > 0.0 {
                self.check(links, clock.scheme.h);
                self.running.set(lane, 0.0);
            }
        }
    }

    /// Marks lanes dead whose state is not finite or spins absurdly; false when none
    /// is left.
    #[inline(always)]
    fn check(&mut self, links: &[Link<V>], h: V) -> bool {
        let mut spin = V::splat(0.0);
        for link in links {
            spin = spin + link.w.dot(link.w);
        }
        for lane in 0..self.alive.len() {
            if self.running.get(lane) > 0.0 {
                let spin = spin.get(lane).sqrt();
                let sane = spin < MAX_SPIN_RAD_S && spin * h.get(lane) < MAX_TURN_PER_STEP_RAD;
                self.alive[lane] &= sane;
            }
        }
        self.alive.contains(&true)
    }
}

/// Parameters by lane; lanes without a member repeat the last one.
#[inline(always)]
fn rope_lanes<V: Lanes>(members: &[Member]) -> RopeLanes<V> {
    let mut out = RopeLanes::of(members[0].rope);
    for lane in 1..V::COUNT {
        out.set(lane, members[lane.min(members.len() - 1)].rope, 1.0);
    }
    out
}

#[inline(always)]
fn start_links<V: Lanes>(members: &[Member]) -> Vec<Link<V>> {
    let mut links = vec![Link::at_rest(); members[0].start.attitudes.len()];
    for lane in 0..V::COUNT {
        let start = &members[lane.min(members.len() - 1)].start;
        for (link, q) in links.iter_mut().zip(&start.attitudes) {
            link.q.set(lane, *q);
        }
        for (link, w) in links.iter_mut().zip(&start.rates_rad_s) {
            link.w.set(lane, *w);
        }
    }
    links
}

/// Forgets the past accelerations of some lanes.
#[inline(always)]
fn clear_memory<V: Lanes>(links: &mut [Link<V>], lanes: &[usize]) {
    let mut which = V::splat(0.0);
    for lane in lanes {
        which.set(*lane, 1.0);
    }
    for link in links {
        link.clear_memory(which);
    }
}

/// Keeps the states of lanes that have just finished, of those in `ends`: they stand at their
/// horizon until the others' next step.
#[inline(always)]
fn keep_ends<V: Lanes>(
    ends: &mut [Option<RopeState>],
    clock: &Clock<V>,
    links: &[Link<V>],
    environment: Option<&Environment<V>>,
) {
    let ends = ends.iter_mut().enumerate();
    for (lane, end) in ends.filter(|(lane, end)| end.is_none() && clock.finished(*lane)) {
        *end = Some(RopeState {
            attitudes: links.iter().map(|link| link.q.get(lane)).collect(),
            rates_rad_s: links.iter().map(|link| link.w.get(lane)).collect(),
            friction_nm: environment.map_or_else(Vec::new, |e| e.friction_nm(lane)),
        });
    }
}

/// Place and velocity of the lead relative to node 0.
#[inline(always)]
fn tip_from_clamp<V: Lanes>(links: &[Link<V>], link_length: V) -> [Vec3<V>; 2] {
    let (mut tip, mut velocity) = (Vec3::zero(), Vec3::zero());
    for link in links {
        let span = link.q.down(link_length);
        tip = tip.add(span);
        velocity = link.w.cross_add(span, velocity);
    }
    [tip, velocity]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Kernel;
    use crate::motion::PlannedArm;
    use arm_model::{JointTrajectory, JointVector, Pole};

    /// End of the simulation (s).
    const HORIZON_S: f64 = 0.3;

    fn run(kernel: Kernel, ropes: &[RopeParams], path: &BasePath) -> Vec<Rollout> {
        let members = ropes.iter().map(|rope| Member {
            rope,
            path,
            start: RopeState::at_rest(vec![[1.0, 0.0, 0.0, 0.0]; rope.links as usize]),
            point_m: None,
        });
        kernel.run(GroupTask::<true> {
            scene: &Scene::EMPTY,
            max_step_s: 1e-3,
            members: &members.collect::<Vec<_>>(),
            frames: FrameTimes {
                first_s: 0.0,
                period_s: 0.01,
                count: 30,
            },
            watch: Watch::point([0.4, 0.0, 0.3]),
            horizon_s: HORIZON_S,
            keeps_end: false,
            single_precision: kernel.is_single_precision(),
        })
    }

    /// The public interface refuses such a rope, so it is put into a group directly.
    #[test]
    fn nan_in_one_lane_changes_no_bit_of_the_others() {
        const SICK: usize = 1;
        let waypoints = [
            JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
            JointVector([0.1, -0.3, 0.1, 0.8, -0.1, 1.2, 0.2]),
        ];
        let throw = JointTrajectory::new(&[0.0, 0.2], &waypoints).unwrap();
        let arm = PlannedArm::new(throw, Pole::default());
        let path = BasePath::new_in(Vec::new(), &arm, 1e-3, HORIZON_S).unwrap();
        let base = RopeParams::from_array([20.0, 0.55, 0.01, 0.2, 0.006, 0.06, 0.06, 0.03, 1.0]);
        let kernels = Kernel::ALL.into_iter().filter(|k| k.is_available());
        for kernel in kernels.filter(|k| k.lanes() > 1) {
            let rope = |lane: usize| RopeParams {
                length_m: 0.45 + 0.01 * lane as f64,
                ..base
            };
            let mut ropes: Vec<RopeParams> = (0..kernel.lanes()).map(rope).collect();
            let healthy = run(kernel, &ropes, &path);
            assert!(healthy.iter().all(|r| r.outcome == Outcome::Clean));
            ropes[SICK].joint_stiffness_nm_per_rad = f64::NAN;
            let infected = run(kernel, &ropes, &path);
            for (lane, (found, wanted)) in infected.iter().zip(&healthy).enumerate() {
                if lane == SICK {
                    assert_eq!(found.outcome, Outcome::Diverged, "{kernel:?}");
                } else {
                    assert_eq!(found, wanted, "{kernel:?}: lane {SICK} reached lane {lane}");
                }
            }
        }
    }
}
