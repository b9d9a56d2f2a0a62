//! Minutes of the control core and the simulated arm in virtual time: swing
//! after swing, a fault every few seconds, recorded like a run.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test and an example use this, each a part of it, and may fail loudly"
)]

use arm_model::joint::START_POSE;
use arm_model::{JointVector, Limits};
use hil_tests::scenario::{entry, swing};
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlState, Motion, Thresholds};
use rt_controller::point_to_point::plan_move;
use rt_controller::recording::{ChunkWriter, RecordedCycle, Snapshot};
use shared_types::ipc::ControllerMode;
use std::collections::BTreeMap;
use xarm_sim::FaultScript;

/// Nearer to the start pose than this is at home (rad).
const HOME_RAD: f64 = 0.01;
/// Largest joint speed of a rig that may be brought up again (rad/s).
const STILL_RAD_S: f64 = 1e-3;

/// What goes wrong in turn; every one ends by itself or with the next bring-up.
const FAULTS: [&str; 16] = [
    "stall, duration_s = 0.19",
    "connection_reset",
    "replies_delayed, delay_s = 0.006, duration_s = 1.0",
    "replies_duplicated, duration_s = 1.0",
    "replies_reordered, duration_s = 1.0",
    "replies_lost, share = 0.02, duration_s = 1.0",
    "raise_error, code = 31",
    "mode_changed, mode = 0",
    "report_stop, duration_s = 0.5",
    "report_freeze, duration_s = 0.5",
    "report_garbage, frames = 3",
    "report_time_jump, by_s = 5.0",
    "tracking_lag, lag_s = 0.2, duration_s = 1.0",
    "joint_stuck, joint = 6, duration_s = 1.0",
    "encoder_jump, joint = 4, by_rad = 0.0873, duration_s = 1.0",
    "warning_bit, duration_s = 1.0",
];

/// A recorded flight.
pub(crate) struct Flight {
    /// The recording, as it would lie on the disk.
    pub(crate) bytes: Vec<u8>,
    pub(crate) cycles: u64,
    pub(crate) causes: usize,
}

fn script(span_s: f64, pause_s: f64) -> FaultScript {
    let mut text = String::new();
    let mut at_s = 3.0;
    for fault in FAULTS.iter().cycle() {
        if at_s >= span_s {
            break;
        }
        text += &entry(&format!("at_s = {at_s:.3}"), fault);
        // Not in step with the swings: each fault meets every part of them.
        at_s += pause_s + 0.137;
    }
    text.parse().unwrap()
}

/// A swing from home, or the way home from where a stop left the arm.
fn from_here(q: JointVector) -> Motion {
    let off = q.zip_with(START_POSE, |a, b| a - b).max_abs();
    if off > HOME_RAD {
        plan_move(&q, &START_POSE, 0.3, &Limits::default()).unwrap()
    } else {
        swing(q).unwrap()
    }
}

/// Flies for `span_s`, with a fault every `pause_s` or so: who is stopped is brought up again and
/// goes on.
pub(crate) fn fly(span_s: f64, pause_s: f64) -> Flight {
    let faults = script(span_s, pause_s);
    let mut config = VirtualRigConfig::new(Thresholds::strict().into(), faults);
    config.arm.seed = 20;
    let before = ControlState::new(config.limits.clone(), config.settings);
    let mut rig = VirtualRig::new(config);
    let end = rig.now().plus_s(span_s);
    let mut motions = BTreeMap::new();
    let mut swings = 0_u32;
    while rig.now() < end {
        match rig.mode() {
            ControllerMode::Offline | ControllerMode::Faulted => {
                let still = |rig: &VirtualRig| {
                    let speed = rig.with_arm(|arm| arm.model().true_motion().qd.max_abs());
                    speed < STILL_RAD_S
                };
                rig.run_until(5.0, still);
                // A cable that is out comes back.
                if rig.bring_up().is_err() {
                    rig.run_for(0.5);
                }
            }
            ControllerMode::Idle => {
                swings += 1;
                let motion = from_here(rig.commanded());
                motions.insert(rig.start(motion.clone()), motion);
                if swings.is_multiple_of(7) {
                    rig.oversleep([0, 900_000, 0, 5_000_000, 0, 9_000_000]);
                }
                rig.run_cycles(5);
            }
            ControllerMode::Moving | ControllerMode::Streaming | ControllerMode::Braking => {
                rig.run_cycles(5);
            }
        }
    }
    Flight {
        bytes: record(&before, &rig, &motions),
        cycles: rig.log.records.len() as u64,
        causes: rig.log.causes.len(),
    }
}

/// Writes the rig's log as the controller writes it: one keyframe, then every
/// cycle, each motion before the cycle that was told of it.
fn record(before: &ControlState, rig: &VirtualRig, motions: &BTreeMap<u64, Motion>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ChunkWriter::default();
    let keyframe = Snapshot::of(before).expect("a state fits into a snapshot");
    bytes.extend(writer.keyframe(&keyframe).unwrap_or_default());
    let mut causes = rig.log.causes.iter().peekable();
    for (input, record) in rig.log.inputs.iter().zip(&rig.log.records) {
        if let Some(motion) = motions.get(&input.command.motion_id) {
            writer.motion(input.command.motion_id, motion);
        }
        let cycle = RecordedCycle {
            input: *input,
            record: *record,
        };
        bytes.extend(writer.cycle(&cycle).unwrap_or_default());
        while let Some(cause) = causes.next_if(|c| c.rest_cycle <= record.cycle) {
            writer.cause(cause);
        }
    }
    bytes.extend(writer.flush().unwrap_or_default());
    bytes
}
