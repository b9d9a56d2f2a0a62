//! What a group of ropes carries from step to step, one rope per lane.

use crate::algebra::{Quat, Vec3};
use crate::lanes::Lanes;
use crate::scheme::Scheme;
use shared_types::RopeParams;

/// Parameters of the ropes in a group, one rope per lane. Masses, inertias,
/// stiffness and damping are in units of the joint resistance.
#[derive(Clone, Copy)]
pub(crate) struct RopeLanes<V> {
    pub(crate) stiffness: V,
    pub(crate) damping: V,
    /// Link length (m).
    pub(crate) link_length: V,
    pub(crate) link_mass: V,
    pub(crate) link_inertia: V,
    pub(crate) lead_mass: V,
    pub(crate) lead_inertia: V,
    /// Inverse of the joint resistance (rad/N m s²).
    pub(crate) per_resistance: V,
}

/// Smallest joint resistance (N m s²/rad), for ropes without springs and dampers: a
/// hundred thousandth of a link's inertia.
const MIN_RESISTANCE: f64 = 1e-13;

impl<V: Lanes> RopeLanes<V> {
    /// The same rope in every lane, with a joint resistance of 1 N m s²/rad.
    #[inline(always)]
    pub(crate) fn of(rope: &RopeParams) -> Self {
        let zero = V::splat(0.0);
        let mut out = Self {
            stiffness: zero,
            damping: zero,
            link_length: zero,
            link_mass: zero,
            link_inertia: zero,
            lead_mass: zero,
            lead_inertia: zero,
            per_resistance: zero,
        };
        for lane in 0..V::COUNT {
            out.set(lane, rope, 1.0);
        }
        out
    }

    /// Puts a rope into a lane. `joint_resistance` (N m s²/rad) is that of the step
    /// ahead, see [`crate::scheme::joint_resistance`].
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams, joint_resistance: f64) {
        let unit = 1.0 / joint_resistance.max(MIN_RESISTANCE);
        self.per_resistance.set(lane, unit);
        self.stiffness
            .set(lane, rope.joint_stiffness_nm_per_rad * unit);
        self.damping
            .set(lane, rope.joint_damping_nms_per_rad * unit);
        self.link_length.set(lane, rope.link_length_m());
        self.link_mass.set(lane, rope.link_mass_kg() * unit);
        self.link_inertia
            .set(lane, rope.link_inertia_kg_m2() * unit);
        self.lead_mass.set(lane, rope.lead_mass_kg * unit);
        self.lead_inertia
            .set(lane, rope.lead_inertia_kg_m2() * unit);
    }
}

/// Motion of the attach frame at the end of the step.
#[derive(Clone, Copy)]
pub(crate) struct BaseLanes<V> {
    pub(crate) q: Quat<V>,
    pub(crate) w: Vec3<V>,
    pub(crate) alpha: Vec3<V>,
    /// Acceleration of node 0.
    pub(crate) a: Vec3<V>,
}

/// State of one link.
#[derive(Clone, Copy)]
pub(crate) struct Link<V> {
    pub(crate) q: Quat<V>,
    pub(crate) w: Vec3<V>,
    /// Algorithmic angular acceleration of the scheme.
    pub(crate) a: Vec3<V>,
    /// Exact angular acceleration of the last step.
    pub(crate) al: Vec3<V>,
    /// How much it changed in the last step.
    pub(crate) al_change: Vec3<V>,
}

impl<V: Lanes> Link<V> {
    /// A link at rest, hanging straight down.
    #[inline(always)]
    pub(crate) fn at_rest() -> Self {
        let zero = Vec3::zero();
        Self {
            q: Quat::identity(),
            w: zero,
            a: zero,
            al: zero,
            al_change: zero,
        }
    }

    /// Forgets the past accelerations of the lanes in which `which` is positive.
    #[inline(always)]
    pub(crate) fn clear_memory(&mut self, which: V) {
        for memory in [&mut self.a, &mut self.al, &mut self.al_change] {
            *memory = Vec3::select_less(V::splat(0.0), which, Vec3::zero(), *memory);
        }
    }

    /// Moves the attitude, velocity and algorithmic acceleration to their
    /// predictions; the exact accelerations stay.
    #[inline(always)]
    pub(crate) fn predict(&mut self, s: &Scheme<V>) {
        let next = self.al.scale_add(s.al_to_a, self.a.scale(s.a_to_a));
        let phi = self
            .w
            .scale_add(s.h, self.a.scale_add(s.a_to_phi, next.scale(s.next_to_phi)));
        self.w = self
            .a
            .scale_add(s.a_to_w, next.scale_add(s.next_to_w, self.w));
        self.q = Quat::exp(phi).times(self.q);
        self.a = next;
    }

    /// Corrects the predictions once the exact acceleration is known.
    #[inline(always)]
    pub(crate) fn correct(&mut self, s: &Scheme<V>, alpha: Vec3<V>) {
        let change = alpha.sub(self.al);
        self.w = change.scale_add(s.correct_w, self.w);
        self.q = self
            .q
            .nudged(change.scale(s.correct_half_phi))
            .renormalised();
        self.a = change.scale_add(s.correct_a, self.a);
        self.al_change = change;
        self.al = alpha;
    }
}
