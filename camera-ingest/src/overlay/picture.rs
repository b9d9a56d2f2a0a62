//! A colour picture, made smaller, put together and written as PNG.

use super::OverlayError;
use crate::frame::ImageFrame;
use crate::whole_file::write_whole;
use std::path::Path;

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

    pub(super) fn set(&mut self, u: i64, v: i64, colour: [u8; 3]) {
        let (Ok(u), Ok(v)) = (usize::try_from(u), usize::try_from(v)) else {
            return;
        };
        if u < self.width_px && v < self.height_px {
            let at = (v * self.width_px + u) * 3;
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Copies another picture to `(left, top)`; what sticks out is cut off.
    pub(super) fn paste(&mut self, other: &Self, left: usize, top: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_picture_holds_the_means() {
        let mut picture = Picture::of(&ImageFrame::grey([8, 4], 100));
        picture.set(0, 0, [0, 200, 100]);
        let small = picture.shrunk(2);
        assert_eq!((small.width_px, small.height_px), (4, 2));
        assert_eq!(small.rgb[..6], [75, 125, 100, 100, 100, 100]);
        assert_eq!(picture.shrunk(3).width_px, 2);
        assert_eq!(picture.shrunk(1), picture);
    }
}
