//! Films as files: Motion-JPEG in an AVI, for any player and for [`crate::open_video`].

use shared_types::KeypointTrack;

use crate::frame::ImageFrame;
use crate::overlay::{OverlayError, drawn};

/// JPEG quality: the lines stay sharp.
const QUALITY: u8 = 85;

/// The left image with the keypoints drawn in, frame by frame, as an AVI file's
/// bytes. It plays at the mean rate of the frames.
///
/// # Errors
/// No frames, or frames too large for a JPEG.
pub fn keypoint_film(
    frames: &[ImageFrame],
    track: &KeypointTrack,
) -> Result<Vec<u8>, OverlayError> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
        return Err(OverlayError::Input("no frames for a film"));
    };
    let steps = (frames.len() as u64 - 1).max(1);
    let frame_us = (last.stamp_ns.saturating_sub(first.stamp_ns) / steps / 1000).max(1);
    let large = OverlayError::Input("the frames are too large for a film");
    let (Ok(width), Ok(height), Ok(frame_us)) = (
        u16::try_from(first.width_px),
        u16::try_from(first.height_px),
        u32::try_from(frame_us),
    ) else {
        return Err(large);
    };
    let size_px = [width, height];
    let jpeg = |(frame, tracked)| {
        let rgb = drawn(frame, tracked).rgb;
        encoded(&rgb, size_px, QUALITY, jpeg_encoder::ColorType::Rgb)
    };
    let jpegs = frames.iter().zip(&track.frames).map(jpeg);
    avi(&jpegs.collect::<Result<Vec<_>, _>>()?, size_px, frame_us).ok_or(large)
}

fn encoded(
    pixels: &[u8],
    [width, height]: [u16; 2],
    quality: u8,
    colours: jpeg_encoder::ColorType,
) -> Result<Vec<u8>, OverlayError> {
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_2_1);
    encoder
        .encode(pixels, width, height, colours)
        .map_err(|_e| OverlayError::Input("frames of a film must have one size"))?;
    Ok(bytes)
}

/// A frame of packed YUYV, `size_px` wide and high, as a JPEG of a quality from 1 to 100.
///
/// # Errors
/// The bytes are not those of a frame of this size.
pub fn jpeg_of_yuyv(yuyv: &[u8], size_px: [u16; 2], quality: u8) -> Result<Vec<u8>, OverlayError> {
    let pairs = yuyv.as_chunks::<4>().0.iter();
    let pixels: Vec<u8> = pairs
        .flat_map(|[y0, cb, y1, cr]| [*y0, *cb, *cr, *y1, *cb, *cr])
        .collect();
    encoded(&pixels, size_px, quality, jpeg_encoder::ColorType::Ycbcr)
}

/// JPEGs of one size as an AVI file's bytes, `frame_us` apart.
///
/// # Errors
/// No frames, or more than a file holds.
pub fn film(jpegs: &[Vec<u8>], size_px: [u16; 2], frame_us: u32) -> Result<Vec<u8>, OverlayError> {
    avi(jpegs, size_px, frame_us).ok_or(OverlayError::Input("no frames, or too many for a film"))
}

/// A chunk: code, length, body, padding to an even length. `None` beyond 4 GiB.
fn chunk(code: &[u8; 4], body: &[u8]) -> Option<Vec<u8>> {
    let size = u32::try_from(body.len()).ok()?;
    let mut out = [&code[..], &size.to_le_bytes(), body].concat();
    out.resize(out.len() + body.len() % 2, 0);
    Some(out)
}

fn list(kind: &[u8; 4], body: &[u8]) -> Option<Vec<u8>> {
    chunk(b"LIST", &[&kind[..], body].concat())
}

/// One video stream of JPEGs with its index.
fn avi(jpegs: &[Vec<u8>], [width, height]: [u16; 2], frame_us: u32) -> Option<Vec<u8>> {
    let count = u32::try_from(jpegs.len()).ok()?;
    let largest = u32::try_from(jpegs.iter().map(Vec::len).max()?).ok()?;
    let (width, height) = (u32::from(width), u32::from(height));
    let words = |words: &[u32]| -> Vec<u8> { words.iter().flat_map(|w| w.to_le_bytes()).collect() };
    /// The file has an index.
    const HAS_INDEX: u32 = 0x10;
    let avih = words(&[
        frame_us, 0, 0, HAS_INDEX, count, 0, 1, largest, width, height, 0, 0, 0, 0,
    ]);
    let stream = [
        &b"vidsMJPG"[..],
        // Flags, priority, start-up delay; then the rate as a fraction.
        &words(&[0, 0, 0, frame_us, 1_000_000]),
        &words(&[0, count, largest, u32::MAX, 0, 0]),
        // The picture's rectangle, 16 bits a side; cut below the limits of JPEG.
        &words(&[width | height << 16]),
    ]
    .concat();
    let format = [
        &words(&[40, width, height, 1 | 24 << 16])[..],
        b"MJPG",
        &words(&[width * height * 3, 0, 0, 0, 0]),
    ]
    .concat();
    let strl = [chunk(b"strh", &stream)?, chunk(b"strf", &format)?].concat();
    let hdrl = [chunk(b"avih", &avih)?, list(b"strl", &strl)?].concat();
    let (mut movi, mut index) = (Vec::new(), Vec::new());
    /// Every frame stands for itself.
    const KEY_FRAME: u32 = 0x10;
    for jpeg in jpegs {
        // Places are counted from the list's name.
        let at = u32::try_from(movi.len() + 4).ok()?;
        index.extend_from_slice(b"00dc");
        index.extend(words(&[KEY_FRAME, at, u32::try_from(jpeg.len()).ok()?]));
        movi.extend(chunk(b"00dc", jpeg)?);
    }
    let body = [
        &b"AVI "[..],
        &list(b"hdrl", &hdrl)?,
        &list(b"movi", &movi)?,
        &chunk(b"idx1", &index)?,
    ]
    .concat();
    chunk(b"RIFF", &body)
}
