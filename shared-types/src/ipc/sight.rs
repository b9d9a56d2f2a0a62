//! What a camera is told to look for, and what it tells of rope and throw.

use serde::{Deserialize, Serialize};

/// Apparent sizes and colours of rope and lead in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RopeAppearance {
    /// Radius of the rope (m), when it could be measured.
    pub rope_radius_m: Option<f64>,
    /// Radius of the lead (m), when it could be measured.
    pub lead_radius_m: Option<f64>,
    /// Mean colour of the rope.
    pub rope_rgb: [u8; 3],
    /// Mean colour of the lead.
    pub lead_rgb: [u8; 3],
}

/// Tip-target distance measured from stereo video.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScoreResult {
    /// Closest approach of tip centre and target centre (m).
    pub closest_m: f64,
    /// Interval that should hold the true value (m).
    pub interval_m: [f64; 2],
    /// Tip minus target at that instant, in the world (m).
    pub miss_m: [f64; 3],
    /// When it happened, relative to the first frame scored (s).
    pub time_s: f64,
    /// Target position in the world (m).
    pub target_m: [f64; 3],
}

/// A domino that stands where a throw begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DominoLook {
    /// Its colour.
    pub rgb: [u8; 3],
    /// Centre of its lower face (m, world).
    pub foot_m: [f64; 3],
    /// Its height (m).
    pub height_m: f64,
}

/// What was seen of a throw after which the rope comes to rest. Times are from its begin (s),
/// places in the world (m).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SeenThrow {
    /// When nobody looked any longer (s).
    pub end_s: f64,
    /// Centre of the tip, where it was seen.
    pub tip: Vec<(f64, [f64; 3])>,
    /// Middle of the rope; empty where it was not looked for.
    pub middle: Vec<(f64, [f64; 3])>,
    /// Whether the domino fell; `None` where it could not be seen.
    pub domino_down: Option<bool>,
    /// Whether the rope touched the first body of the scene; `None` where it could not be seen.
    pub touched: Option<bool>,
}
