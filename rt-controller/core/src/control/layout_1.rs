//! States as recordings of layout 1 hold them: there the motion, the stop and the
//! cause stood beside the mode, which now holds them.

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

/// In the order of the bytes.
#[derive(Deserialize)]
struct Recorded {
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
        let (recorded, rest) = postcard::take_from_bytes::<Recorded>(bytes).ok()?;
        if !rest.is_empty() {
            return None;
        }
        let running = || {
            let Running {
                id,
                start_ns,
                motion,
            } = recorded.running?;
            let motion = motion_of(id, motion)?;
            Some(Running {
                id,
                start_ns,
                motion,
            })
        };
        let state = match recorded.mode {
            ControllerMode::Offline => ModeState::Offline,
            ControllerMode::Idle => ModeState::Idle,
            ControllerMode::Moving | ControllerMode::Streaming => ModeState::Following(running()?),
            ControllerMode::Braking => {
                let (start_ns, stop) = recorded.stopping?;
                ModeState::Braking(Braking {
                    running: running()?,
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
            state,
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
