//! Where each lane stands on its own time axis.
//!
//! Lanes advance together, step by step, but each by its own step length, so that
//! every rope has step boundaries on its own acceleration jumps.

use crate::algebra::{Quat, Vec3};
use crate::base_path::{BasePath, CHANNELS, Interval};
use crate::lanes::Lanes;
use crate::scheme::{Phase, Scheme, joint_resistance};
use crate::state::{BaseLanes, RopeLanes};
use shared_types::RopeParams;

/// One lane's place on its path.
struct Cursor<'a> {
    path: &'a BasePath,
    rope: &'a RopeParams,
    interval: usize,
    /// Steps done within the interval.
    step: usize,
    phase: Phase,
    step_s: f64,
    /// Step now being taken: start and end (s).
    span_s: (f64, f64),
    finished: bool,
}

/// Time axes, scheme factors and attach motion of all lanes.
pub(crate) struct Clock<'a, V> {
    cursors: Vec<Cursor<'a>>,
    pub(crate) scheme: Scheme<V>,
    quintic: [[V; 6]; CHANNELS],
    per_length: V,
    fraction: V,
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
                step: 0,
                phase: Phase::Regular,
                step_s: 0.0,
                span_s: (0.0, 0.0),
                finished: path.intervals.is_empty(),
            })
            .collect();
        let mut clock = Self {
            cursors,
            scheme: Scheme::new(),
            quintic: [[V::splat(0.0); 6]; CHANNELS],
            per_length: V::splat(1.0),
            fraction: V::splat(0.0),
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
        let mut running = false;
        for lane in 0..self.cursors.len() {
            running |= self.next_step_of(lane, rope, restarts);
        }
        running
    }

    #[inline(always)]
    fn next_step_of(
        &mut self,
        lane: usize,
        rope: &mut RopeLanes<V>,
        restarts: &mut Vec<usize>,
    ) -> bool {
        let cursor = &mut self.cursors[lane];
        if cursor.finished {
            return false;
        }
        if cursor.step == cursor.path.intervals[cursor.interval].steps {
            if cursor.interval + 1 == cursor.path.intervals.len() {
                cursor.finished = true;
                return false;
            }
            cursor.interval += 1;
            cursor.step = 0;
            self.load(lane);
        }
        let cursor = &mut self.cursors[lane];
        let interval: &Interval = &cursor.path.intervals[cursor.interval];
        let phase = match cursor.phase {
            _ if interval.restart && cursor.step == 0 => Phase::Restart,
            Phase::Restart => Phase::AfterRestart,
            _ => Phase::Regular,
        };
        cursor.step += 1;
        let end_s = interval.start_s + interval.step_s * cursor.step as f64;
        cursor.span_s = (end_s - interval.step_s, end_s);
        self.fraction
            .set(lane, cursor.step as f64 / interval.steps as f64);
        if phase != cursor.phase || (interval.step_s - cursor.step_s).abs() > 0.0 {
            self.scheme.set(lane, interval.step_s, phase);
            let resistance = joint_resistance(interval.step_s, phase, cursor.rope);
            rope.set(lane, cursor.rope, resistance);
            (cursor.phase, cursor.step_s) = (phase, interval.step_s);
        }
        if phase == Phase::Restart {
            restarts.push(lane);
        }
        true
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
    }

    /// Attach frame at the end of the current step (before the first: at time 0).
    #[inline(always)]
    pub(crate) fn base(&self) -> BaseState<V> {
        let (x, xd, xdd) = self.channel(0);
        let (y, yd, ydd) = self.channel(1);
        let (z, zd, zdd) = self.channel(2);
        let (qw, qwd, qwdd) = self.channel(3);
        let (qx, qxd, qxdd) = self.channel(4);
        let (qy, qyd, qydd) = self.channel(5);
        let (qz, qzd, qzdd) = self.channel(6);
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

    /// Value, rate and acceleration of one channel.
    #[inline(always)]
    fn channel(&self, channel: usize) -> (V, V, V) {
        let [c0, c1, c2, c3, c4, c5] = self.quintic[channel];
        let u = self.fraction;
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

    /// Whether a lane has reached its end.
    #[inline(always)]
    pub(crate) fn finished(&self, lane: usize) -> bool {
        self.cursors[lane].finished
    }

    /// Start and end of a lane's current step (s).
    #[inline(always)]
    pub(crate) fn span_s(&self, lane: usize) -> (f64, f64) {
        self.cursors[lane].span_s
    }

    /// Attach point of a lane at a time within its current step (m, world).
    #[inline(always)]
    pub(crate) fn attach_point_m(&self, lane: usize, t_s: f64) -> [f64; 3] {
        let cursor = &self.cursors[lane];
        cursor.path.intervals[cursor.interval].position_m(t_s)
    }
}
