//! The picture of a throw with its times, and the strike close up.

use super::marks::text_size;
use super::{OverlayError, Picture, still_scene, strobe};
use crate::frame::ImageFrame;
use shared_types::MonotonicNs;

/// Exposures in a picture of a throw.
const EXPOSURES: usize = 14;
/// The film is shown up to this long after the strike (s).
const AFTER_S: f64 = 0.02;
/// The close-up: pixels to each side of the target as a part of the image's width, and how
/// much they are magnified.
const CLOSE_UP: (usize, usize) = (34, 4);
/// Least distance between two tips that carry a time (px).
const TIMES_APART_PX: f64 = 26.0;
/// Radius of the ring around the target (px).
const RING_PX: f64 = 9.0;
const RING: [u8; 3] = [255, 214, 0];

/// Where things were in the left image; times from the first frame's start of exposure (s).
#[derive(Debug, Clone, Default)]
pub(crate) struct Strike {
    /// The closest approach.
    pub time_s: f64,
    /// The target then.
    pub target_px: [f64; 2],
    /// The tip, where it was seen.
    pub tip_px: Vec<(f64, [f64; 2])>,
}

/// A multiple exposure of the throw up to a little after the closest approach, on the scene
/// behind what moves, with times beside the tip and the strike magnified. Without a strike, up to
/// `unseen_s` after the first frame.
///
/// # Errors
/// No frames, or sizes differ.
pub(crate) fn throw_picture(
    frames: &[ImageFrame],
    strike: Option<&Strike>,
    unseen_s: f64,
) -> Result<Picture, OverlayError> {
    // What comes after the strike shows what the arm covered before it.
    let scene = still_scene(frames)?;
    let start = MonotonicNs(frames.first().map_or(0, |f| f.stamp_ns));
    let time_s = |f: &ImageFrame| MonotonicNs(f.stamp_ns).since_s(start);
    let until_s = strike.map_or(unseen_s, |s| s.time_s + AFTER_S);
    let moving: Vec<&ImageFrame> = frames.iter().take_while(|f| time_s(f) <= until_s).collect();
    let step = moving.len().div_ceil(EXPOSURES).max(1);
    let mut exposed: Vec<&ImageFrame> = moving.into_iter().rev().step_by(step).collect();
    exposed.reverse();
    let mut picture = strobe(&scene, &exposed)?;
    let Some(strike) = strike else {
        return Ok(picture);
    };
    let corner = emptiest_corner(&picture, &Picture::of(&scene), close_up_side(&scene));
    let times: Vec<f64> = exposed.iter().map(|f| time_s(f)).collect();
    write_times(&mut picture, strike, &times);
    picture.ring(strike.target_px, RING_PX, RING);
    let nearest = |a: &&ImageFrame, b: &&ImageFrame| {
        let from_strike = |f: &ImageFrame| (time_s(f) - strike.time_s).abs();
        from_strike(a).total_cmp(&from_strike(b))
    };
    if let Some(frame) = frames.iter().min_by(nearest) {
        let [left, top] = corner;
        picture.paste(&close_up(frame, strike, time_s(frame)), left, top);
    }
    Ok(picture)
}

/// The time of every exposure beside its tip, where it does not cover the one before.
fn write_times(picture: &mut Picture, strike: &Strike, times_s: &[f64]) {
    let mut last: Option<[f64; 2]> = None;
    // From the strike backwards: it is the one that must not be left out.
    for time_s in times_s.iter().rev() {
        let nearest = |a: &&(f64, [f64; 2]), b: &&(f64, [f64; 2])| {
            (a.0 - time_s).abs().total_cmp(&(b.0 - time_s).abs())
        };
        let Some((seen_s, tip)) = strike.tip_px.iter().min_by(nearest) else {
            return;
        };
        let is_near = |q: [f64; 2]| (tip[0] - q[0]).hypot(tip[1] - q[1]) < TIMES_APART_PX;
        if (seen_s - time_s).abs() > 0.01 || last.is_some_and(is_near) {
            continue;
        }
        last = Some(*tip);
        let right = [tip[0] as i64 + 12, tip[1] as i64 - 3];
        picture.text(right, &format!("{time_s:.2} s"), 1);
    }
}

fn close_up_side(frame: &ImageFrame) -> usize {
    2 * (frame.width_px / CLOSE_UP.0) * CLOSE_UP.1
}

/// The target in the frame of the strike, magnified, its middle marked.
fn close_up(frame: &ImageFrame, strike: &Strike, time_s: f64) -> Picture {
    let (half_px, factor) = (frame.width_px / CLOSE_UP.0, CLOSE_UP.1);
    let mut large = Picture::of(frame).magnified(strike.target_px, half_px, factor);
    // The tip may cover the target: its middle is marked.
    let middle = (half_px * factor) as f64;
    large.ring([middle, middle], 3.0, RING);
    let time = format!("{time_s:.2} s");
    let [_, height] = text_size(&time, 2);
    let below = large.height_px as i64 - height - 2;
    large.text([2, below], &time, 2);
    large.border(2, RING);
    large
}

/// The corner (left, top) with room for a square in which the least has moved.
fn emptiest_corner(picture: &Picture, scene: &Picture, side: usize) -> [usize; 2] {
    let (right, bottom) = (
        picture.width_px.saturating_sub(side),
        picture.height_px.saturating_sub(side),
    );
    let changed = |[left, top]: &[usize; 2]| {
        let rows = *top..(top + side).min(picture.height_px);
        rows.flat_map(|v| (*left..(left + side).min(picture.width_px)).map(move |u| (u, v)))
            .map(|(u, v)| (v * picture.width_px + u) * 3)
            .filter(|at| picture.rgb[*at..at + 3] != scene.rgb[*at..at + 3])
            .count()
    };
    [[right, 0], [0, 0], [right, bottom], [0, bottom]]
        .into_iter()
        .min_by_key(changed)
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of grey 100 with a tip of 240 at a column, filmed at 50 Hz.
    fn frame(i: usize) -> ImageFrame {
        let mut frame = ImageFrame::grey([340, 170], 100);
        frame.stamp_ns = 1_000_000_000 + 20_000_000 * i as u64;
        for v in 120..128 {
            frame.luma[v * 340 + 40 + 3 * i..][..8].fill(240);
        }
        frame
    }

    #[test]
    fn the_strike_is_magnified_where_nothing_moved_and_the_target_is_ringed() {
        let frames: Vec<ImageFrame> = (0..60).map(frame).collect();
        let tip = |i: usize| (0.02 * i as f64, [44.0 + 3.0 * i as f64, 124.0]);
        let strike = Strike {
            time_s: 0.8,
            target_px: [164.0, 124.0],
            tip_px: (0..60).map(tip).collect(),
        };
        let picture = throw_picture(&frames, Some(&strike), 1.0).unwrap();
        let ringed = picture.rgb.chunks(3).filter(|p| *p == RING).count();
        let border = 4 * 2 * 80 - 16;
        assert!(ringed > border + 40 && ringed < border + 100, "{ringed}");
        // Upper right: 80 pixels of the 20 around the target, where the tip is then.
        let at = |u: usize, v: usize| picture.rgb[(v * 340 + u) * 3];
        assert_eq!((at(308, 40), at(340 - 80 + 10, 10)), (240, 100));
        // Nothing after the strike is exposed.
        assert_eq!(at(40 + 3 * 57, 124), 100);
        assert!(throw_picture(&frames, None, 1.0).is_ok());
        assert!(throw_picture(&[], None, 1.0).is_err());
    }
}
