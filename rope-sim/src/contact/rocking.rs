//! The scene's domino as a rocking block: a rigid box rocking about its lower edges, one
//! per lane.
//!
//! One angle is its state, positive when it leans to where it faces. About the edge
//! it leans on, gravity and the rope's push make `I tilt'' = M_rope - m g rho
//! sin(alpha - |tilt|)`, with inertia `I = m (t² + h²) / 3`, distance `rho` from edge to
//! centre and critical tilt `alpha = atan(t / h)`; landing on the foot is inelastic.
//! The rope feels a body that yields, to pushes and to friction: contact and domino are
//! solved for together. Simultaneous contacts share the mobility.

use super::body::{Body, Frame, constant};
use super::summary::StepEnd;
use super::touch::Yielding;
use crate::algebra::Vec3;
use crate::kernel::GRAVITY_M_S2;
use crate::lanes::Lanes;
use crate::scene::{Domino, DominoOutcome, Obstacle, Shape};
use core::f64::consts::FRAC_PI_4;
use nalgebra::Vector3;

/// Pose and pushes of every lane's domino.
#[derive(Clone)]
pub(crate) struct RockingBlocks<V> {
    domino: Domino,
    foot: Vec3<V>,
    forward: Vec3<V>,
    /// Rocking axis: a positive turn about it leans the top forward.
    axis: Vec3<V>,
    /// 1 and -1 by the edge it leans on, 0 while it stands.
    lean: V,
    standing: V,
    /// Contacts of the last step, at least one.
    contacts: V,
    counted: V,
    /// Moments of this step about the forward and the backward edge (N m).
    moments: [V; 2],
    lanes: Vec<Tilt>,
    /// Whether any moved when last predicted.
    rocked: bool,
}

/// One domino.
#[derive(Debug, Clone, Copy, Default)]
struct Tilt {
    angle_rad: f64,
    rate_rad_s: f64,
    step_s: f64,
    outcome: DominoOutcome,
}

impl<V: Lanes> RockingBlocks<V> {
    #[inline(always)]
    pub(crate) fn new(domino: &Domino, count: usize, origin_m: [f64; 3]) -> Self {
        let (s, c) = domino.facing_rad.sin_cos();
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        Self {
            domino: *domino,
            foot: constant(&(Vector3::from(domino.foot_m) - Vector3::from(origin_m))),
            forward: Vec3::splat(c, s, 0.0),
            axis: Vec3::splat(-s, c, 0.0),
            lean: zero,
            standing: one,
            contacts: one,
            counted: zero,
            moments: [zero; 2],
            lanes: vec![Tilt::default(); count],
            rocked: false,
        }
    }

    /// The obstacle it is to the rope.
    #[inline(always)]
    pub(crate) fn body(&self) -> Body<V> {
        let d = &self.domino;
        let half_m = [0.5 * d.thickness_m, 0.5 * d.width_m, 0.5 * d.height_m];
        let upright = Obstacle::fixed(Shape::Box { half_m }, [0.0; 3], d.friction);
        Body {
            frame: self.frame(),
            rocks: true,
            ..Body::new(&upright, [0.0; 3])
        }
    }

    /// 1 where it has not fallen.
    pub(crate) fn standing(&self) -> V {
        self.standing
    }

    /// Whether any lane's moves.
    pub(crate) fn is_rocking(&self) -> bool {
        let rocks = |t: &Tilt| t.angle_rad != 0.0 && t.outcome.down_at_s.is_none();
        self.lanes.iter().any(rocks)
    }

    /// Its frame if it goes on as it is, where that is not the one given before.
    #[inline(always)]
    pub(crate) fn predict(&mut self, h: V) -> Option<Frame<V>> {
        let rocks = self.is_rocking();
        let rocked = core::mem::replace(&mut self.rocked, rocks);
        if !(rocks || rocked) {
            return None;
        }
        for (lane, tilt) in self.lanes.iter_mut().enumerate() {
            tilt.step_s = h.get(lane);
        }
        Some(self.frame())
    }

    #[inline(always)]
    fn frame(&self) -> Frame<V> {
        let (mut sin, mut cos) = (V::splat(0.0), V::splat(1.0));
        let mut rate = V::splat(0.0);
        for (lane, tilt) in self.lanes.iter().enumerate() {
            let (s, c) = (tilt.angle_rad + tilt.step_s * tilt.rate_rad_s).sin_cos();
            sin.set(lane, s);
            cos.set(lane, c);
            rate.set(lane, tilt.rate_rad_s);
        }
        let up = Vec3::splat(0.0, 0.0, 1.0);
        let along = up.scale_add(-sin, self.forward.scale(cos));
        let upward = self.forward.scale_add(sin, up.scale(cos));
        let half_t = self.lean * V::splat(0.5 * self.domino.thickness_m);
        let half_h = V::splat(0.5 * self.domino.height_m);
        let edge = self.edge(self.lean);
        let arm = upward.scale_add(half_h, along.scale(-half_t));
        let w = self.axis.scale(rate);
        Frame {
            p: edge.add(arm),
            axes: [along, self.axis, upward],
            v: w.cross_add(arm, Vec3::zero()),
            w,
        }
    }

