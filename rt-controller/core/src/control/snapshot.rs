//! The whole state as bytes and back, for keyframes of recordings.
//!
//! The running motion is named by number and fingerprint; everything else is
//! in the bytes, limits and thresholds included.

use super::arming::ArmingState;
use super::cycle::ControlState;
use super::limiter::Limiter;
use super::mode::{Braking, ModeState, Running};
use super::monitor::Monitor;
use super::motion::Motion;
use super::settings::ControlSettings;
use super::stopping::Stop;
use super::velocity_interface::VelocityInterface;
use alloc::boxed::Box;
use arm_model::{JointState, Limits};
use serde::Deserialize;
use shared_types::FaultCode;
use shared_types::ipc::{CauseRecord, ControllerMode};

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
        let written = postcard::to_slice(&(named, self), bytes).ok()?.len();
        let Some(prediction) = &self.monitor.reports.prediction else {
            return Some(written);
        };
        let behind = postcard::to_slice(prediction, bytes.get_mut(written..)?).ok()?;
        Some(written.saturating_add(behind.len()))
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
        // The states of arms that were not measured, and those before there were any, end here.
        if !rest.is_empty() {
            let (prediction, rest) = postcard::take_from_bytes(rest).ok()?;
            if !rest.is_empty() {
                return None;
            }
            state.monitor.reports.prediction = Some(prediction);
        }
        state.state = named.try_map(|id, hash| motion_of(id, *hash))?;
        Some(state)
    }
}

/// States as recordings of layout 1 hold them, in the order of the bytes: the motion,
/// the stop and the cause stand beside the mode, which now holds them.
#[derive(Deserialize)]
struct Layout1 {
    /// Kept for one cycle longer than it ran; a fingerprint stands for the motion.
    running: Option<Running<u64>>,
    limits: Limits,
    settings: ControlSettings,
    mode: ControllerMode,
    fault: FaultCode,
    cause: CauseRecord,
    arming: ArmingState,
    cycle: u64,
    motions_done: u64,
    commanded: JointState,
    sent_ns: u64,
    limiter: Limiter,
    tcp_speed_max_m_s: f64,
    velocity: VelocityInterface,
    monitor: Monitor,
    /// When it began (ns), and how it goes.
    stopping: Option<(u64, Stop)>,
}

impl ControlState {
    /// The state that a recording of layout 1 holds; otherwise as
    /// [`ControlState::read_from`].
    pub fn read_layout_1(
        bytes: &[u8],
        motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
    ) -> Option<Self> {
        let (recorded, rest) = postcard::take_from_bytes::<Layout1>(bytes).ok()?;
        if !rest.is_empty() {
            return None;
        }
        let named = match recorded.mode {
            ControllerMode::Offline => ModeState::Offline,
            ControllerMode::Idle => ModeState::Idle,
            ControllerMode::Moving | ControllerMode::Streaming => {
                ModeState::Following(recorded.running?)
            }
            ControllerMode::Braking => {
                let (start_ns, stop) = recorded.stopping?;
                ModeState::Braking(Braking {
                    running: recorded.running?,
                    start_ns,
                    stop,
                    fault: recorded.fault,
                    cause: recorded.cause,
                })
            }
            ControllerMode::Faulted => ModeState::Faulted(recorded.fault),
        };
        Some(Self {
            limits: recorded.limits,
            settings: recorded.settings,
            state: named.try_map(|id, hash| motion_of(id, *hash))?,
            arming: recorded.arming,
            cycle: recorded.cycle,
            motions_done: recorded.motions_done,
            commanded: recorded.commanded,
            sent_ns: recorded.sent_ns,
            limiter: recorded.limiter,
            tcp_speed_max_m_s: recorded.tcp_speed_max_m_s,
            velocity: recorded.velocity,
            monitor: recorded.monitor,
        })
    }
}
