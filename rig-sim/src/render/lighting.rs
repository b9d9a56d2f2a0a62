//! Where the light on moving things comes from, as one eye sees it.

/// Light from everywhere and from one lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lighting {
    /// Towards the lamp, in the picture: right, down, towards the camera.
    pub(crate) towards: [f32; 3],
    /// Halfway between lamp and camera.
    pub(crate) halfway: [f32; 3],
    /// Light from everywhere, relative to a surface's colour.
    pub(crate) ambient: f32,
    /// Light from the lamp on a surface that faces it.
    pub(crate) lamp: f32,
}

impl Lighting {
    /// The soft light of the plain room.
    pub(crate) const PLAIN: Self = Self {
        towards: [-0.42, -0.70, 0.58],
        halfway: [-0.236, -0.394, 0.888],
        ambient: 0.50,
        lamp: 0.58,
    };

    /// Light from a lamp in a direction of the picture (right, down, towards the camera).
    pub(crate) fn from(towards: [f32; 3], ambient: f32, lamp: f32) -> Self {
        let unit = |v: [f32; 3]| {
            let norm = v.iter().map(|c| c * c).sum::<f32>().sqrt().max(1e-6);
            v.map(|c| c / norm)
        };
        let towards = unit(towards);
        Self {
            towards,
            halfway: unit([towards[0], towards[1], towards[2] + 1.0]),
            ambient,
            lamp,
        }
    }
}
