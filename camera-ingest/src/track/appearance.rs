//! What the rope looks like.

/// What rope and lead look like.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeAppearance {
    /// Half the rope's apparent width (m).
    pub rope_radius_m: f64,
    /// Radius of the lead's outline (m).
    pub lead_radius_m: f64,
    /// Length from clamp to lead centre (m).
    pub length_m: f64,
    /// Median colour of the rope.
    pub rope_rgb: [u8; 3],
    /// Median colour of the lead.
    pub lead_rgb: [u8; 3],
    /// Typical distance of a still pixel from the background (grey levels).
    pub noise: f32,
}
