//! What a film tells of stiffness, damping and masses: their ratios.
//!
//! The nine parameters themselves share a factor that no film shows. A head that is
//! used in training only is asked for the logarithms of the ratios, so that the network
//! learns them as such; the nine outputs read the same layer.

use shared_types::RopeParams;

/// Number of ratios.
pub(crate) const RATIOS: usize = 3;

/// Logarithms of bending stiffness and damping over mass per length, and of lead mass
/// over rope mass, each shifted and scaled to about mean 0 and deviation 1.
#[must_use]
pub(crate) fn log_ratios(rope: &RopeParams) -> [f32; RATIOS] {
    let v = rope.to_array();
    let (link_m, mass) = (v[1] / v[0], v[5]);
    let shifted =
        |ratio: f64, (mean, deviation): (f64, f64)| ((ratio.ln() - mean) / deviation) as f32;
    [
        shifted(v[3] * link_m / mass, (-1.9, 1.0)),
        shifted(v[2] * link_m / mass, (-5.0, 1.1)),
        shifted(v[6] / mass / v[1], (0.6, 0.7)),
    ]
}
