//! Node positions at frame times, from the steps around them.

use crate::algebra::Vec3;
use crate::clock::Clock;
use crate::lanes::Lanes;
use crate::state::Link;
use nalgebra::Vector3;

/// Times at which node positions are recorded: `first_s + i period_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameTimes {
    /// Time of the first frame (s).
    pub first_s: f64,
    /// Time between frames (s).
    pub period_s: f64,
    /// Number of frames; 0 records nothing.
    pub count: usize,
}

impl FrameTimes {
    /// No frames.
    pub const NONE: Self = Self {
        first_s: 0.0,
        period_s: 1.0,
        count: 0,
    };

    /// Time of frame `index` (s).
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        self.first_s + self.period_s * index as f64
    }
}

/// Positions of all nodes in all frames, shape (frames, N + 1, 3), world frame, m.
/// Node 0 is the attach point, node N the lead's centre.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeTrack {
    nodes: usize,
    numbers: NodeNumbers,
}

/// Numbers of a [`NodeTrack`] in C order, in the precision they were computed in.
#[derive(Debug, Clone, PartialEq)]
pub enum NodeNumbers {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

impl NodeTrack {
    pub(crate) fn zeros(frames: usize, nodes: usize, single: bool) -> Self {
        let count = frames * nodes * 3;
        let numbers = if single {
            NodeNumbers::F32(vec![0.0; count])
        } else {
            NodeNumbers::F64(vec![0.0; count])
        };
        Self { nodes, numbers }
    }

    /// Number of frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        let count = match &self.numbers {
            NodeNumbers::F32(v) => v.len(),
            NodeNumbers::F64(v) => v.len(),
        };
        count / (self.nodes * 3)
    }

    /// Nodes per frame, N + 1.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Position of a node (m, world).
    ///
    /// # Panics
    /// If `frame` or `node` is out of range, as indexing does.
    #[must_use]
    pub fn position(&self, frame: usize, node: usize) -> Vector3<f64> {
        assert!(node < self.nodes, "node {node} of {}", self.nodes);
        let at = (frame * self.nodes + node) * 3;
        match &self.numbers {
            NodeNumbers::F32(v) => Vector3::new(v[at].into(), v[at + 1].into(), v[at + 2].into()),
            NodeNumbers::F64(v) => Vector3::new(v[at], v[at + 1], v[at + 2]),
        }
    }

    /// All numbers in C order.
    #[must_use]
    pub fn to_f64(&self) -> Vec<f64> {
        match &self.numbers {
            NodeNumbers::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            NodeNumbers::F64(v) => v.clone(),
        }
    }

    /// All numbers in C order, without a copy.
    #[must_use]
    pub fn into_numbers(self) -> NodeNumbers {
        self.numbers
    }

    /// Shape as (frames, nodes, 3).
    #[must_use]
    pub fn shape(&self) -> [usize; 3] {
        [self.frames(), self.nodes, 3]
    }

    /// Writes one frame: the numbers of `lane`, node by node.
    #[inline(always)]
    fn put<V: Lanes>(&mut self, frame: usize, lane: usize, positions: &[Vec3<V>]) {
        let range = frame * self.nodes * 3..(frame + 1) * self.nodes * 3;
        match &mut self.numbers {
            NodeNumbers::F32(v) => {
                for (out, x) in v[range].chunks_exact_mut(3).zip(positions) {
                    out.copy_from_slice(&x.get(lane).map(|x| x as f32));
                }
            }
            NodeNumbers::F64(v) => {
                for (out, x) in v[range].chunks_exact_mut(3).zip(positions) {
                    out.copy_from_slice(&x.get(lane));
                }
            }
        }
    }

    /// Repeats the last frame that is finite over all later ones, so that a failed
    /// rollout never hands out NaN. Without any finite frame all become zero.
    pub(crate) fn hold_last_finite(&mut self) {
        let per_frame = self.nodes * 3;
        match &mut self.numbers {
            NodeNumbers::F32(v) => hold_last_finite(v, per_frame),
            NodeNumbers::F64(v) => hold_last_finite(v, per_frame),
        }
    }
}

fn hold_last_finite<T: Copy + Default + Into<f64>>(numbers: &mut [T], per_frame: usize) {
    let is_finite = |frame: &&[T]| frame.iter().all(|x| (*x).into().is_finite());
    let good = per_frame * numbers.chunks(per_frame).take_while(is_finite).count();
    if good == 0 {
        numbers.fill(T::default());
    }
    for start in (good..numbers.len()).step_by(per_frame) {
        if good > 0 {
            numbers.copy_within(good - per_frame..good, start);
        }
    }
}

/// Positions and velocities of all nodes relative to node 0.
type Snapshot<V> = Vec<[Vec3<V>; 2]>;

/// Records frames of every lane while the group advances.
pub(crate) struct FrameRecorder<V> {
    times: FrameTimes,
    /// Next frame of each lane.
    next: Vec<usize>,
    pub(crate) tracks: Vec<NodeTrack>,
    before: Snapshot<V>,
    after: Snapshot<V>,
    /// Node positions of a frame (m, world).
    positions: Vec<Vec3<V>>,
    wanted: bool,
    longest_step_s: f64,
    /// No lane has a frame before this step of the group.
    asleep_until: u64,
}

