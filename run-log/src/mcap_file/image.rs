//! The camera's left eye as JPEG.

use anyhow::{Context, Result, ensure};
use jpeg_encoder::{Encoder, ImageBuffer, JpegColorType, SamplingFactor};
use shared_types::ipc::{FrameHeader, PIXEL_FORMAT_YUYV};

/// The left half of packed 4:2:2 rows, whose colours a JPEG takes as they are: of every
/// `scale` pixels and rows the first.
struct LeftImage<'a> {
    yuyv: &'a [u8],
    /// Pixels of the eye in a row of the frame.
    columns: usize,
    scale: usize,
    width: u16,
    height: u16,
}

impl ImageBuffer for LeftImage<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        JpegColorType::Ycbcr
    }
    fn width(&self) -> u16 {
        self.width
    }
    fn height(&self) -> u16 {
        self.height
    }
    fn fill_buffers(&self, row: u16, planes: &mut [Vec<u8>; 4]) {
        let begin = 4 * self.columns * usize::from(row) * self.scale;
        for u in (0..self.columns).step_by(self.scale) {
            let quad = &self.yuyv[begin + u / 2 * 4..][..4];
            planes[0].push(quad[u % 2 * 2]);
            planes[1].push(quad[1]);
            planes[2].push(quad[3]);
        }
    }
}

/// The left eye of a side-by-side frame, made `scale` times smaller each way.
///
/// # Errors
/// Header and bytes do not fit, or the picture is too large for a JPEG.
pub fn left_jpeg(header: &FrameHeader, yuyv: &[u8], scale: usize, quality: u8) -> Result<Vec<u8>> {
    let (width, height) = (header.width_px as usize, header.height_px as usize);
    ensure!(
        header.pixel_format == PIXEL_FORMAT_YUYV
            && width > 0
            && height > 0
            && width.is_multiple_of(4)
            && yuyv.len() == 2 * width * height,
        "the frame is not YUYV of {width} x {height} px"
    );
    let side =
        |px: usize| u16::try_from(px.div_ceil(scale)).context("the frame is too large for a JPEG");
    let image = LeftImage {
        yuyv,
        columns: width / 2,
        scale,
        width: side(width / 2)?,
        height: side(height)?,
    };
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder.encode_image(image)?;
    Ok(jpeg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use camera_ingest::StereoFrame;

    /// Left half dark and blueish, right half bright and red.
    #[test]
    fn the_left_half_comes_back_with_its_colours() {
        let (width, height) = (64u32, 16u32);
        let row: Vec<u8> = (0..width / 2)
            .flat_map(|pair| {
                if pair < width / 4 {
                    [60, 180, 60, 100]
                } else {
                    [200, 90, 200, 220]
                }
            })
            .collect();
        let header = FrameHeader {
            pixel_format: PIXEL_FORMAT_YUYV,
            width_px: width,
            height_px: height,
            ..FrameHeader::default()
        };
        let frame = row.repeat(height as usize);
        let jpeg = left_jpeg(&header, &frame, 1, 75).unwrap();
        // The reader takes it for a pair, which only concerns how it splits it.
        let StereoFrame(seen) = StereoFrame::from_jpeg(&jpeg, 0, 0).unwrap();
        assert_eq!((seen.width_px, seen.height_px), (32, 16));
        for (u, v) in [(0, 0), (31, 0), (16, 8), (31, 15)] {
            let [y, cb, cr] = seen.ycc(u, v).map(i32::from);
            assert!((y - 60).abs() < 3 && (cb - 180).abs() < 3 && (cr - 100).abs() < 3);
        }
        assert!(
            left_jpeg(&header, &row, 1, 75).is_err(),
            "one row is no frame"
        );
    }

    #[test]
    fn the_left_eye_is_cut_out_pixel_by_pixel() {
        // Two rows of eight pixels: luma counts, chroma tells the eye.
        let pair = |y: u8, image: u8| [y, 100 + image, y + 1, 200 + image];
        let row = |y: u8| [pair(y, 0), pair(y + 2, 0), pair(y + 4, 1), pair(y + 6, 1)].concat();
        let frame = [row(0), row(10)].concat();
        for (scale, row, luma) in [(1, 1, &[10, 11, 12, 13][..]), (2, 0, &[0, 2])] {
            let image = LeftImage {
                yuyv: &frame,
                columns: 4,
                scale,
                width: 0,
                height: 0,
            };
            let mut planes = [const { Vec::new() }; 4];
            image.fill_buffers(row, &mut planes);
            assert_eq!(planes[0], luma);
            assert!(planes[1].iter().all(|cb| *cb == 100) && planes[2].iter().all(|cr| *cr == 200));
        }
    }
}
