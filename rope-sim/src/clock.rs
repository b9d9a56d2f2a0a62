//! Where each lane stands on its own time axis.
//!
//! Lanes advance together, step by step, but each by its own step length, so that
//! every rope has step boundaries on its own acceleration jumps.

use crate::algebra::{Quat, Vec3};
use crate::base_path::{BasePath, Interval};
use crate::knot::{CHANNELS, attitude};
use crate::lanes::Lanes;
use crate::scheme::{Phase, Scheme, joint_resistance};
use crate::state::{BaseLanes, RopeLanes};
use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use shared_types::RopeParams;

/// One lane's place on its path.
struct Cursor<'a> {
    path: &'a BasePath,
    rope: &'a RopeParams,
    interval: usize,
    /// Steps of the group that were over when the interval began.
    began: u64,
    /// The step at whose start something changes in this lane.
    event: u64,
    phase: Phase,
    /// Whether to restart at every step, as a rope in contact must.
    restarting: bool,
    step_s: f64,
    finished: bool,
}

impl Cursor<'_> {
    /// Start and end (s) of the lane's step that is step `count` of the group, its last
    /// where it has finished.
    fn span_s(&self, count: u64) -> (f64, f64) {
        let interval = &self.path.intervals[self.interval];
        let step = (count - self.began).min(interval.steps as u64);
        let end_s = interval.start_s + interval.step_s * step as f64;
        (end_s - interval.step_s, end_s)
    }
}

/// Time axes, scheme factors and attach motion of all lanes. Most steps only count;
/// lanes are looked at one by one where an interval or a phase of the scheme ends.
pub(crate) struct Clock<'a, V> {
    cursors: Vec<Cursor<'a>>,
    /// Steps begun.
    count: u64,
    /// First event of any lane.
    next_event: u64,
    running: usize,
    pub(crate) scheme: Scheme<V>,
    quintic: [[V; 6]; CHANNELS],
    per_length: V,
    /// Steps within the interval, and the inverse of the interval's number of steps.
    step: V,
    per_steps: V,
    /// Origin the positions are relative to, per lane (m).
    origin_m: [f64; 3],
}

/// Attach frame at the end of the current step, with what only observers need.
pub(crate) struct BaseState<V> {
    pub(crate) dynamics: BaseLanes<V>,
    /// Attach point relative to the clock's origin (m).
    pub(crate) position: Vec3<V>,
    /// Its velocity (m/s).
    pub(crate) velocity: Vec3<V>,
}

impl BaseState<f64> {
    /// Of one frame, in the world.
    pub(crate) fn of(frame: &FrameMotion) -> Self {
        let q = attitude(frame);
        let vector = |v: &Vector3<f64>| Vec3(v.x, v.y, v.z);
        Self {
            dynamics: BaseLanes {
                q: Quat {
                    w: q.w,
                    v: Vec3(q.i, q.j, q.k),
                },
                w: vector(&frame.w_rad_s),
                alpha: vector(&frame.alpha_rad_s2),
                a: vector(&frame.a_m_s2),
            },
            position: vector(&frame.p_m),
            velocity: vector(&frame.v_m_s),
        }
    }
}

