//! Fields that messages share.

use serde_json::{Value, json};

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
