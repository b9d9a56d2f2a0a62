//! What the elimination keeps of a link, and the accelerations it starts from.

use crate::algebra::{Mat3, Sym3, Vec3};
use crate::lanes::Lanes;
use crate::scheme::Scheme;
use crate::state::Link;

/// Standard gravity of the model (m/s²), along -z.
pub const GRAVITY_M_S2: f64 = 9.81;

/// A push along +x and +y (m/s²), in single precision only. Seven orders of
/// magnitude below gravity, it moves a tip by less than a tenth of a micrometre,
/// and keeps the components out of a planar motion's plane from decaying into
/// denormal numbers, which would halve the speed.
const fn side_push_m_s2<V: Lanes>() -> f64 {
    if V::IS_SINGLE { 1e-6 } else { 0.0 }
}

/// What the first sweep leaves for the second, per link:
/// `alpha = s_inv alpha_parent + y - x^T a_parent`.
#[derive(Clone, Copy)]
pub(crate) struct Elimination<V> {
    pub(super) s_inv: Sym3<V>,
    /// Holds the joint torque until the link is eliminated.
    pub(super) y: Vec3<V>,
    pub(super) x: Mat3<V>,
}

impl<V: Lanes> Elimination<V> {
    /// Scratch space before its first use.
    #[inline(always)]
    pub(crate) fn empty() -> Self {
        Self {
            s_inv: Sym3::diagonal(V::splat(0.0)),
            y: Vec3::zero(),
            x: Mat3::zero(),
        }
    }
}

/// `w x (w x span)` (m/s²) at the extrapolated velocity: the predicted one carries the
/// dominant error of the single linear solve.
#[inline(always)]
pub(crate) fn centripetal<V: Lanes>(link: &Link<V>, span: Vec3<V>, scheme: &Scheme<V>) -> Vec3<V> {
    let w = link.al_change.scale_add(scheme.centripetal, link.w);
    span.scale_sub(w.dot(w), w.scale(w.dot(span)))
}

/// Acceleration that holds up against gravity and the side push (m/s²).
#[inline(always)]
pub(crate) fn up<V: Lanes>() -> Vec3<V> {
    let push = -side_push_m_s2::<V>();
    Vec3::splat(push, push, GRAVITY_M_S2)
}
