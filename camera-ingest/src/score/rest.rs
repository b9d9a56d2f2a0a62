//! Where the tip goes in a throw after which it comes to rest, and whether a domino stands.
//!
//! A tip that lies still for most of the film would be taken for the scene behind it: the scene
//! is what the film's first frames show, in which the rope still hangs. The domino is known by
//! its pixels there: as long as it stands, they keep its colour. It has fallen where they have
//! lost it and others beside them have it instead: one that something covers is not fallen. As a
//! lead may come to lie on what it felled, that is asked all through the film, and the last frames
//! that show it decide; but one that was last seen standing, and not at the end, may have fallen.

use super::blob::{chroma_of_rgb, coverage};
use super::path::{LocalPath, mark_small};
use super::scene::{Scene, blob_error, read_sized};
use super::{MIN_DETECTIONS, ScoreError, check_colour};
use crate::frame::ImageFrame;
use crate::source::StereoSource;
use nalgebra::Vector3;
use shared_types::ipc::message::{DominoLook, SeenThrow};
use shared_types::{MonotonicNs, StereoCamera};
use std::collections::VecDeque;

/// Frames before the throw moves anything.
const FIRST_FRAMES: usize = 9;
/// Frames in whose median the domino is looked for, and from one look to the next.
const DOMINO_FRAMES: usize = 15;
const DOMINO_EVERY: usize = 5;
/// Around the domino's projection: what a calibration is off by, and more (px).
const WINDOW_PX: f64 = 22.0;
/// Coverage from which a sample shows the domino where it stands: of one that is seen edge-on no
/// sample shows more than a part, and a board of wood is faintly orange itself.
const COVERED: f64 = 0.25;
/// Least increase of a sample's coverage that is not noise: a domino that lies flat is hardly
/// thicker than a pixel.
const INCREASE: f64 = 0.15;
/// Area of a visible domino, both images together (samples).
const MIN_AREA: f64 = 3.0;
/// Part of its area that keeps its colour as long as it stands.
const STANDS: f64 = 0.5;
/// Part of its area that has left the place of one that has fallen altogether.
const LEFT: f64 = 0.85;
/// New area beside its place, as a part of what it had, that shows that it lies there.
const LIES: f64 = 0.25;
/// The same where it has left its place altogether: the lead may lie on it and hide the rest.
const LIES_HIDDEN: f64 = 0.08;
/// Least new area (samples).
const MIN_NEW_AREA: f64 = 1.0;

/// Looks for tip and domino in all frames to the end of the span, which begins with the throw
/// (CLOCK_MONOTONIC, ns): what comes later, somebody who clears up say, is not the throw's.
///
/// # Errors
/// Unreadable frames, colours without chroma, or a tip that is not seen.
pub fn look(
    source: &mut dyn StereoSource,
    camera: &StereoCamera,
    tip_rgb: [u8; 3],
    domino: Option<&DominoLook>,
    [from_ns, to_ns]: [u64; 2],
) -> Result<SeenThrow, ScoreError> {
    let frames = frames_until(source, to_ns)?;
    if frames < FIRST_FRAMES + DOMINO_FRAMES {
        return Err(ScoreError::Input(format!(
            "the film has {frames} frames, at least {} are needed",
            FIRST_FRAMES + DOMINO_FRAMES
        )));
    }
    check_colour("tip", tip_rgb)?;
    // A grey one is not seen.
    let domino = domino.filter(|domino| check_colour("domino", domino.rgb).is_ok());
    let first: Vec<usize> = (0..FIRST_FRAMES).collect();
    let scene = Scene::of_frames(source, camera, &first)?;
    let (mut detections, mut end_s) = (Vec::new(), 0.0);
    let (mut shown, mut fell, mut before) = (VecDeque::new(), None, None);
    for index in 0..frames {
        let frame = read_sized(source, index, camera)?;
        let since_s = MonotonicNs(frame.0.stamp_ns).since_s(MonotonicNs(from_ns));
        end_s = since_s;
        let near = detections.last().copied();
        let images = [frame.left(), frame.right()];
        let both = [&images[0], &images[1]];
        detections.extend(scene.tip(both, tip_rgb, None, near, since_s));
        let Some(domino) = domino else { continue };
        shown.push_back(images);
        if shown.len() > DOMINO_FRAMES {
            shown.pop_front();
        }
        // The last look ends with the film.
        if shown.len() == DOMINO_FRAMES && (frames - 1 - index).is_multiple_of(DOMINO_EVERY) {
            let now = has_fallen(&scene, camera, domino, &shown);
            // One look alone may be of something else that passes.
            let sure = now.filter(|fell| !fell || before == now);
            fell = sure.or(fell.filter(|fell| *fell));
            before = now;
        }
    }
    if detections.len() < MIN_DETECTIONS {
        return Err(ScoreError::NotSeen {
            what: "tip",
            seen: detections.len(),
            least: MIN_DETECTIONS,
        });
    }
    mark_small(&mut detections);
    let to_world = |p: Vector3<f64>| camera.p_w_cam_m + camera.r_w_cam * p;
    let paths = (0..detections.len())
        .filter_map(|index| LocalPath::around(&detections, index, blob_error(camera)));
    let tip = paths.map(|path| (path.t_s, to_world(path.at(path.t_s)).into()));
    Ok(SeenThrow {
        end_s,
        tip: tip.collect(),
        domino_down: fell,
        ..SeenThrow::default()
    })
}

