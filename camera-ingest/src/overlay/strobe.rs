//! The picture of a throw: many exposures over one still scene.

use super::{OverlayError, Picture};
use crate::frame::{ImageFrame, rgb_from_ycc};
use crate::track::uncovered_scene;

/// Frames that the still scene is made from.
const SCENE_FRAMES: usize = 61;
/// Mean difference from the scene up to which nothing moved, and from which on something did
/// (grey levels).
const STILL: f32 = 12.0;
const MOVED: f32 = 30.0;
/// Opacity of the exposures before the last.
const TRAIL: f32 = 0.5;

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

/// Strobe picture: over the still scene `background`, the exposures in order of time, each
/// with what moved in it.
///
/// Exposures before the last are half transparent, so that an arm that hardly moves is a
/// soft trail behind the last one and hides nothing that comes after it.
///
/// # Errors
/// No frames, or sizes differ.
pub fn strobe(background: &ImageFrame, frames: &[&ImageFrame]) -> Result<Picture, OverlayError> {
    let Some(last) = frames.len().checked_sub(1) else {
        return Err(OverlayError::Input("no frames for a strobe picture"));
    };
    if frames
        .iter()
        .any(|f| f.luma.len() != background.luma.len() || f.width_px != background.width_px)
    {
        return Err(OverlayError::Input("the frames differ in size"));
    }
    let mut picture = Picture::of(background);
    for (i, frame) in frames.iter().enumerate() {
        let opacity = if i == last { 1.0 } else { TRAIL };
        let moved = moved(background, frame);
        for (at, share) in moved.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (u, v) = (at % background.width_px, at / background.width_px);
            let colour = rgb_from_ycc(frame.ycc(u, v).map(f32::from));
            for (under, over) in picture.rgb[3 * at..3 * at + 3].iter_mut().zip(colour) {
                let mixed =
                    f32::from(*under) + opacity * share * (f32::from(over) - f32::from(*under));
                *under = mixed.round() as u8;
            }
        }
    }
    Ok(picture)
}

/// How much each pixel shows something that moved, 0 to 1: the difference from the scene,
/// averaged over its neighbours, so that single noisy pixels neither appear nor are missing.
fn moved(background: &ImageFrame, frame: &ImageFrame) -> Vec<f32> {
    let (width, height) = (frame.width_px, frame.height_px);
    let far: Vec<u32> = (0..width * height)
        .map(|at| (at % width, at / width))
        .map(|(u, v)| apart(frame.ycc(u, v), background.ycc(u, v)))
        .collect();
    let near = |at: usize, side: usize| at.saturating_sub(1)..(at + 2).min(side);
    let mean = |u: usize, v: usize| {
        let rows = near(v, height).flat_map(|v| near(u, width).map(move |u| v * width + u));
        let (sum, count) = rows.fold((0, 0), |(sum, count), at| (sum + far[at], count + 1));
        sum as f32 / count as f32
    };
    (0..width * height)
        .map(|at| ((mean(at % width, at / width) - STILL) / (MOVED - STILL)).clamp(0.0, 1.0))
        .collect()
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
    fn the_last_exposure_covers_those_before_it_and_they_are_half_transparent() {
        let background = bar(0, 0, 0);
        let [a, b] = [bar(4, 6, 200), bar(16, 6, 220)];
        let picture = strobe(&background, &[&a, &b]).unwrap();
        let at = |u: usize| picture.rgb[(4 * 32 + u) * 3];
        assert_eq!([at(1), at(6), at(18), at(28)], [100, 150, 220, 100]);
        let reversed = strobe(&background, &[&b, &a]).unwrap();
        assert_eq!(reversed.rgb[(4 * 32 + 6) * 3], 200);
        // What stays for many exposures is as opaque as the arm that it is.
        let resting = strobe(&background, &[&a, &a, &a, &a, &b]).unwrap();
        assert!(resting.rgb[(4 * 32 + 6) * 3] > 190);
        assert!(strobe(&background, &[]).is_err());
        assert!(still_scene(&[]).is_err());
    }

    #[test]
    fn single_noisy_pixels_neither_appear_nor_are_missing() {
        let background = bar(0, 0, 0);
        let mut frame = bar(10, 8, 180);
        frame.luma[4 * 32 + 2] = 180;
        // One inside the bar looks like the scene by chance.
        frame.luma[4 * 32 + 14] = 100;
        frame.luma[4 * 32 + 15] = 110;
        let picture = strobe(&background, &[&frame]).unwrap();
        let at = |u: usize| picture.rgb[(4 * 32 + u) * 3];
        assert_eq!((at(14), at(15)), (100, 110), "shown as they are");
        assert_eq!(at(2), 100, "a pixel alone is noise");
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
