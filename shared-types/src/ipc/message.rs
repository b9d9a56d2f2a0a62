//! What processes ask each other, and what they answer.

use super::payload::ControllerMode;
use super::rpc::Rpc;
use crate::camera::StereoCamera;
use crate::fault::FaultCode;
use crate::operating_mode::OperatingMode;
use crate::plan::Task;
use crate::rope::RopeParams;
use arm_model::joint::JointVector;
use arm_model::trajectory::JointTrajectory;
use serde::{Deserialize, Serialize};

pub use super::camera::{CameraEvent, CameraRequest, CameraRpc};
pub use super::sight::{DominoLook, RopeAppearance, ScoreResult, SeenThrow};

/// Progress of a long piece of work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Steps done.
    pub done: u32,
    /// Steps in all.
    pub total: u32,
    /// A figure of merit, its meaning is in `label`.
    pub value: f64,
    /// What is being done, with the unit of `value`.
    pub label: String,
}

/// Asks of the controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ControllerRequest {
    /// What are you doing?
    Status,
    /// Connect to the arm, enable it and enter servo mode.
    Bringup,
    /// Move jerk-limited to a pose and hold it.
    MoveTo {
        /// Pose (rad).
        q: JointVector,
        /// How fast, as a part of the fastest move the limits allow (0 to 1).
        speed_fraction: f64,
    },
    /// Check a trajectory and stream it. The arm must stand at its start.
    Execute {
        /// The trajectory.
        trajectory: Box<JointTrajectory>,
        /// [`crate::plan::trajectory_hash`] of it.
        sha256: [u8; 32],
    },
    /// Allow motions of an operating mode: set-up motions for ten minutes, a wiggle or a throw
    /// that begins within ten seconds of the confirmation. Any stop disarms.
    Arm {
        /// What for.
        operating_mode: OperatingMode,
        /// When the operator confirmed that nobody is within reach of arm and rope
        /// (CLOCK_MONOTONIC, ns). Wiggles and throws need it: at most ten seconds old, and
        /// given since the arm came to rest, which is checked again when they begin. For a
        /// simulated arm a program may confirm; the controller cannot tell.
        confirmed_ns: Option<u64>,
        /// Latest begin of what it is for, where later would be another motion than was planned
        /// (CLOCK_MONOTONIC, ns).
        begins_by_ns: Option<u64>,
    },
    /// Allow no motion any more; one that runs is braked.
    Disarm,
    /// A plan with this hash will be uploaded by somebody; `Done` when it is
    /// there, refused when it does not come in time.
    Announce {
        /// [`crate::plan::trajectory_hash`] of it.
        sha256: [u8; 32],
    },
    /// Keep this trajectory until it is executed.
    Upload {
        /// The trajectory.
        trajectory: Box<JointTrajectory>,
        /// [`crate::plan::trajectory_hash`] of it.
        sha256: [u8; 32],
    },
    /// Check the uploaded trajectory and stream it, like `Execute`.
    ExecuteUploaded {
        /// [`crate::plan::trajectory_hash`] of it.
        sha256: [u8; 32],
    },
    /// Brake and latch.
    Stop,
    /// Accept a fault, so that the arm may move again.
    Acknowledge,
    /// Latency histograms since the last call of this kind.
    Latency,
    /// What are you configured for?
    Configuration,
}

/// Percentiles of one latency (µs).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Percentiles {
    /// Number of samples.
    pub count: u64,
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// 99.9th percentile.
    pub p999_us: f64,
    /// Largest.
    pub max_us: f64,
}

impl Percentiles {
    /// Of samples in nanoseconds, by nearest rank; zero without any. Allocates.
    pub fn of_ns(samples_ns: impl IntoIterator<Item = u64>) -> Self {
        let mut sorted: Vec<u64> = samples_ns.into_iter().collect();
        sorted.sort_unstable();
        let at_us = |per_mille: usize| {
            let rank = (sorted.len() * per_mille).div_ceil(1000).max(1);
            sorted.get(rank - 1).map_or(0.0, |ns| *ns as f64 * 1e-3)
        };
        Self {
            count: sorted.len() as u64,
            p50_us: at_us(500),
            p99_us: at_us(990),
            p999_us: at_us(999),
            max_us: at_us(1000),
        }
    }
}

/// Latencies of the control loop.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyReport {
    /// Lateness of wake-ups.
    pub wake: Percentiles,
    /// Computing a setpoint.
    pub compute: Percentiles,
    /// From wake-up until the setpoint is sent.
    pub send: Percentiles,
    /// Round trip of a setpoint and its reply.
    pub reply: Percentiles,
    /// Cycles.
    pub cycles: u64,
    /// Cycles missed.
    pub missed: u64,
    /// Most cycles missed at once.
    pub longest_miss: u32,
}

