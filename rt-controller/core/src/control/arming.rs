//! Arming: what the arm may be moved for, and for how long.
//!
//! ```text
//!              Arm                 throw begins
//!  Disarmed ---------> Armed(for) ------------> Spent(throw)
//!     ^                   |                          |
//!     +-------------------+--------------------------+
//!       Disarm, expiry, dead-man switch released, any stop, end of the shot
//! ```
//!
//! Nothing re-arms by itself.

use serde::{Deserialize, Serialize};
use shared_types::{Arming, FaultCode, OperatingMode};

/// Longest time from arming a throw to its begin (ns).
pub const THROW_WITHIN_NS: u64 = 10_000_000_000;

/// What motions are allowed. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ArmingState {
    /// None.
    #[default]
    Disarmed,
    /// Those of an operating mode, begun before it expires.
    Armed(Arming),
    /// The one that runs: a throw, armed for one shot.
    Spent,
}

impl ArmingState {
    /// Takes an arming.
    ///
    /// # Errors
    /// [`FaultCode::NotArmed`] for a throw without a clear area,
    /// [`FaultCode::ArmingExpired`] for one that has already expired.
    pub fn arm(&mut self, arming: Arming, now_ns: u64) -> Result<Arming, FaultCode> {
        let mut arming = arming;
        if arming.operating_mode == OperatingMode::Throw {
            if !arming.area_clear {
                return Err(FaultCode::NotArmed);
            }
            arming.expires_ns = arming
                .expires_ns
                .min(now_ns.saturating_add(THROW_WITHIN_NS));
        }
        if arming.expires_ns <= now_ns {
            return Err(FaultCode::ArmingExpired);
        }
        *self = Self::Armed(arming);
        Ok(arming)
    }

    /// Operating mode under which a motion may begin now.
    ///
    /// # Errors
    /// [`FaultCode::NotArmed`], [`FaultCode::ArmingExpired`].
    pub const fn admit(&self, now_ns: u64) -> Result<OperatingMode, FaultCode> {
        match self {
            Self::Disarmed | Self::Spent => Err(FaultCode::NotArmed),
            Self::Armed(arming) if arming.expires_ns <= now_ns => Err(FaultCode::ArmingExpired),
            Self::Armed(arming) => Ok(arming.operating_mode),
        }
    }

    /// Whether an arming ran out at `now_ns`.
    #[must_use]
    pub const fn is_expired(&self, now_ns: u64) -> bool {
        matches!(self, Self::Armed(arming) if arming.expires_ns <= now_ns)
    }

    /// Operating mode that is armed or runs, raw; 0 for none.
    #[must_use]
    pub const fn raw_operating_mode(&self) -> u8 {
        match self {
            Self::Disarmed => 0,
            Self::Armed(arming) => arming.operating_mode as u8,
            Self::Spent => OperatingMode::Throw as u8,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_NS: u64 = 5_000_000_000;

    fn throw(expires_ns: u64, area_clear: bool) -> Arming {
        Arming {
            operating_mode: OperatingMode::Throw,
            expires_ns,
            area_clear,
        }
    }

    #[test]
    fn a_throw_needs_a_clear_area_and_begins_within_ten_seconds() {
        let mut state = ArmingState::default();
        assert_eq!(state.admit(NOW_NS), Err(FaultCode::NotArmed));
        assert_eq!(
            state.arm(throw(u64::MAX, false), NOW_NS),
            Err(FaultCode::NotArmed)
        );
        assert_eq!(state, ArmingState::Disarmed);
        let taken = state.arm(throw(u64::MAX, true), NOW_NS).unwrap();
        assert_eq!(taken.expires_ns, NOW_NS + THROW_WITHIN_NS);
        assert_eq!(state.admit(taken.expires_ns - 1), Ok(OperatingMode::Throw));
        assert_eq!(state.admit(taken.expires_ns), Err(FaultCode::ArmingExpired));
        assert_eq!(
            ArmingState::default().arm(throw(NOW_NS, true), NOW_NS),
            Err(FaultCode::ArmingExpired)
        );
    }

    #[test]
    fn a_spent_shot_admits_nothing() {
        assert_eq!(ArmingState::Spent.admit(0), Err(FaultCode::NotArmed));
        assert_eq!(
            ArmingState::Spent.raw_operating_mode(),
            OperatingMode::Throw as u8
        );
    }
}
