//! What a stereo camera sees of the rig: a small software renderer.
//!
//! The room that never moves (`backdrop`) is drawn once per eye by casting
//! rays through the distorted pixels. Arm, rope and target are drawn anew in
//! each frame as shaded capsules whose ends go through the full camera model,
//! so no picture is ever warped. Edges have the exact coverage of a straight
//! edge, motion blur is the mean of sub-frames over the exposure, and the sensor
//! adds vignetting and noise. Cost follows the pixels that change.
//!
//! The plain room has no shadows of moving things. In a drawn room ([`crate::room`]) each
//! lamp has a picture of them of its own (`lamp_view`), and a pixel of the backdrop is
//! darkened by what stands between it and the lamp (`shade_map`).
//!
//! Simplified: spheres project as circles (true within 0.4 px), moving things cast no
//! shadows on each other, blur averaged in video levels. With a rolling shutter a row shows the
//! sub-frames of its own exposure.

mod appearance;
mod backdrop;
mod bodies;
mod canvas;
pub(crate) mod colour;
mod environment;
mod image_view;
mod lamp_view;
mod layer;
mod lighting;
mod scene;
mod sensor;
mod shade_map;
#[cfg(test)]
mod shadow_tests;
mod shadows;
mod shutter;
pub(crate) mod solid;
mod stroke;
mod task_bodies;
pub(crate) mod texture;
pub(crate) mod weave;

pub use appearance::Appearance;
pub(crate) use bodies::centreline;
pub use bodies::{RopeShape, ScenePose};
pub use scene::Renderer;
pub use task_bodies::TaskBodies;
