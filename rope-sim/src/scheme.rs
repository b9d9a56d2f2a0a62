//! Generalised-alpha time stepping, as per-lane factors.
//!
//! Chung and Hulbert's second-order scheme with spectral radius 0.6 at infinite
//! frequency. A restart step (after the start and after every jump of the attach
//! acceleration) is the same step with the factors of backward Euler: neither a
//! zero nor the exact initial acceleration is a usable memory, the first costs
//! the order and the second excites the stiff modes.

use crate::lanes::Lanes;
use shared_types::RopeParams;

/// Spectral radius at infinite frequency.
const RHO: f64 = 0.6;

/// Where a step stands relative to the last restart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Backward Euler; the link memory is cleared first.
    Restart,
    /// First step with memory: one past acceleration, nothing to extrapolate.
    AfterRestart,
    /// Full scheme.
    Regular,
}

/// Factors of one step. `h` is the step, `a` the algorithmic and `al` the exact
/// angular acceleration, a star marks predictions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scheme<V> {
    /// `a* = al_to_a al + a_to_a a`.
    pub(crate) al_to_a: V,
    /// See `al_to_a`.
    pub(crate) a_to_a: V,
    /// `w* = w + a_to_w a + next_to_w a*`.
    pub(crate) a_to_w: V,
    /// See `a_to_w`.
    pub(crate) next_to_w: V,
    /// `phi = h w + a_to_phi a + next_to_phi a*`.
    pub(crate) h: V,
    /// See `h`.
    pub(crate) a_to_phi: V,
    /// See `h`.
    pub(crate) next_to_phi: V,
    /// Velocity change per acceleration change, `h gamma'`.
    pub(crate) correct_w: V,
    /// Half the rotation per acceleration change, `h^2 beta' / 2`.
    pub(crate) correct_half_phi: V,
    /// Change of `a` per acceleration change.
    pub(crate) correct_a: V,
    /// Extrapolation of the velocity in the centripetal term.
    pub(crate) centripetal: V,
}

impl<V: Lanes> Scheme<V> {
    /// Factors of a regular step of 1 ms in every lane; see [`Scheme::set`].
    #[inline(always)]
    pub(crate) fn new() -> Self {
        let one = V::splat(1.0);
        let mut scheme = Self {
            al_to_a: one,
            a_to_a: one,
            a_to_w: one,
            next_to_w: one,
            h: one,
            a_to_phi: one,
            next_to_phi: one,
            correct_w: one,
            correct_half_phi: one,
            correct_a: one,
            centripetal: one,
        };
        for lane in 0..V::COUNT {
            scheme.set(lane, 1e-3, Phase::Regular);
        }
        scheme
    }

    /// Sets the step and the phase of one lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, h_s: f64, phase: Phase) {
        let s = Factors::of(phase);
        self.al_to_a.set(lane, 1.0 / (1.0 - s.alpha_m));
        self.a_to_a.set(lane, -s.alpha_m / (1.0 - s.alpha_m));
        self.a_to_w.set(lane, h_s * (1.0 - s.gamma));
        self.next_to_w.set(lane, h_s * s.gamma);
        self.h.set(lane, h_s);
        self.a_to_phi.set(lane, h_s * h_s * (0.5 - s.beta));
        self.next_to_phi.set(lane, h_s * h_s * s.beta);
        self.correct_w.set(lane, s.correct_w(h_s));
        self.correct_half_phi.set(lane, 0.5 * s.correct_phi(h_s));
        self.correct_a.set(lane, s.weight());
        let extrapolate = if phase == Phase::Regular {
            s.correct_w(h_s)
        } else {
            0.0
        };
        self.centripetal.set(lane, extrapolate);
    }
}

/// `kappa = h gamma' c + h^2 beta' k`: how much torque a joint resists per
/// relative angular acceleration within the step (N m s²/rad).
pub(crate) fn joint_resistance(h_s: f64, phase: Phase, rope: &RopeParams) -> f64 {
    let s = Factors::of(phase);
    s.correct_w(h_s) * rope.joint_damping_nms_per_rad
        + s.correct_phi(h_s)
            * (rope.joint_stiffness_nm_per_rad + rope.friction_stiffness_nm_per_rad())
}

/// The scheme's four numbers.
struct Factors {
    alpha_m: f64,
    alpha_f: f64,
    gamma: f64,
    beta: f64,
}

impl Factors {
    fn of(phase: Phase) -> Self {
        if phase == Phase::Restart {
            return Self {
                alpha_m: 0.0,
                alpha_f: 0.0,
                gamma: 1.0,
                beta: 1.0,
            };
        }
        let alpha_m = (2.0 * RHO - 1.0) / (RHO + 1.0);
        let alpha_f = RHO / (RHO + 1.0);
        let gamma = 0.5 + alpha_f - alpha_m;
        Self {
            alpha_m,
            alpha_f,
            gamma,
            beta: 0.25 * (gamma + 0.5).powi(2),
        }
    }

    fn weight(&self) -> f64 {
        (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
    }

    fn correct_w(&self, h_s: f64) -> f64 {
        h_s * self.gamma * self.weight()
    }

    fn correct_phi(&self, h_s: f64) -> f64 {
        h_s * h_s * self.beta * self.weight()
    }
}
