//! The left eye of a frame as a JPEG, and where a rope is in it.

use anyhow::ensure;
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
    /// The JPEG.
    pub bytes: Arc<[u8]>,
}

/// The left eye of a side-by-side frame as a JPEG.
///
/// # Errors
/// Size and bytes do not fit, or the picture is too large for a JPEG.
pub(crate) fn encode(pixels: &[u8], head: FrameHeader) -> anyhow::Result<Jpeg> {
    let size = [head.width_px as usize, head.height_px as usize];
    let scale = (size[0] / 2).div_ceil(WIDTH_MAX_PX).max(1);
    let [width, height] = [size[0] / 2, size[1]].map(|px| px.div_ceil(scale));
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_2_1);
    encoder.encode(
        &left_eye(pixels, size, scale)?,
        u16::try_from(width)?,
        u16::try_from(height)?,
        jpeg_encoder::ColorType::Ycbcr,
    )?;
    Ok(Jpeg {
        stamp_ns: head.stamp_ns,
        scale,
        bytes: bytes.into(),
    })
}

/// Left eye of a side-by-side YUYV frame as packed YCbCr, which a JPEG holds anyway:
/// of every `scale` pixels and rows the first.
fn left_eye(pixels: &[u8], [width, height]: [usize; 2], scale: usize) -> anyhow::Result<Vec<u8>> {
    ensure!(
        width > 0 && height > 0 && width % 4 == 0 && pixels.len() == width * height * 2,
        "a frame of {width}x{height} has {} bytes",
        pixels.len()
    );
    let mut out = Vec::with_capacity((width / 2 / scale + 1) * (height / scale + 1) * 3);
    for row in pixels.chunks_exact(width * 2).step_by(scale) {
        for u in (0..width / 2).step_by(scale) {
            let quad = &row[u / 2 * 4..][..4];
            out.extend_from_slice(&[quad[u % 2 * 2], quad[1], quad[3]]);
        }
    }
    Ok(out)
}

/// Nodes of a rope as the left eye sees them; those it does not see are left out.
pub(crate) fn projected(camera: &StereoCamera, rope: &[nalgebra::Vector3<f64>]) -> Vec<[i32; 2]> {
    rope.iter()
        .filter_map(|node| camera.project_left(node))
        .filter(|pixel| camera.contains(*pixel))
        .map(|pixel| pixel.map(|x| x.round() as i32))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_left_eye_is_cut_out_pixel_by_pixel() {
        // Two rows of eight pixels: luma counts, chroma tells the eye.
        let pair = |y: u8, eye: u8| [y, 100 + eye, y + 1, 200 + eye];
        let row = |y: u8| [pair(y, 0), pair(y + 2, 0), pair(y + 4, 1), pair(y + 6, 1)].concat();
        let frame = [row(0), row(10)].concat();
        let pixel = |y: u8| [y, 100, 200];
        let whole = [0, 1, 2, 3, 10, 11, 12, 13].map(pixel).concat();
        assert_eq!(left_eye(&frame, [8, 2], 1).unwrap(), whole);
        assert_eq!(
            left_eye(&frame, [8, 2], 2).unwrap(),
            [0, 2].map(pixel).concat()
        );
        assert!(left_eye(&frame[1..], [8, 2], 1).is_err());
    }
}
