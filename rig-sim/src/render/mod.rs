//! What a stereo camera sees of the rig: a small software renderer.
//!
//! The room that never moves (`backdrop`) is drawn once per eye by casting
//! rays through the distorted pixels. Arm, rope and target are drawn anew in
//! each frame as shaded capsules whose ends go through the full camera model,
//! so no picture is ever warped. Edges have the exact coverage of a straight
//! edge, motion blur is the mean of sub-frames over the exposure, and the sensor
//! adds vignetting and noise. Cost follows the pixels that change.
//!
//! Simplified: spheres project as circles (true within 0.4 px), no cast shadows
//! of moving things, blur averaged in video levels. With a rolling shutter a row shows the
//! sub-frames of its own exposure.

mod appearance;
mod backdrop;
mod bodies;
mod colour;
mod eye;
mod layer;
mod scene;
mod sensor;
mod shutter;
mod stroke;
mod texture;

pub use appearance::Appearance;
pub use bodies::{RopeShape, ScenePose};
pub use eye::Eye;
pub use scene::Renderer;
