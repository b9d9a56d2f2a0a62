//! Vectors over the seven arm joints.

use core::ops::{Add, Index, IndexMut, Mul, Sub};
#[cfg(feature = "std")]
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Number of joints of the arm.
pub const JOINTS: usize = 7;

/// One number per joint, joint 1 first. The unit is that of the context: rad,
/// rad/s, rad/s² or rad/s³. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
#[serde(transparent)]
pub struct JointVector(pub [f64; JOINTS]);

impl JointVector {
    /// All zero.
    pub const ZERO: Self = Self([0.0; JOINTS]);

    /// The same value for every joint.
    #[must_use]
    pub const fn splat(value: f64) -> Self {
        Self([value; JOINTS])
    }

    /// Applies `f` to every joint.
    #[must_use]
    pub fn map(self, f: impl FnMut(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }

    /// Combines two vectors joint by joint.
    #[must_use]
    pub fn zip_with(self, other: Self, mut f: impl FnMut(f64, f64) -> f64) -> Self {
        Self(core::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    /// Whether no entry is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.0.iter().all(|v| v.is_finite())
    }

    /// Largest absolute entry; NaN entries are ignored.
    #[must_use]
    pub fn max_abs(&self) -> f64 {
        self.0.iter().fold(0.0, |m, v| m.max(v.abs()))
    }

    /// The entries, joint 1 first.
    pub fn iter(&self) -> core::slice::Iter<'_, f64> {
        self.0.iter()
    }
}

impl From<[f64; JOINTS]> for JointVector {
    fn from(value: [f64; JOINTS]) -> Self {
        Self(value)
    }
}

impl Index<usize> for JointVector {
    type Output = f64;
    fn index(&self, joint: usize) -> &f64 {
        &self.0[joint]
    }
}

impl IndexMut<usize> for JointVector {
    fn index_mut(&mut self, joint: usize) -> &mut f64 {
        &mut self.0[joint]
    }
}

impl Add for JointVector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a + b)
    }
}

impl Sub for JointVector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a - b)
    }
}

impl Mul<f64> for JointVector {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(|v| v * factor)
    }
}

/// Position, velocity and acceleration of all joints at one instant. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct JointState {
    /// Position (rad).
    pub q: JointVector,
    /// Velocity (rad/s).
    pub qd: JointVector,
    /// Acceleration (rad/s²).
    pub qdd: JointVector,
}

impl JointState {
    /// At rest in `q`.
    #[must_use]
    pub const fn at_rest(q: JointVector) -> Self {
        Self {
            q,
            qd: JointVector::ZERO,
            qdd: JointVector::ZERO,
        }
    }

    /// Whether no number is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.q.is_finite() && self.qd.is_finite() && self.qdd.is_finite()
    }
}

/// Start pose of wiggle and throws: pole straight down in front of the robot
/// (rad).
pub const START_POSE: JointVector = JointVector([0.0, 0.8, 0.0, 2.4, 0.0, 1.6, 0.0]);
