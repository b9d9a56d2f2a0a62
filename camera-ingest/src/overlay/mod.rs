//! Pictures for people: keypoints over frames, and the strobe picture of a throw.

mod marks;
mod picture;
mod strobe;
mod throw;

pub use picture::Picture;
pub use strobe::{still_scene, strobe};
pub(crate) use throw::{Strike, throw_picture};

use std::path::PathBuf;

use shared_types::KeypointTrack;
use shared_types::keypoints::TrackedFrame;

use crate::frame::ImageFrame;

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OverlayError {
    /// The file cannot be written.
    #[error("picture {path}: {reason}")]
    Write {
        /// File concerned.
        path: PathBuf,
        /// What failed.
        reason: String,
    },
    /// Nothing to draw, or frames of different sizes.
    #[error("picture: {0}")]
    Input(&'static str),
}

/// Sides of a picture in a contact sheet (px): a dozen stay around a megabyte.
const SIDE_MIN_PX: usize = 200;
const SIDE_MAX_PX: usize = 340;
/// The part of an image that is shown is so many times as large as where the keypoints are.
const ROOM: f64 = 1.4;
/// Radius of a keypoint's dot, and least distance between two dots (px).
const DOT_PX: f64 = 2.6;
const DOTS_APART_PX: f64 = 9.0;
/// Colours of keypoints, and of keypoints where the rope is lost.
const FOUND: [u8; 3] = [0, 255, 255];
const LOST: [u8; 3] = [255, 0, 0];

/// A frame with its keypoints, red where the rope is lost.
pub(crate) fn drawn(frame: &ImageFrame, tracked: &TrackedFrame) -> Picture {
    let mut picture = Picture::of(frame);
    draw_rope(&mut picture, tracked, &|p| p);
    picture
}

/// Hollow dots with gaps between them, so that the rope that they are to lie on stays
/// visible; `place` turns pixels of the camera into those of the picture.
fn draw_rope(picture: &mut Picture, tracked: &TrackedFrame, place: &dyn Fn([f64; 2]) -> [f64; 2]) {
    let colour = if tracked.lost { LOST } else { FOUND };
    let mut last: Option<[f64; 2]> = None;
    let count = tracked.points.len();
    for (i, p) in tracked.points.iter().enumerate() {
        let p = place(*p);
        let is_end = i == 0 || i + 1 == count;
        let apart = |q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        if is_end || last.is_none_or(|q| apart(q) >= DOTS_APART_PX) {
            picture.ring(p, DOT_PX, colour);
            last = Some(p);
        }
    }
}

/// Contact sheet of frames all through a film, each with its keypoints and its time: the
/// part of the image in which the rope moves, the same in all of them.
///
/// # Errors
/// There is no frame.
pub fn keypoint_sheet(
    frames: &[ImageFrame],
    track: &KeypointTrack,
) -> Result<Picture, OverlayError> {
    /// Pictures in the sheet, and how many stand in a row.
    const SHEET: (usize, usize) = (12, 4);
    let (pictures, columns) = SHEET;
    let step = frames.len().div_ceil(pictures).max(1);
    let tracked = frames.iter().zip(&track.frames);
    let shown: Vec<(&ImageFrame, &TrackedFrame)> = tracked.step_by(step).collect();
    let points = shown.iter().flat_map(|(_, tracked)| &tracked.points);
    let Some((first, _)) = shown.first() else {
        return contact_sheet(&[], columns);
    };
    let part = Part::around(points, [first.width_px, first.height_px]);
    let picture = |(frame, tracked): &(&ImageFrame, &TrackedFrame)| {
        let mut picture = part.of(&Picture::of(frame));
        draw_rope(&mut picture, tracked, &|p| part.place(p));
        picture.text([4, 4], &format!("{:.2} s", tracked.t_s), 2);
        picture
    };
    contact_sheet(&shown.iter().map(picture).collect::<Vec<_>>(), columns)
}

/// A part of an image, made smaller by a whole factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    left: usize,
    top: usize,
    size: [usize; 2],
    factor: usize,
}

