//! How setpoints reach the arm.

use serde::{Deserialize, Serialize};

/// Which of the arm's streaming modes carries the motion. Numbers are part of
/// recorded runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum CommandInterface {
    /// Joint positions (mode 1, register 29): the arm holds the last one when
    /// nothing comes, and stops with C60 above its tool speed limit.
    #[default]
    ServoPosition = 0,
    /// Joint velocities (mode 4, register 81, firmware 1.8 or later): each
    /// carries a duration after which the arm stops by itself; the controller
    /// closes the position loop.
    JointVelocity = 1,
}

impl CommandInterface {
    /// The mode of a raw number, if there is one. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u8) -> Option<Self> {
        let mut all = [Self::ServoPosition, Self::JointVelocity].into_iter();
        all.find(|interface| *interface as u8 == raw)
    }

    /// The arm's own number of the mode it must be in.
    #[must_use]
    pub const fn arm_mode(self) -> u8 {
        match self {
            Self::ServoPosition => 1,
            Self::JointVelocity => 4,
        }
    }
}
