//! The picture of a throw: many exposures over one still scene.

use super::{OverlayError, Picture};
use crate::frame::{ImageFrame, rgb_from_ycc};
use crate::track::uncovered_scene;

/// Frames that the still scene is made from.
const SCENE_FRAMES: usize = 61;
/// Colours that differ by more than this are of another thing (grey levels).
const OTHER: u32 = 30;

fn apart(a: [u8; 3], b: [u8; 3]) -> u32 {
    (0..3).map(|k| u32::from(a[k].abs_diff(b[k]))).sum()
}

/// The still scene behind what moves.
///
/// Of frames equally far apart in motion, so that what rests for long counts no more than
/// what moves; where a wide thing like an arm covers a pixel most of the time all the
/// same, the scene continues from its neighbourhood.
///
/// # Errors
/// No frames, or sizes differ.
pub fn still_scene(frames: &[ImageFrame]) -> Result<ImageFrame, OverlayError> {
    let first = frames
        .first()
        .ok_or(OverlayError::Input("no frames for a still scene"))?;
    let size = |f: &ImageFrame| (f.width_px, f.height_px);
    if frames.iter().any(|f| size(f) != size(first)) {
        return Err(OverlayError::Input("the frames differ in size"));
    }
    Ok(uncovered_scene(frames, SCENE_FRAMES))
}

/// Strobe picture: over the still scene `background`, every pixel shows the chosen frame
/// that differs most from it there.
///
/// # Errors
/// No frames, or sizes differ.
pub fn strobe(background: &ImageFrame, frames: &[&ImageFrame]) -> Result<Picture, OverlayError> {
    if frames.is_empty() {
        return Err(OverlayError::Input("no frames for a strobe picture"));
    }
    if frames
        .iter()
        .any(|f| f.luma.len() != background.luma.len() || f.width_px != background.width_px)
    {
        return Err(OverlayError::Input("the frames differ in size"));
    }
    let mut picture = Picture::of(background);
    for v in 0..background.height_px {
        for u in 0..background.width_px {
            let empty = background.ycc(u, v);
            let far = |f: &&&ImageFrame| apart(f.ycc(u, v), empty);
            // A threshold keeps the noise of many frames out of still places.
            if let Some(best) = frames.iter().max_by_key(far)
                && far(&best) > OTHER
            {
                let rgb = rgb_from_ycc(best.ycc(u, v).map(f32::from));
                let at = (v * background.width_px + u) * 3;
                picture.rgb[at..at + 3].copy_from_slice(&rgb);
            }
        }
    }
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of grey 100, and on it a bar from column `from` on, `wide` columns wide.
    fn bar(from: usize, wide: usize, level: u8) -> ImageFrame {
        let mut frame = ImageFrame::grey([32, 8], 100);
        for row in frame.luma.chunks_mut(32) {
            row[from..(from + wide).min(32)].fill(level);
        }
        frame
    }

    #[test]
    fn strobe_keeps_the_pixel_that_differs_most() {
        let background = bar(0, 0, 0);
        let (mut a, mut b) = (background.clone(), background.clone());
        a.luma[9] = 200;
        b.luma[9] = 150;
        b.luma[20] = 10;
        let picture = strobe(&background, &[&a, &b]).unwrap();
        assert_eq!(picture.rgb[27], 200);
        assert_eq!(picture.rgb[60], 10);
        assert_eq!(picture.rgb[0], 100);
        assert!(strobe(&background, &[]).is_err());
        assert!(still_scene(&[]).is_err());
    }

    #[test]
    fn what_rests_for_most_of_a_film_is_not_the_scene() {
        // A bar rests for 60 frames of 76, then moves on by a column a frame.
        let at = |i: usize| i.saturating_sub(60);
        let frames: Vec<_> = (0..76).map(|i| bar(at(i), 8, 220)).collect();
        let scene = still_scene(&frames).unwrap();
        assert_eq!(scene.luma, bar(0, 0, 0).luma);
    }

    #[test]
    fn what_covers_a_place_mostly_is_not_the_scene() {
        // 24 columns wide, moving by one a frame: column 23 is covered in 24 of 32 frames.
        let shade = |i: usize| 180 + 2 * (i as u8);
        let frames: Vec<_> = (0..32).map(|i| bar(i, 24, shade(i))).collect();
        let scene = still_scene(&frames).unwrap();
        assert_eq!(scene.luma[23], 100);
    }
}