impl<'a, V: Lanes> Clock<'a, V> {
    /// Lane i follows `paths[i]` with rope `ropes[i]`.
    #[inline(always)]
    pub(crate) fn new(
        paths: &[&'a BasePath],
        ropes: &[&'a RopeParams],
        origin_m: [f64; 3],
    ) -> Self {
        let cursors = paths
            .iter()
            .zip(ropes)
            .map(|(path, rope)| Cursor {
                path,
                rope,
                interval: 0,
                began: 0,
                event: 1,
                phase: Phase::Regular,
                restarting: false,
                step_s: 0.0,
                finished: path.intervals.is_empty(),
            })
            .collect::<Vec<_>>();
        let mut clock = Self {
            running: cursors.iter().filter(|c| !c.finished).count(),
            cursors,
            count: 0,
            next_event: 1,
            scheme: Scheme::new(),
            quintic: [[V::splat(0.0); 6]; CHANNELS],
            per_length: V::splat(1.0),
            step: V::splat(0.0),
            per_steps: V::splat(1.0),
            origin_m,
        };
        for lane in 0..clock.cursors.len() {
            clock.load(lane);
        }
        clock
    }

    /// Starts the next step of every lane that has one left. Lanes that must forget
    /// their memory are marked in `restarts`. False when all lanes have finished.
    #[inline(always)]
    pub(crate) fn next_step(&mut self, rope: &mut RopeLanes<V>, restarts: &mut Vec<usize>) -> bool {
        restarts.clear();
        self.count += 1;
        self.step = self.step + V::splat(1.0);
        if self.count == self.next_event {
            let mut next_event = u64::MAX;
            for lane in 0..self.cursors.len() {
                if self.cursors[lane].event == self.count && !self.cursors[lane].finished {
                    self.begin_step_of(lane, rope, restarts);
                }
                if !self.cursors[lane].finished {
                    next_event = next_event.min(self.cursors[lane].event);
                }
            }
            self.next_event = next_event;
        }
        self.running > 0
    }

    #[inline(always)]
    fn begin_step_of(&mut self, lane: usize, rope: &mut RopeLanes<V>, restarts: &mut Vec<usize>) {
        let cursor = &mut self.cursors[lane];
        if self.count - cursor.began > cursor.path.intervals[cursor.interval].steps as u64 {
            if cursor.interval + 1 == cursor.path.intervals.len() {
                cursor.finished = true;
                self.running -= 1;
                return;
            }
            cursor.interval += 1;
            cursor.began = self.count - 1;
            self.step.set(lane, 1.0);
            self.load(lane);
        }
        let cursor = &mut self.cursors[lane];
        let interval: &Interval = &cursor.path.intervals[cursor.interval];
        let phase = match cursor.phase {
            _ if cursor.restarting => Phase::Restart,
            _ if interval.restart && cursor.began + 1 == self.count => Phase::Restart,
            Phase::Restart => Phase::AfterRestart,
            _ => Phase::Regular,
        };
        if phase != cursor.phase || (interval.step_s - cursor.step_s).abs() > 0.0 {
            self.scheme.set(lane, interval.step_s, phase);
            let resistance = joint_resistance(interval.step_s, phase, cursor.rope);
            rope.set(lane, cursor.rope, resistance);
            (cursor.phase, cursor.step_s) = (phase, interval.step_s);
        }
        cursor.event = if phase == Phase::Regular {
            cursor.began + interval.steps as u64 + 1
        } else {
            self.count + 1
        };
        if phase == Phase::Restart {
            restarts.push(lane);
        }
    }

    /// Copies the current interval's quintics of one lane.
    #[inline(always)]
    fn load(&mut self, lane: usize) {
        let cursor = &self.cursors[lane];
        let Some(interval) = cursor.path.intervals.get(cursor.interval) else {
            return;
        };
        for (lanes, numbers) in self.quintic.iter_mut().zip(&interval.quintic) {
            for (lanes, number) in lanes.iter_mut().zip(numbers) {
                lanes.set(lane, *number);
            }
        }
        for axis in 0..3 {
            self.quintic[axis][0].set(lane, interval.quintic[axis][0] - self.origin_m[axis]);
        }
        self.per_length.set(lane, 1.0 / interval.length_s());
        self.per_steps.set(lane, 1.0 / interval.steps as f64);
    }

    /// Attach frame at the end of the current step (before the first: at time 0).
    #[inline(always)]
    pub(crate) fn base(&self) -> BaseState<V> {
        let u = (self.step * self.per_steps).min(V::splat(1.0));
        let (x, xd, xdd) = self.channel(0, u);
        let (y, yd, ydd) = self.channel(1, u);
        let (z, zd, zdd) = self.channel(2, u);
        let (qw, qwd, qwdd) = self.channel(3, u);
        let (qx, qxd, qxdd) = self.channel(4, u);
        let (qy, qyd, qydd) = self.channel(5, u);
        let (qz, qzd, qzdd) = self.channel(6, u);
        let two = V::splat(2.0);
        let q = Quat {
            w: qw,
            v: Vec3(qx, qy, qz),
        };
        let rate = Quat {
            w: qwd,
            v: Vec3(qxd, qyd, qzd),
        };
        let acceleration = Quat {
            w: qwdd,
            v: Vec3(qxdd, qydd, qzdd),
        };
        let dynamics = BaseLanes {
            q: q.renormalised(),
            w: rate.times_conj(q).v.scale(two),
            alpha: acceleration.times_conj(q).v.scale(two),
            a: Vec3(xdd, ydd, zdd),
        };
        BaseState {
            dynamics,
            position: Vec3(x, y, z),
            velocity: Vec3(xd, yd, zd),
        }
    }

    /// Value, rate and acceleration of one channel at the fraction `u` of the interval.
    #[inline(always)]
    fn channel(&self, channel: usize, u: V) -> (V, V, V) {
        let [c0, c1, c2, c3, c4, c5] = self.quintic[channel];
        let n = V::splat;
        let value = u.fma(u.fma(u.fma(u.fma(u.fma(c5, c4), c3), c2), c1), c0);
        let rate = u.fma(
            u.fma(
                u.fma(u.fma(c5 * n(5.0), c4 * n(4.0)), c3 * n(3.0)),
                c2 * n(2.0),
            ),
            c1,
        );
        let acceleration = u.fma(
            u.fma(u.fma(c5 * n(20.0), c4 * n(12.0)), c3 * n(6.0)),
            c2 * n(2.0),
        );
        let per_length = self.per_length;
        (
            value,
            rate * per_length,
            acceleration * per_length * per_length,
        )
    }

    /// Makes every coming step of a lane a restart, or lets it have its memory again.
    #[inline(always)]
    pub(crate) fn keep_restarting(&mut self, lane: usize, restarting: bool) {
        let Some(cursor) = self.cursors.get_mut(lane) else {
            return;
        };
        if restarting && !cursor.restarting && !cursor.finished {
            cursor.event = self.count + 1;
            self.next_event = self.next_event.min(cursor.event);
        }
        cursor.restarting = restarting;
    }

    /// Lanes in use.
    pub(crate) fn lanes(&self) -> usize {
        self.cursors.len()
    }

    /// Whether a lane has reached its end.
    #[inline(always)]
    pub(crate) fn finished(&self, lane: usize) -> bool {
        self.cursors[lane].finished
    }

    /// Number of lanes that have not.
    #[inline(always)]
    pub(crate) fn running(&self) -> usize {
        self.running
    }

    /// Start and end of a lane's current step (s).
    #[inline(always)]
    pub(crate) fn span_s(&self, lane: usize) -> (f64, f64) {
        self.cursors[lane].span_s(self.count)
    }

    /// Steps begun by the group.
    #[inline(always)]
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Longest step of any lane (s).
    pub(crate) fn longest_step_s(&self) -> f64 {
        self.cursors
            .iter()
            .flat_map(|cursor| &cursor.path.intervals)
            .fold(0.0, |longest: f64, interval| longest.max(interval.step_s))
    }

    /// Attach point of a lane at a time within its current step (m, world).
    #[inline(always)]
    pub(crate) fn attach_point_m(&self, lane: usize, t_s: f64) -> [f64; 3] {
        let cursor = &self.cursors[lane];
        cursor.path.intervals[cursor.interval].position_m(t_s)
    }
}
