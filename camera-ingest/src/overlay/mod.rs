//! Pictures for people: keypoints over frames, and the strobe picture of a throw.

mod strobe;

pub use strobe::{still_scene, strobe};

use crate::whole_file::write_whole;
use std::path::{Path, PathBuf};

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

/// A colour picture, 3 bytes a pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels per row.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Packed RGB.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Picture of one image.
    #[must_use]
    pub fn of(frame: &ImageFrame) -> Self {
        Self {
            width_px: frame.width_px,
            height_px: frame.height_px,
            rgb: frame.to_rgb(),
        }
    }

    /// Black picture.
    #[must_use]
    pub fn black(width_px: usize, height_px: usize) -> Self {
        Self {
            width_px,
            height_px,
            rgb: vec![0; width_px * height_px * 3],
        }
    }

    fn set(&mut self, u: i64, v: i64, colour: [u8; 3]) {
        let (Ok(u), Ok(v)) = (usize::try_from(u), usize::try_from(v)) else {
            return;
        };
        if u < self.width_px && v < self.height_px {
            let at = (v * self.width_px + u) * 3;
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    fn cross(&mut self, [u, v]: [f64; 2], arm_px: i64, colour: [u8; 3]) {
        let (u, v) = (u.round() as i64, v.round() as i64);
        for d in -arm_px..=arm_px {
            self.set(u + d, v, colour);
            self.set(u, v + d, colour);
        }
    }

    /// A line one pixel wide.
    fn line(&mut self, from: [f64; 2], to: [f64; 2], colour: [u8; 3]) {
        let span = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
        if !span.is_finite() || span > 1e5 {
            return;
        }
        let steps = span.ceil().max(1.0) as i64;
        for i in 0..=steps {
            let a = i as f64 / steps as f64;
            let at = |k: usize| (from[k] + a * (to[k] - from[k])).round() as i64;
            self.set(at(0), at(1), colour);
        }
    }

    /// Copies another picture to `(left, top)`; what sticks out is cut off.
    fn paste(&mut self, other: &Self, left: usize, top: usize) {
        let width = other.width_px.min(self.width_px.saturating_sub(left));
        for v in 0..other.height_px.min(self.height_px.saturating_sub(top)) {
            let from = v * other.width_px * 3;
            let to = ((top + v) * self.width_px + left) * 3;
            self.rgb[to..to + width * 3].copy_from_slice(&other.rgb[from..from + width * 3]);
        }
    }

    /// The picture made smaller by a whole factor, each pixel the mean of those it
    /// stands for; rows and columns left over are cut off.
    #[must_use]
    pub fn shrunk(&self, factor: usize) -> Self {
        let factor = factor.max(1);
        let mut small = Self::black(self.width_px / factor, self.height_px / factor);
        let count = factor * factor;
        for v in 0..small.height_px {
            for u in 0..small.width_px {
                let mut sum = [0; 3];
                for row in v * factor..(v + 1) * factor {
                    let from = (row * self.width_px + u * factor) * 3;
                    for pixel in self.rgb[from..from + factor * 3].chunks_exact(3) {
                        for (sum, &c) in sum.iter_mut().zip(pixel) {
                            *sum += usize::from(c);
                        }
                    }
                }
                let at = (v * small.width_px + u) * 3;
                for (to, sum) in small.rgb[at..at + 3].iter_mut().zip(sum) {
                    *to = u8::try_from(sum / count).unwrap_or(u8::MAX);
                }
            }
        }
        small
    }

    /// The picture as a PNG file's bytes.
    ///
    /// # Errors
    /// The picture is too large for one.
    pub fn to_png(&self) -> Result<Vec<u8>, OverlayError> {
        let large = OverlayError::Input("the picture is too large for a PNG");
        let (Ok(width), Ok(height)) = (u32::try_from(self.width_px), u32::try_from(self.height_px))
        else {
            return Err(large);
        };
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let written = encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&self.rgb));
        written.map_err(|_e| large).map(|()| bytes)
    }

    /// Writes a PNG file, whole or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), OverlayError> {
        let bytes = self.to_png()?;
        write_whole(path, &bytes).map_err(|e| OverlayError::Write {
            path: path.to_owned(),
            reason: e.to_string(),
        })
    }
}

/// Widest picture in a contact sheet (px): a dozen stay around a megabyte.
const SHEET_WIDTH_PX: usize = 340;

/// A frame with its keypoints, red where the rope is lost.
pub(crate) fn drawn(frame: &ImageFrame, tracked: &TrackedFrame) -> Picture {
    draw_rope(Picture::of(frame), tracked, 1)
}

fn draw_rope(mut picture: Picture, tracked: &TrackedFrame, factor: usize) -> Picture {
    // The middle of pixel 0 stands for those of pixels 0 to factor - 1.
    let small = |x: f64| (x + 0.5) / factor as f64 - 0.5;
    let points: Vec<[f64; 2]> = tracked.points.iter().map(|p| p.map(small)).collect();
    let line = if tracked.lost {
        [255, 0, 0]
    } else {
        [0, 255, 255]
    };
    for pair in points.windows(2) {
        picture.line(pair[0], pair[1], line);
    }
    for p in points {
        picture.cross(p, 1, [255, 0, 255]);
    }
    picture
}

/// Contact sheet of chosen frames, `columns` a row, made smaller, with their keypoints drawn.
///
/// # Errors
/// No frame chosen.
pub fn keypoint_sheet(
    frames: &[ImageFrame],
    track: &KeypointTrack,
    chosen: &[usize],
    columns: usize,
) -> Result<Picture, OverlayError> {
    let pictures: Vec<Picture> = chosen
        .iter()
        .filter_map(|&i| Some((frames.get(i)?, track.frames.get(i)?)))
        .map(|(frame, tracked)| {
            let factor = frame.width_px.div_ceil(SHEET_WIDTH_PX).max(1);
            draw_rope(Picture::of(frame).shrunk(factor), tracked, factor)
        })
        .collect();
    contact_sheet(&pictures, columns)
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
    fn drawing_stays_inside() {
        let mut picture = Picture::of(&grey(0));
        picture.line([-20.0, 1.0], [20.0, 1.0], [255, 0, 0]);
        picture.cross([7.0, 3.0], 3, [0, 255, 0]);
        let red = picture.rgb.chunks(3).filter(|p| p[0] == 255).count();
        assert_eq!(red, 7, "a row of eight, one under the cross");
    }

    #[test]
    fn a_smaller_picture_holds_the_means() {
        let mut picture = Picture::of(&grey(100));
        picture.set(0, 0, [0, 200, 100]);
        let small = picture.shrunk(2);
        assert_eq!((small.width_px, small.height_px), (4, 2));
        assert_eq!(small.rgb[..6], [75, 125, 100, 100, 100, 100]);
        assert_eq!(picture.shrunk(3).width_px, 2);
        assert_eq!(picture.shrunk(1), picture);
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
}