impl Part {
    /// The part around points (px) of an image of this `size`, with room around them, and as
    /// often halved, thirded, ... as a sheet needs it; without points, all of the image.
    fn around<'a>(points: impl Iterator<Item = &'a [f64; 2]>, size: [usize; 2]) -> Self {
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for p in points.filter(|p| p[0].is_finite() && p[1].is_finite()) {
            for (end, x) in ends.iter_mut().zip(p) {
                *end = [end[0].min(*x), end[1].max(*x)];
            }
        }
        if ends[0][0] > ends[0][1] {
            ends = size.map(|side| [0.0, side as f64]);
        }
        let needed = ends.map(|[from, to]| (ROOM * (to - from)).ceil() as usize);
        let shown = [0, 1].map(|k| needed[k].min(size[k]));
        let factor = shown[0].max(shown[1]).div_ceil(SIDE_MAX_PX).max(1);
        let sides = [0, 1].map(|k| shown[k].max(SIDE_MIN_PX * factor).min(size[k]));
        let begin = |k: usize| {
            let middle = f64::midpoint(ends[k][0], ends[k][1]);
            let begin = (middle - sides[k] as f64 / 2.0).max(0.0) as usize;
            begin.min(size[k] - sides[k])
        };
        Self {
            left: begin(0),
            top: begin(1),
            size: sides,
            factor,
        }
    }

    fn of(&self, picture: &Picture) -> Picture {
        let mut part = Picture::black(self.size[0], self.size[1]);
        for v in 0..self.size[1] {
            let from = ((self.top + v) * picture.width_px + self.left) * 3;
            let to = v * self.size[0] * 3;
            part.rgb[to..to + self.size[0] * 3]
                .copy_from_slice(&picture.rgb[from..from + self.size[0] * 3]);
        }
        part.shrunk(self.factor)
    }

    /// A pixel of the image as one of the part.
    fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        // The middle of pixel 0 stands for those of pixels 0 to factor - 1.
        let small = |x: f64, from: usize| (x - from as f64 + 0.5) / self.factor as f64 - 0.5;
        [small(u, self.left), small(v, self.top)]
    }
}

/// Pictures in rows, all of the first one's size.
fn contact_sheet(pictures: &[Picture], columns: usize) -> Result<Picture, OverlayError> {
    let first = pictures
        .first()
        .ok_or(OverlayError::Input("no pictures for a contact sheet"))?;
    let columns = columns.clamp(1, pictures.len());
    let rows = pictures.len().div_ceil(columns);
    let mut sheet = Picture::black(first.width_px * columns, first.height_px * rows);
    for (i, picture) in pictures.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        sheet.paste(picture, column * first.width_px, row * first.height_px);
    }
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(level: u8) -> ImageFrame {
        ImageFrame::grey([8, 4], level)
    }

    #[test]
    fn sheets_tile_and_png_reads_back() {
        let pictures = [1, 2, 3].map(|level| Picture::of(&grey(level)));
        let sheet = contact_sheet(&pictures, 2).unwrap();
        assert_eq!((sheet.width_px, sheet.height_px), (16, 8));
        assert_eq!((sheet.rgb[8 * 3], sheet.rgb[16 * 4 * 3]), (2, 3));
        let file = std::io::Cursor::new(sheet.to_png().unwrap());
        let info = png::Decoder::new(file).read_info().unwrap().info().size();
        assert_eq!(info, (16, 8));
    }

    fn tracked(points: &[[f64; 2]], t_s: f64) -> TrackedFrame {
        TrackedFrame {
            t_s,
            points: points.to_vec(),
            confidence: vec![1.0; points.len()],
            lost: false,
        }
    }

    #[test]
    fn a_sheet_shows_the_part_where_the_rope_moves_as_large_as_it_can() {
        let size = [680, 340];
        let near = [[400.0, 200.0], [420.0, 260.0]];
        let part = Part::around(near.iter(), size);
        assert_eq!((part.factor, part.size), (1, [200, 200]));
        assert_eq!((part.left, part.top), (310, 130));
        assert_eq!(part.place([400.0, 200.0]), [90.0, 70.0]);
        // At the edge the part ends with the image, and a long rope is made smaller.
        let edge = [[679.0, 339.0]];
        let part = Part::around(edge.iter(), size);
        assert_eq!((part.left, part.top), (480, 140));
        let long = [[10.0, 10.0], [400.0, 300.0]];
        let part = Part::around(long.iter(), size);
        assert_eq!((part.factor, part.size), (2, [546, 340]));
        assert_eq!((part.left, part.top), (0, 0));
        assert_eq!(part.place([0.5, 0.5]), [0.0, 0.0]);
        let none = Part::around([].iter(), size);
        assert_eq!((none.left, none.size, none.factor), (0, size, 2));
    }

    #[test]
    fn keypoints_leave_the_rope_in_sight() {
        let frame = ImageFrame::grey([64, 64], 100);
        let points: Vec<[f64; 2]> = (0..27).map(|i| [30.0, 5.0 + 2.0 * f64::from(i)]).collect();
        let picture = drawn(&frame, &tracked(&points, 0.0));
        let at = |u: usize, v: usize| &picture.rgb[(v * 64 + u) * 3..(v * 64 + u) * 3 + 3];
        // On the rope itself most pixels are the film's own.
        let seen = (5..58).filter(|v| at(30, *v) == [100, 100, 100]).count();
        assert!(seen > 30, "{seen} of 53");
        assert_eq!(at(30, 5), [100, 100, 100], "a dot is hollow");
        let dots = picture.rgb.chunks(3).filter(|p| *p == FOUND).count();
        assert!(dots > 50, "{dots} pixels");
    }
}