/// Answers of the controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ControllerEvent {
    /// Present state.
    Status {
        /// Mode.
        mode: ControllerMode,
        /// Latched fault.
        fault: FaultCode,
        /// Error code of the arm, 0 if none.
        arm_error: u8,
        /// Commanded joints (rad).
        q_c: JointVector,
        /// What the controller is armed for.
        operating_mode: Option<OperatingMode>,
        /// Real-time set-up steps that failed, in words; empty when all is well.
        warnings: Vec<String>,
    },
    /// A step of a bring-up is done.
    Step {
        /// Which step.
        name: String,
        /// What came of it.
        result: String,
    },
    /// The motion began.
    Started {
        /// Deadline of the first setpoint (CLOCK_MONOTONIC, ns).
        start_ns: u64,
    },
    /// The motion ended as planned.
    Finished {
        /// Deadline of the first setpoint (CLOCK_MONOTONIC, ns).
        start_ns: u64,
        /// Deadline of the last setpoint (CLOCK_MONOTONIC, ns).
        end_ns: u64,
    },
    /// Done.
    Done,
    /// Histograms.
    Latency(Box<LatencyReport>),
    /// The configuration in force (TOML), limits included.
    Configuration(String),
    /// Refused before anything moved.
    Refused {
        /// Cause.
        fault: FaultCode,
        /// One sentence: what happened and what to do.
        message: String,
    },
    /// Stopped on the way.
    Stopped {
        /// Cause.
        fault: FaultCode,
        /// Cycle in which it was noticed.
        cycle: u64,
        /// Error code of the arm, 0 if none.
        arm_error: u8,
        /// One sentence: what happened and what to do.
        message: String,
    },
}

/// The controller's service.
#[derive(Debug)]
pub struct ControllerRpc;

impl Rpc for ControllerRpc {
    const NAME: &'static str = "wag/v4/controller/control";
    type Request = ControllerRequest;
    type Event = ControllerEvent;
    fn is_last(event: &ControllerEvent) -> bool {
        !matches!(
            event,
            ControllerEvent::Started { .. } | ControllerEvent::Step { .. }
        )
    }
}

/// Asks of the simulated rig. Only the summary at the end of a run asks for
/// the truth; nothing that identifies or plans does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum RigRequest {
    /// Which ports does the arm listen on?
    Ports,
    /// Put what a task is thrown at there: the target ball, or the bodies of a lob or drape.
    PlaceTarget {
        /// What the throw will be for.
        task: Task,
        /// The target in the world (m).
        target_m: [f64; 3],
    },
    /// Take away what a throw was for, and hold the rope until it hangs still, as somebody
    /// does before the next run.
    Tidy,
    /// What really happened between two instants?
    Truth {
        /// From (CLOCK_MONOTONIC, ns).
        from_ns: u64,
        /// To (CLOCK_MONOTONIC, ns).
        to_ns: u64,
    },
    /// What a laboratory would know: where the camera stands, and which colours to look for.
    Scene,
}

/// Answers of the simulated rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum RigEvent {
    /// Ports in use.
    Ports {
        /// Command port.
        command: u16,
        /// Report ports 30000, 30001, 30002, 30003 or their replacements.
        reports: [u16; 4],
    },
    /// Done.
    Done,
    /// The truth.
    Truth {
        /// The hidden rope.
        rope: RopeParams,
        /// Smallest distance of tip and target centre in that time (m).
        closest_m: f64,
        /// When (CLOCK_MONOTONIC, ns).
        closest_ns: u64,
        /// Fastest tip speed in that time (m/s).
        peak_tip_speed_m_s: f64,
        /// Whether the rope touched arm or column in that time.
        touched: bool,
        /// Where tip and middle were, and what became of the task's bodies.
        seen: Box<SeenThrow>,
    },
    /// What there is to see.
    Scene {
        /// The calibrated camera.
        camera: Box<StereoCamera>,
        /// Colour of the rope's tip.
        tip_rgb: [u8; 3],
        /// Colour of the target.
        target_rgb: [u8; 3],
    },
    /// It did not work.
    Failed {
        /// One sentence: what happened and what to do.
        message: String,
    },
}

/// The simulated rig's service.
#[derive(Debug)]
pub struct RigRpc;

impl Rpc for RigRpc {
    const NAME: &'static str = "wag/v4/rig/control";
    type Request = RigRequest;
    type Event = RigEvent;
    fn is_last(_event: &RigEvent) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::Percentiles;

    #[test]
    fn percentiles_are_samples_by_nearest_rank() {
        let p = Percentiles::of_ns((1..=1000).map(|k| k * 1000));
        let found = [p.p50_us, p.p99_us, p.p999_us, p.max_us];
        let mut pairs = found.iter().zip([500.0, 990.0, 999.0, 1000.0]);
        assert!(pairs.all(|(g, w)| (g - w).abs() < 1e-9), "{p:?}");
        assert_eq!(Percentiles::of_ns([]).count, 0);
    }
}
