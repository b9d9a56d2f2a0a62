//! Fixed-layout payloads. Every one starts with [`PAYLOAD_VERSION`]; service
//! names carry the version too, so that old readers never see new layouts.

use arm_model::joint::JointVector;
#[cfg(feature = "std")]
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Version of all payload layouts in this file.
pub const PAYLOAD_VERSION: u32 = 2;

/// Packed 4:2:2, `Y0 U Y1 V`, full-range BT.601, as V4L2 `YUYV`.
pub const PIXEL_FORMAT_YUYV: u32 = 1;

/// Header of a side-by-side stereo frame; the payload is the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct FrameHeader {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// [`PIXEL_FORMAT_YUYV`].
    pub pixel_format: u32,
    /// Frames since the camera started; gaps are dropped frames.
    pub sequence: u64,
    /// Start of exposure of row 0 (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Pixels per row, both eyes together.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
}

/// What the controller is doing. Numbers are part of the shared layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum ControllerMode {
    /// Not connected to an arm yet.
    #[default]
    Offline = 0,
    /// Holding still; ready for a command.
    Idle = 1,
    /// Moving jerk-limited to a pose.
    Moving = 2,
    /// Streaming an uploaded trajectory.
    Streaming = 3,
    /// Coming to rest after a fault: along the path or by a joint-space brake.
    Braking = 4,
    /// Stopped by a fault; waits for the operator to acknowledge.
    Faulted = 5,
}

impl ControllerMode {
    /// The mode of a raw number from shared memory; unknown ones read as
    /// [`ControllerMode::Faulted`]. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u8) -> Self {
        use ControllerMode::{Braking, Faulted, Idle, Moving, Offline, Streaming};
        let mut all = [Offline, Idle, Moving, Streaming, Braking].into_iter();
        all.find(|mode| *mode as u8 == raw).unwrap_or(Faulted)
    }

    /// Whether setpoints change in this mode.
    #[must_use]
    pub const fn is_moving(self) -> bool {
        matches!(self, Self::Moving | Self::Streaming | Self::Braking)
    }
}

/// State of the controller, on a blackboard. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct ControllerState {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// Present mode, raw [`ControllerMode`].
    pub mode: u8,
    /// 1 when the loop runs with real-time priority and locked memory.
    pub real_time: u8,
    /// Latched fault, raw [`crate::FaultCode`].
    pub fault: u16,
    /// Cycle counter.
    pub cycle: u64,
    /// When the cycle woke (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Number of trajectories and moves finished.
    pub motions_done: u64,
    /// Commanded joints (rad).
    pub q_c: JointVector,
    /// Measured joints (rad).
    pub q: JointVector,
    /// Armed operating mode, raw [`crate::OperatingMode`]; 0 when not armed.
    pub operating_mode: u8,
    /// Raw [`crate::CommandInterface`].
    pub interface: u8,
    /// 1 when the command link failed since the engagement, whatever stopped the arm first.
    pub link_failed: u8,
    /// Zero.
    pub reserved: u8,
    /// The controller's process.
    pub pid: u32,
}

/// The operator's sign of life, on a blackboard. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct OperatorBeat {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// 1: stop now.
    pub stop: u32,
    /// Grows with every beat.
    pub count: u64,
    /// 1: the dead-man switch is let go; the arm may not move.
    pub released: u32,
    /// Zero.
    pub reserved: u32,
}

/// The guardian's sign of life, on a blackboard. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct GuardianBeat {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// What it is doing: 0 waiting, 1 watching, 2 stopping, 3 stopped the arm,
    /// 4 could not see the arm stop.
    pub phase: u8,
    /// 1 while the arm answers it, on a connection of its own.
    pub connected: u8,
    /// Zero.
    pub reserved: u16,
    /// Grows with every beat.
    pub count: u64,
    /// When it was written (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
}

impl GuardianBeat {
    /// The phase of a guardian that watches a controller.
    pub const WATCHING: u8 = 1;

    /// Whether it could stop the arm now: it watches, and the arm answers it. RT-safe.
    #[must_use]
    pub const fn guards(&self) -> bool {
        self.phase == Self::WATCHING && self.connected != 0
    }
}

/// One control cycle. Written by the real-time thread into a ring, published by
/// the bridge. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct CycleRecord {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// Mode after the cycle, raw [`ControllerMode`].
    pub mode: u8,
    /// 1 when a setpoint was commanded; whether it went out says [`Self::held_back`].
    pub sent: u8,
    /// Fault latched, raw [`crate::FaultCode`].
    pub fault: u16,
    /// Cycle counter.
    pub cycle: u64,
    /// Planned wake-up (CLOCK_MONOTONIC, ns).
    pub deadline_ns: u64,
    /// Lateness of the wake-up (ns).
    pub wake_late_ns: u32,
    /// Time to compute the setpoint (ns).
    pub compute_ns: u32,
    /// From wake-up to the return of the send call (ns).
    pub send_ns: u32,
    /// Round trip of the newest reply, 0 if none came (ns).
    pub reply_ns: u32,
    /// Cycles missed before this one.
    pub missed: u32,
    /// Records lost so far because nobody drained the ring.
    pub dropped: u32,
    /// Time on the trajectory (s), negative when none runs.
    pub trajectory_s: f64,
    /// Commanded joints (rad).
    pub q_c: JointVector,
    /// Newest measured joints (rad).
    pub q: JointVector,
    /// When they were measured (CLOCK_MONOTONIC, ns).
    pub q_stamp_ns: u64,
    /// How fast the path is followed: 1 as planned, 0 at rest or off the path.
    pub speed_override: f64,
    /// Joint velocity on the wire in joint-velocity mode (rad/s), else zero.
    pub qd_sent: JointVector,
}

impl CycleRecord {
    /// Whether a setpoint was commanded that did not go out, because the cycle was held up
    /// before the send. In virtual time a send takes no time, and nothing else does.
    #[must_use]
    pub const fn held_back(&self) -> bool {
        self.sent != 0 && self.send_ns == 0 && self.compute_ns > 0
    }
}

/// One joint report of the arm, as received. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct JointReport {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// Arm state (manual: 1 moving, 2 ready, 3 paused, 4 stopped, 5 changed).
    pub arm_state: u8,
    /// Arm mode.
    pub arm_mode: u8,
    /// 1 when the arm's own clock stamp was used, 2 when that clock jumped and is
    /// followed anew from this report on.
    pub arm_clock: u16,
    /// When the joints were measured, on CLOCK_MONOTONIC (ns).
    pub stamp_ns: u64,
    /// When the report arrived (CLOCK_MONOTONIC, ns).
    pub arrival_ns: u64,
    /// Measured joints (rad).
    pub q: JointVector,
    /// Measured joint speeds (rad/s).
    pub qd: JointVector,
    /// Joints the arm was told to take (rad).
    pub q_target: JointVector,
}
