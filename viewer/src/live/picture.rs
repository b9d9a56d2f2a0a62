//! The left eye of a frame as a JPEG, and where a rope is in it.

use shared_types::StereoCamera;
use shared_types::ipc::FrameHeader;
use std::sync::Arc;

/// Widest picture; larger ones are made smaller (pixels).
const WIDTH_MAX_PX: usize = 960;
const QUALITY: u8 = 70;

/// A left eye.
#[derive(Debug, Clone)]
pub(crate) struct Jpeg {
    /// Start of exposure of the frame (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Pixels of the camera for one of the picture.
    pub scale: usize,
    pub bytes: Arc<[u8]>,
}

/// The left eye of a side-by-side frame as a JPEG.
///
/// # Errors
/// Size and bytes do not fit, or the picture is too large for a JPEG.
pub(crate) fn encode(pixels: &[u8], head: FrameHeader) -> anyhow::Result<Jpeg> {
    let scale = (head.width_px as usize / 2).div_ceil(WIDTH_MAX_PX).max(1);
    Ok(Jpeg {
        stamp_ns: head.stamp_ns,
        scale,
        bytes: run_log::left_jpeg(&head, pixels, scale, QUALITY)?.into(),
    })
}

/// Nodes of a rope as the left eye sees them; those it does not see are left out.
pub(crate) fn projected(camera: &StereoCamera, rope: &[nalgebra::Vector3<f64>]) -> Vec<[i32; 2]> {
    rope.iter()
        .filter_map(|node| camera.project_left(node))
        .filter(|pixel| camera.contains(*pixel))
        .map(|pixel| pixel.map(|x| x.round() as i32))
        .collect()
}