/// How many frames were taken until an instant.
fn frames_until(source: &mut dyn StereoSource, to_ns: u64) -> Result<usize, ScoreError> {
    let (mut least, mut most) = (0, source.len());
    while least < most {
        let middle = usize::midpoint(least, most);
        if source.read(middle)?.0.stamp_ns <= to_ns {
            least = middle + 1;
        } else {
            most = middle;
        }
    }
    Ok(least)
}

/// Whether the domino lies; `None` where it was not seen at first, or is covered.
fn has_fallen(
    scene: &Scene<'_>,
    camera: &StereoCamera,
    domino: &DominoLook,
    shown: &VecDeque<[ImageFrame; 2]>,
) -> Option<bool> {
    let wanted = chroma_of_rgb(domino.rgb);
    let (mut seen, mut kept, mut beside) = (0.0, 0.0, 0.0);
    for (k, image) in scene.images.iter().enumerate() {
        let covered = |cb: u8, cr: u8| {
            let sample = [cb, cr].map(|c| f64::from(c) - 128.0);
            coverage(sample, scene.middles[k], wanted)
        };
        let median = |plane: fn(&ImageFrame) -> &[u8], at: usize| {
            let mut values: Vec<u8> = shown.iter().map(|images| plane(&images[k])[at]).collect();
            let middle = values.len() / 2;
            *values.select_nth_unstable(middle).1
        };
        for at in window(camera, k, domino, image)? {
            let before = covered(image.cb[at], image.cr[at]);
            let now = covered(median(|f| &f.cb, at), median(|f| &f.cr, at));
            if before > COVERED {
                seen += before;
                kept += before.min(now);
            } else if now - before > INCREASE {
                beside += now - before;
            }
        }
    }
    if seen < MIN_AREA {
        return None;
    }
    let has_left = kept < (1.0 - LEFT) * seen;
    let lies = seen * if has_left { LIES_HIDDEN } else { LIES };
    match kept >= STANDS * seen {
        true => Some(false),
        false => (beside >= lies.max(MIN_NEW_AREA)).then_some(true),
    }
}

/// Chroma samples around the domino in one image; `None` where it is out of view.
fn window(
    camera: &StereoCamera,
    eye: usize,
    domino: &DominoLook,
    image: &ImageFrame,
) -> Option<Vec<usize>> {
    let foot = Vector3::from(domino.foot_m);
    let top = foot + Vector3::z() * domino.height_m;
    let project = |p: &Vector3<f64>| match eye {
        0 => camera.project_left(p),
        _ => camera.project_right(p),
    };
    let (foot, top) = (project(&foot)?, project(&top)?);
    let range = |low: f64, high: f64, size: usize| {
        let from = (low.min(high) - WINDOW_PX).max(0.0) as usize;
        from..((low.max(high) + WINDOW_PX).max(0.0) as usize).min(size)
    };
    let (columns, rows) = (
        range(foot[0], top[0], image.width_px),
        range(foot[1], top[1], image.height_px),
    );
    let per_row = image.width_px / 2;
    let columns = columns.start / 2..columns.end / 2;
    Some(
        rows.flat_map(|v| columns.clone().map(move |u| v * per_row + u))
            .collect(),
    )
}
