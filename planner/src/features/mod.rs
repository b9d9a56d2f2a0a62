//! What the network Φ-NN sees of a filmed wiggle.
//!
//! One code makes it from simulated films and from a camera's keypoints: 400
//! frames at 60 Hz of keypoints relative to the first one and of the rope's
//! segment angles (the paper's features), plus the widths of rope and lead.
//! Pixels are undistorted and cast onto the vertical plane in which the arm
//! wiggles ([`ViewPlane`]), so that neither lens nor camera placement nor a
//! rolling shutter is left in the numbers. Time counts from the beginning of the wiggle,
//! which the clamp's own way tells. What was not seen is zero and marked so.
//!
//! Channels of a frame, all finite:
//!
//! | channels | content |
//! |---|---|
//! | 0, 1 | first keypoint (clamp) relative to its mean over the film: forward, up (m) |
//! | 2 … 2K-1 | keypoint k relative to the first: forward, up (m) |
//! | 2K … 3K-2 | angle of segment k against straight down, positive forward (rad), continuous along the rope |
//! | 3K-1 | 1 if the frame was seen, else 0 and the whole frame is 0 |
//!
//! Keypoints are uniform in arc length, as a tracker gives them, or the centres of the
//! rope's links as in the paper's simulated films ([`ObservedPoints`]). Then a rope with
//! fewer links than K leaves the last keypoints and segments at 0: the link count is
//! plain to see, which no camera can do.

mod alignment;
mod definition;
mod frames;
mod plane;

pub use definition::{FeatureDefinition, ObserveError, WIDTHS, WiggleFeatures};
pub use plane::ViewPlane;

use crate::observation::{Appearance, ObservedPoints};
use frames::{channels, on_grid};
use shared_types::{KeypointTrack, StereoCamera};

/// Features of a recording of the wiggle of `plane`.
///
/// # Errors
/// Bad keypoints, a camera that looks along the plane, a clamp that moves otherwise, or
/// a rope hardly ever seen.
pub fn observe(
    definition: FeatureDefinition,
    track: &KeypointTrack,
    appearance: Appearance,
    camera: &StereoCamera,
    plane: &ViewPlane,
) -> Result<WiggleFeatures, ObserveError> {
    track.validate()?;
    let (found, most) = (track.keypoints, definition.keypoints);
    if definition.points == ObservedPoints::LinkCentres && !(2..=most).contains(&found) {
        return Err(ObserveError::new(format!(
            "{found} link centres, but 2 to {most} are expected"
        )));
    }
    let view = plane.seen_from(camera)?;
    let frames = on_grid(&definition, track, camera, &view, &plane.sway)?;
    Ok(WiggleFeatures {
        definition,
        motion: channels(&definition, &frames),
        widths: widths(appearance),
        seen: frames.iter().flatten().count(),
    })
}

fn widths(appearance: Appearance) -> [f32; WIDTHS] {
    let [rope, lead] = [appearance.rope_radius_m, appearance.lead_radius_m]
        .map(|seen| seen.map_or([0.0, 0.0], |radius_m| [radius_m as f32, 1.0]));
    [rope[0], rope[1], lead[0], lead[1]]
}

#[cfg(test)]
mod tests;