impl<V: Lanes> FrameRecorder<V> {
    #[inline(always)]
    pub(crate) fn new(times: FrameTimes, clock: &Clock<V>, links: usize, single: bool) -> Self {
        let lanes = clock.running();
        let empty = vec![[Vec3::zero(); 2]; links + 1];
        let track = || NodeTrack::zeros(times.count, links + 1, single);
        Self {
            times,
            next: vec![0; lanes],
            tracks: (0..lanes).map(|_| track()).collect(),
            before: empty.clone(),
            after: empty,
            positions: vec![Vec3::zero(); links + 1],
            wanted: false,
            longest_step_s: clock.longest_step_s(),
            asleep_until: if times.count == 0 { u64::MAX } else { 0 },
        }
    }

    /// Call before a step: keeps the state if a frame falls into it.
    #[inline(always)]
    pub(crate) fn before_step(&mut self, clock: &Clock<V>, links: &[Link<V>], link_length: V) {
        self.wanted = false;
        if clock.count() < self.asleep_until {
            return;
        }
        let wait_s = (0..self.next.len())
            .map(|lane| self.wait_s(clock, lane))
            .fold(f64::INFINITY, f64::min);
        self.wanted = wait_s <= 0.0;
        if self.wanted {
            take(&mut self.before, links, link_length);
        } else {
            self.asleep_until = clock.count() + 1 + whole_steps(wait_s, self.longest_step_s);
        }
    }

    /// Call after the step.
    #[inline(always)]
    pub(crate) fn after_step(&mut self, clock: &Clock<V>, links: &[Link<V>], link_length: V) {
        if !self.wanted {
            return;
        }
        take(&mut self.after, links, link_length);
        loop {
            let due: Vec<usize> = (0..self.next.len())
                .filter(|lane| self.wait_s(clock, *lane) <= 0.0)
                .collect();
            if due.is_empty() {
                break;
            }
            self.write(clock, &due);
        }
    }

    /// Time from the end of a lane's step to its next frame (s); not above zero where
    /// that falls into the step, infinite where there is none.
    #[inline(always)]
    fn wait_s(&self, clock: &Clock<V>, lane: usize) -> f64 {
        let frame = self.next[lane];
        if frame < self.times.count && !clock.finished(lane) {
            self.times.time_s(frame) - clock.span_s(lane).1 - 1e-9
        } else {
            f64::INFINITY
        }
    }

    /// Cubic Hermite between the states around the frame time, in the lanes `due`.
    #[inline(always)]
    fn write(&mut self, clock: &Clock<V>, due: &[usize]) {
        let mut weights = [V::splat(0.0); 4];
        let mut attach = Vec3::zero();
        for lane in due {
            let (start_s, end_s) = clock.span_s(*lane);
            let t_s = self.times.time_s(self.next[*lane]).clamp(start_s, end_s);
            let h = end_s - start_s;
            for (weight, number) in weights.iter_mut().zip(hermite((t_s - start_s) / h, h)) {
                weight.set(*lane, number);
            }
            attach.set(*lane, clock.attach_point_m(*lane, t_s));
        }
        let states = self.before.iter().zip(&self.after);
        for (position, (before, after)) in self.positions.iter_mut().zip(states) {
            let moved = after[0].scale_add(weights[2], after[1].scale(weights[3]));
            let moved = before[0].scale_add(weights[0], before[1].scale_add(weights[1], moved));
            *position = attach.add(moved);
        }
        for lane in due {
            self.tracks[*lane].put(self.next[*lane], *lane, &self.positions);
            self.next[*lane] += 1;
        }
    }
}

/// Steps of at most `step_s` that surely end before `wait_s` is over.
fn whole_steps(wait_s: f64, step_s: f64) -> u64 {
    ((wait_s / step_s - 1e-6).max(0.0) as u64).min(u64::from(u32::MAX))
}

/// Weights of value and rate at the start, value and rate at the end, at the fraction
/// `u` of a step of length `h`.
pub(crate) fn hermite(u: f64, h: f64) -> [f64; 4] {
    let (u2, u3) = (u * u, u * u * u);
    [
        1.0 - 3.0 * u2 + 2.0 * u3,
        h * (u - 2.0 * u2 + u3),
        3.0 * u2 - 2.0 * u3,
        h * (u3 - u2),
    ]
}

/// Positions and velocities of all nodes relative to node 0.
#[inline(always)]
fn take<V: Lanes>(out: &mut Snapshot<V>, links: &[Link<V>], link_length: V) {
    let mut x = Vec3::zero();
    let mut v = Vec3::zero();
    for (link, node) in links.iter().zip(out.iter_mut().skip(1)) {
        let span = link.q.down(link_length);
        x = x.add(span);
        v = link.w.cross_add(span, v);
        *node = [x, v];
    }
}
