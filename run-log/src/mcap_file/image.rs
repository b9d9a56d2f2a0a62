//! The camera's left eye as JPEG.
//!
//! Left only: the rope is tracked in it, and the right eye would double the file.

use crate::{Error, Result};
use jpeg_encoder::{Encoder, ImageBuffer, JpegColorType, SamplingFactor};
use shared_types::ipc::{FrameHeader, PIXEL_FORMAT_YUYV};

/// JPEG quality.
const QUALITY: u8 = 75;

/// The left half of packed 4:2:2 rows, whose colours a JPEG takes as they are.
struct LeftEye<'a> {
    yuyv: &'a [u8],
    width: u16,
    height: u16,
}

impl ImageBuffer for LeftEye<'_> {
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
        let eye = 2 * usize::from(self.width);
        let begin = 2 * eye * usize::from(row);
        for quad in self.yuyv[begin..begin + eye].chunks_exact(4) {
            for luma in [quad[0], quad[2]] {
                planes[0].push(luma);
                planes[1].push(quad[1]);
                planes[2].push(quad[3]);
            }
        }
    }
}

/// The left eye of a side-by-side frame.
pub(super) fn left_jpeg(header: &FrameHeader, yuyv: &[u8]) -> Result<Vec<u8>> {
    let too_large = |_| Error::Picture("the frame is too large for a JPEG".to_owned());
    let width = u16::try_from(header.width_px / 2).map_err(too_large)?;
    let height = u16::try_from(header.height_px).map_err(too_large)?;
    let is_yuyv = header.pixel_format == PIXEL_FORMAT_YUYV
        && header.width_px.is_multiple_of(4)
        && yuyv.len() == 4 * usize::from(width) * usize::from(height);
    if !is_yuyv {
        return Err(Error::Picture(format!(
            "the frame is no YUYV of {} x {} px",
            header.width_px, header.height_px
        )));
    }
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    let eye = LeftEye {
        yuyv,
        width,
        height,
    };
    encoder
        .encode_image(eye)
        .map_err(|reason| Error::Picture(reason.to_string()))?;
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
        let jpeg = left_jpeg(&header, &row.repeat(height as usize)).unwrap();
        // The reader takes it for a pair, which only concerns how it splits it.
        let StereoFrame(seen) = StereoFrame::from_jpeg(&jpeg, 0, 0).unwrap();
        assert_eq!((seen.width_px, seen.height_px), (32, 16));
        for (u, v) in [(0, 0), (31, 0), (16, 8), (31, 15)] {
            let [y, cb, cr] = seen.ycc(u, v).map(i32::from);
            assert!((y - 60).abs() < 3 && (cb - 180).abs() < 3 && (cr - 100).abs() < 3);
        }
        assert!(left_jpeg(&header, &row).is_err(), "one row is no frame");
    }
}
