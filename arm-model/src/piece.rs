//! Joint motion between two instants at which it is known.
//!
//! Who has positions, speeds and accelerations takes a quintic; who has reported positions
//! only takes a cubic with the slopes between their neighbours. Two other readers of
//! measured joints do something else on purpose: `rope_sim::MeasuredArm` fits a whole log
//! by least squares, because encoder noise must not become acceleration, and the tracker's
//! `ClampPath` interpolates the clamp's place in the picture linearly.

use crate::joint::{JointState, JointVector};

/// A polynomial of at most fifth degree from one instant to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointPiece {
    /// Coefficients of `(t / span)^i`, i = 0 to 5.
    c: [JointVector; 6],
    span_s: f64,
}

fn sum<const N: usize>(terms: [(JointVector, f64); N]) -> JointVector {
    let scaled = terms.into_iter().map(|(v, k)| v * k);
    scaled.fold(JointVector::ZERO, |sum, v| sum + v)
}

impl JointPiece {
    /// The quintics that meet position, speed and acceleration at both ends.
    #[must_use]
    pub fn quintic(from: &JointState, to: &JointState, span_s: f64) -> Self {
        let (v0, v1) = (from.qd * span_s, to.qd * span_s);
        let square = span_s * span_s;
        let (a0, a1) = (from.qdd * square, to.qdd * square);
        let d = to.q - from.q;
        Self {
            c: [
                from.q,
                v0,
                a0 * 0.5,
                sum([(d, 10.0), (v0, -6.0), (v1, -4.0), (a0, -1.5), (a1, 0.5)]),
                sum([(d, -15.0), (v0, 8.0), (v1, 7.0), (a0, 1.5), (a1, -1.0)]),
                sum([(d, 6.0), (v0, -3.0), (v1, -3.0), (a0, -0.5), (a1, 0.5)]),
            ],
            span_s,
        }
    }

    /// The cubics that meet position (rad) and speed (rad/s) at both ends.
    #[must_use]
    pub fn cubic(q: [JointVector; 2], qd: [JointVector; 2], span_s: f64) -> Self {
        let (d, [v0, v1]) = (q[1] - q[0], qd.map(|v| v * span_s));
        Self {
            c: [
                q[0],
                v0,
                sum([(d, 3.0), (v0, -2.0), (v1, -1.0)]),
                sum([(d, -2.0), (v0, 1.0), (v1, 1.0)]),
                JointVector::ZERO,
                JointVector::ZERO,
            ],
            span_s,
        }
    }

    /// Joint state `t_s` after its begin.
    #[must_use]
    pub fn at(&self, t_s: f64) -> JointState {
        let (u, h) = (t_s / self.span_s, self.span_s);
        // Horner's rule for position, velocity and acceleration at once.
        let mut q = self.c[5];
        let (mut qd, mut half_qdd) = (JointVector::ZERO, JointVector::ZERO);
        for c in self.c[..5].iter().rev() {
            half_qdd = half_qdd * u + qd;
            qd = qd * u + q;
            q = q * u + *c;
        }
        JointState {
            q,
            qd: qd.map(|v| v / h),
            qdd: half_qdd.map(|v| 2.0 * v / (h * h)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_meets_its_ends_and_reproduces_a_polynomial_of_its_degree() {
        // q = k t^5 - 2 t^3 + 3 t, with its derivatives.
        let exact = |k: f64, t: f64| JointState {
            q: JointVector::splat(k * t.powi(5) - 2.0 * t.powi(3) + 3.0 * t),
            qd: JointVector::splat(5.0 * k * t.powi(4) - 6.0 * t * t + 3.0),
            qdd: JointVector::splat(20.0 * k * t.powi(3) - 12.0 * t),
        };
        let quintic = JointPiece::quintic(&exact(1.0, 0.3), &exact(1.0, 0.8), 0.5);
        let (from, to) = (exact(0.0, 0.3), exact(0.0, 0.8));
        let cubic = JointPiece::cubic([from.q, to.q], [from.qd, to.qd], 0.5);
        for (k, piece) in [(1.0, quintic), (0.0, cubic)] {
            for t in [0.3, 0.41, 0.55, 0.8] {
                let (got, want) = (piece.at(t - 0.3), exact(k, t));
                assert!((got.q[0] - want.q[0]).abs() < 1e-12);
                assert!((got.qd[3] - want.qd[3]).abs() < 1e-11);
                assert!((got.qdd[6] - want.qdd[6]).abs() < 1e-10);
            }
        }
    }
}
