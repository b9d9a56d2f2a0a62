//! The whole state as bytes and back, for keyframes of recordings.
//!
//! The running motion is named by number and fingerprint; everything else is
//! in the bytes, limits and thresholds included.

use super::cycle::ControlState;
use super::mode::ModeState;
use super::motion::Motion;
use super::settings::ControlSettings;
use alloc::boxed::Box;
use arm_model::Limits;

impl ControlState {
    /// The limits it keeps.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// What it is configured to do.
    #[must_use]
    pub const fn settings(&self) -> &ControlSettings {
        &self.settings
    }

    /// Writes the state to the front of `bytes`; returns how many were needed,
    /// `None` when there are too few. RT-safe.
    #[must_use]
    pub fn write_to(&self, bytes: &mut [u8]) -> Option<usize> {
        let named = self.state.try_map(|_, motion| Some(motion.fingerprint()))?;
        postcard::to_slice(&(named, self), bytes)
            .ok()
            .map(|written| written.len())
    }

    /// The state that [`ControlState::write_to`] wrote; `motion_of` finds the
    /// running motion by number and fingerprint. `None` when the bytes are of
    /// another version or the motion is not there.
    pub fn read_from(
        bytes: &[u8],
        motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
    ) -> Option<Self> {
        let ((named, mut state), rest) =
            postcard::take_from_bytes::<(ModeState<u64>, Self)>(bytes).ok()?;
        if !rest.is_empty() {
            return None;
        }
        state.state = named.try_map(|id, hash| motion_of(id, *hash))?;
        Some(state)
    }
}
