//! What comes from shared memory, as messages, and the fields that messages share.

use super::urdf::joint_name;
use arm_model::{JOINTS, JointVector};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use shared_types::FaultCode;
use shared_types::ipc::{CauseRecord, ControllerMode, CycleRecord, JointReport};
use shared_types::keypoints::KeypointFrame;

/// Optical frame of the left eye.
pub(super) const CAMERA_FRAME: &str = "camera_left";

/// A wall time as messages hold it.
pub(super) fn time(wall_ns: u64) -> Value {
    json!({ "sec": wall_ns / 1_000_000_000, "nsec": wall_ns % 1_000_000_000 })
}

/// A colour with its opacity.
pub(super) fn colour([r, g, b, a]: [f64; 4]) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}

/// A tenth of a microradian or a micrometre is less than anything here is known to;
/// the exact bits are in the recording for replay.
pub(super) fn round(value: f64) -> f64 {
    (value * 1e7).round() / 1e7
}

/// Levels of `foxglove.Log`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    Info = 2,
    Error = 4,
}

/// Angles that are no numbers are left out, as the schema has it.
fn joints(at_ns: u64, q: &JointVector, qd: Option<&JointVector>) -> Value {
    let joints: Vec<Value> = (0..JOINTS)
        .map(|i| {
            let mut joint = json!({ "name": joint_name(i) });
            if q[i].is_finite() {
                joint["position"] = round(q[i]).into();
            }
            if let Some(qd) = qd.filter(|qd| qd[i].is_finite()) {
                joint["velocity"] = round(qd[i]).into();
            }
            joint
        })
        .collect();
    json!({ "timestamp": time(at_ns), "joints": joints })
}

/// Measured joints.
pub(super) fn measured(at_ns: u64, report: &JointReport) -> Value {
    joints(at_ns, &report.q, Some(&report.qd))
}

/// Commanded joints.
pub(super) fn commanded(at_ns: u64, cycle: &CycleRecord) -> Value {
    joints(at_ns, &cycle.q_c, None)
}

/// A controller mode as a cycle's message names it.
pub(super) fn mode_name(mode: ControllerMode) -> String {
    format!("{mode:?}")
}

/// Figures of a cycle.
pub(super) fn cycle(at_ns: u64, c: &CycleRecord) -> Value {
    let us = |ns: u32| f64::from(ns) / 1e3;
    let mut message = json!({
        "timestamp": time(at_ns),
        "cycle": c.cycle,
        "mode": mode_name(ControllerMode::from_raw(c.mode)),
        "fault": format!("{:?}", FaultCode::from_raw(c.fault).unwrap_or_default()),
        "sent": c.sent != 0,
        "wake_late_us": us(c.wake_late_ns),
        "compute_us": us(c.compute_ns),
        "send_us": us(c.send_ns),
        "reply_us": us(c.reply_ns),
        "missed": c.missed,
        "dropped": c.dropped,
        "speed_override": if c.speed_override.is_finite() { round(c.speed_override) } else { 0.0 },
    });
    // Negative while nothing runs.
    if c.trajectory_s >= 0.0 {
        message["trajectory_s"] = round(c.trajectory_s).into();
    }
    message
}

/// A line of the log.
pub(super) fn log(at_ns: u64, level: Level, text: &str) -> Value {
    json!({
        "timestamp": time(at_ns), "level": level as u32, "message": text,
        "name": "rt-controller", "file": "", "line": 0,
    })
}

/// Why the arm was stopped, in a sentence or two.
pub(super) fn cause(record: &CauseRecord) -> String {
    let fault = record.fault();
    let mut text = format!("stopped in cycle {}: {fault:?}", record.cycle);
    if record.arm_error != 0 {
        text.push_str(&format!(", arm error C{}", record.arm_error));
    }
    if record.limit.joint != 0 {
        text.push_str(&format!(", joint {}", record.limit.joint));
    }
    if record.limit.limit.abs() > 0.0 {
        text.push_str(&format!(
            ", {:.4} where {:.4} is allowed",
            record.limit.value, record.limit.limit
        ));
    }
    format!("{text}; {}", fault.explain())
}

/// The camera's left eye.
pub(super) fn image(at_ns: u64, jpeg: &[u8]) -> Value {
    json!({
        "timestamp": time(at_ns), "frame_id": CAMERA_FRAME, "data": STANDARD.encode(jpeg), "format": "jpeg",
    })
}

/// Keypoints: a line along the rope; nothing where it was lost. A pixel's centre is
/// a whole number here and half a pixel farther in the viewers' count.
pub(super) fn keypoints(at_ns: u64, frame: &KeypointFrame) -> Value {
    let points: Vec<Value> = frame
        .points()
        .iter()
        .filter(|[u, v]| !frame.is_lost() && u.is_finite() && v.is_finite())
        .map(|[u, v]| json!({ "x": round(f64::from(*u) + 0.5), "y": round(f64::from(*v) + 0.5) }))
        .collect();
    // Single points, then the line through them.
    let drawn = |kind: u32, thickness: f64| {
        json!({
            "timestamp": time(at_ns), "type": kind, "points": points, "outline_colors": [],
            "outline_color": colour([1.0, 0.6, 0.0, 1.0]), "fill_color": colour([1.0, 0.6, 0.0, 1.0]),
            "thickness": thickness, "metadata": [],
        })
    };
    json!({ "circles": [], "points": [drawn(1, 4.0), drawn(3, 1.0)], "texts": [] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_left_out() {
        let mut report = JointReport::default();
        report.q[2] = f64::NAN;
        report.q[3] = 0.123_456_789;
        let message = measured(1_500_000_000, &report);
        assert_eq!(message["timestamp"]["nsec"], 500_000_000);
        assert!(message["joints"][2].get("position").is_none());
        assert_eq!(message["joints"][3]["position"], 0.123_456_8);
        let resting = CycleRecord {
            trajectory_s: -1.0,
            ..CycleRecord::default()
        };
        assert!(cycle(0, &resting).get("trajectory_s").is_none());
    }

    #[test]
    fn a_lost_rope_has_no_points() {
        let mut frame = KeypointFrame {
            count: 2,
            points_px: [[3.0, 4.0]; 32],
            ..KeypointFrame::default()
        };
        let points = |frame: &KeypointFrame| keypoints(0, frame)["points"][0]["points"].clone();
        assert_eq!(
            points(&frame),
            json!([{ "x": 3.5, "y": 4.5 }, { "x": 3.5, "y": 4.5 }])
        );
        frame.lost = 1;
        assert_eq!(points(&frame), json!([]));
    }
}