    #[inline(always)]
    fn edge(&self, side: V) -> Vec3<V> {
        let half_t = side * V::splat(0.5 * self.domino.thickness_m);
        self.forward.scale_add(half_t, self.foot)
    }

    /// How it yields to a push against `normal` at `x`.
    #[inline(always)]
    pub(crate) fn yielding(&self, normal: Vec3<V>, x: Vec3<V>) -> Yielding<V> {
        let (half, one) = (V::splat(0.5), V::splat(1.0));
        // Standing, it will lean away from the push.
        let away = V::splat(-1.0).flip_by(normal.dot(self.forward));
        let leaning = V::select_less(half, self.lean.abs(), self.lean, away);
        let arm = x.sub(self.edge(leaning));
        Yielding {
            lever: self.axis.cross_add(arm, Vec3::zero()).scale(leaning),
            mobility: self.contacts * V::splat(1.0 / self.inertia_kg_m2()),
            one_sided: one - self.lean.abs(),
        }
    }

    /// Takes in the force on the rope (N) at `x`.
    #[inline(always)]
    pub(crate) fn push(&mut self, on_rope: Vec3<V>, x: Vec3<V>) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        for (moment, side) in self.moments.iter_mut().zip([1.0, -1.0]) {
            let half_t = V::splat(0.5 * side * self.domino.thickness_m);
            let arm = x.sub(self.forward.scale_add(half_t, self.foot));
            *moment = *moment - self.axis.dot(arm.cross_add(on_rope, Vec3::zero()));
        }
        let touching = V::select_less(zero, on_rope.dot(on_rope), one, zero);
        self.counted = self.counted + touching;
    }

    fn inertia_kg_m2(&self) -> f64 {
        let d = &self.domino;
        d.mass_kg * (d.thickness_m.powi(2) + d.height_m.powi(2)) / 3.0
    }

    /// Advances every lane that runs by its step.
    #[inline(always)]
    pub(crate) fn advance(&mut self, ends: &[StepEnd]) {
        let inertia = self.inertia_kg_m2();
        let d = self.domino;
        let weight_nm = d.mass_kg * GRAVITY_M_S2 * 0.5 * d.thickness_m.hypot(d.height_m);
        let critical_rad = (d.thickness_m / d.height_m).atan();
        for (lane, (tilt, end)) in self.lanes.iter_mut().zip(ends).enumerate() {
            let moments = [self.moments[0].get(lane), self.moments[1].get(lane)];
            let at_rest = tilt.angle_rad == 0.0 && moments.iter().all(|m| *m == 0.0);
            if end.running && tilt.outcome.down_at_s.is_none() && !at_rest {
                let back_nm = weight_nm * (critical_rad - tilt.angle_rad.abs()).sin();
                let law = |lean: f64| {
                    let moment = if lean > 0.0 { moments[0] } else { moments[1] };
                    (moment - lean * back_nm) / inertia
                };
                tilt.advance(law, end);
            }
            let down = tilt.outcome.down_at_s.is_some();
            self.standing.set(lane, if down { 0.0 } else { 1.0 });
            self.lean.set(lane, tilt.lean());
        }
        self.contacts = self.counted.max(V::splat(1.0));
        self.counted = V::splat(0.0);
        self.moments = [V::splat(0.0); 2];
    }

    /// Tilt of one lane's (rad); it is no longer followed beyond 45 degrees.
    pub(crate) fn tilt_rad(&self, lane: usize) -> f64 {
        self.lanes.get(lane).map_or(0.0, |t| t.angle_rad)
    }

    /// What became of one lane's.
    pub(crate) fn outcome(&self, lane: usize) -> DominoOutcome {
        self.lanes.get(lane).map(|t| t.outcome).unwrap_or_default()
    }
}

impl Tilt {
    /// 1 or -1 by the edge it leans on, 0 while it stands.
    fn lean(&self) -> f64 {
        if self.angle_rad == 0.0 {
            0.0
        } else {
            self.angle_rad.signum()
        }
    }

    /// One step; `law` gives the angular acceleration about the edge of a lean.
    fn advance(&mut self, law: impl Fn(f64) -> f64, end: &StepEnd) {
        let lean = match self.lean() {
            0.0 if law(1.0) > 0.0 => 1.0,
            0.0 if law(-1.0) < 0.0 => -1.0,
            0.0 => return,
            leaning => leaning,
        };
        self.rate_rad_s += end.step_s * law(lean);
        self.angle_rad += end.step_s * self.rate_rad_s;
        if self.angle_rad * lean <= 0.0 {
            (self.angle_rad, self.rate_rad_s) = (0.0, 0.0);
        }
        if self.angle_rad.abs() > self.outcome.peak_tilt_rad.abs() {
            self.outcome.peak_tilt_rad = self.angle_rad;
        }
        if self.angle_rad.abs() > FRAC_PI_4 {
            self.outcome.down_at_s = Some(end.time_s);
            self.rate_rad_s = 0.0;
        }
    }
}
