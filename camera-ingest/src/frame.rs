//! Frames as luma and chroma planes.
//!
//! A frame keeps the camera's own 4:2:2 form: one luma value a pixel, one pair
//! of chroma values for two pixels of a row. Full-range BT.601 throughout, for
//! YUYV and JPEG alike.

use std::io::Cursor;

use crate::vectors::widest;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Most bytes of a picture's samples, unpacked: a pair of 12 megapixels each in colour.
const PICTURE_MAX_BYTES: usize = 72_000_000;

/// Why bytes are no frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FrameError(String);

impl FrameError {
    fn jpeg(reason: &str) -> Self {
        Self(format!("JPEG does not decode: {reason}"))
    }

    fn png(reason: &str) -> Self {
        Self(format!("PNG does not decode: {reason}"))
    }

    /// A frame of another width (both images) and height than the first one of a recording.
    pub(crate) fn size(found: [usize; 2], expected: [usize; 2]) -> Self {
        let [[width, height], [first_width, first_height]] = [found, expected];
        Self(format!(
            "it is {width}x{height} px, the first one {first_width}x{first_height}"
        ))
    }
}

/// Planes of one image: luma `width * height`, chroma `width / 2 * height`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageFrame {
    /// Start of exposure of row 0 (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// The camera's sequence number.
    pub sequence: u64,
    /// Pixels per row.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Luma.
    pub luma: Vec<u8>,
    /// Blue chroma, 128 = none.
    pub cb: Vec<u8>,
    /// Red chroma, 128 = none.
    pub cr: Vec<u8>,
}

/// Both images side by side, the left image in the left half.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StereoFrame(pub ImageFrame);

impl ImageFrame {
    /// A picture of one grey level, stamp and sequence 0.
    #[must_use]
    pub fn grey([width_px, height_px]: [usize; 2], level: u8) -> Self {
        Self {
            stamp_ns: 0,
            sequence: 0,
            width_px,
            height_px,
            luma: vec![level; width_px * height_px],
            cb: vec![128; width_px * height_px / 2],
            cr: vec![128; width_px * height_px / 2],
        }
    }

    /// `[Y, Cb, Cr]` of the nearest pixel inside the image.
    #[must_use]
    pub fn ycc(&self, u: usize, v: usize) -> [u8; 3] {
        let (u, v) = (u.min(self.width_px - 1), v.min(self.height_px - 1));
        let c = v * (self.width_px / 2) + u / 2;
        [self.luma[v * self.width_px + u], self.cb[c], self.cr[c]]
    }

    /// Copy of the columns `from..from + width` (both even).
    fn columns(&self, from: usize, width: usize) -> Self {
        let cut = |plane: &[u8], stride: usize, from: usize, width: usize| -> Vec<u8> {
            plane
                .chunks_exact(stride)
                .flat_map(|row| &row[from..from + width])
                .copied()
                .collect()
        };
        let half = self.width_px / 2;
        Self {
            width_px: width,
            luma: cut(&self.luma, self.width_px, from, width),
            cb: cut(&self.cb, half, from / 2, width / 2),
            cr: cut(&self.cr, half, from / 2, width / 2),
            ..*self
        }
    }

    /// One image's picture by itself.
    ///
    /// # Errors
    /// As [`StereoFrame::from_jpeg`].
    pub fn from_jpeg(bytes: &[u8], stamp_ns: u64, sequence: u64) -> Result<Self, FrameError> {
        let mut packed = Vec::new();
        let size = decode(bytes, &mut packed)?;
        Ok(planes(&packed, size, size[0], stamp_ns, sequence))
    }

    /// Left image of a side-by-side JPEG. `room` holds the decoded picture meanwhile;
    /// whoever keeps it from frame to frame spares the system new pages for each.
    ///
    /// # Errors
    /// As [`StereoFrame::from_jpeg`].
    pub(crate) fn left_from_jpeg(
        bytes: &[u8],
        stamp_ns: u64,
        sequence: u64,
        room: &mut Vec<u8>,
    ) -> Result<Self, FrameError> {
        let size = decode(bytes, room)?;
        Ok(planes(room, size, size[0] / 2, stamp_ns, sequence))
    }

    /// Left image of side-by-side V4L2 `YUYV`, rows without padding; `size_px` is that of
    /// both images.
    ///
    /// # Errors
    /// As [`StereoFrame::from_yuyv`].
    pub fn left_from_yuyv(
        bytes: &[u8],
        size_px: [usize; 2],
        stamp_ns: u64,
        sequence: u64,
    ) -> Result<Self, FrameError> {
        check_yuyv(bytes, size_px)?;
        let [width_px, height_px] = size_px;
        let mut frame = blank(width_px / 2, height_px, stamp_ns, sequence);
        let rows = bytes.chunks_exact(2 * width_px);
        let left = rows.flat_map(|row| row[..width_px].chunks_exact(4));
        frame.fill(left);
        Ok(frame)
    }

    /// Takes in packed pairs of pixels, row after row.
    fn fill<'a>(&mut self, quads: impl Iterator<Item = &'a [u8]>) {
        let pairs = self.luma.chunks_exact_mut(2);
        for (quad, (pair, (cb, cr))) in quads.zip(pairs.zip(self.cb.iter_mut().zip(&mut self.cr))) {
            (pair[0], *cb, pair[1], *cr) = (quad[0], quad[1], quad[2], quad[3]);
        }
    }

    /// Packed RGB, 3 bytes a pixel.
    #[must_use]
    pub fn to_rgb(&self) -> Vec<u8> {
        (0..self.height_px)
            .flat_map(|v| (0..self.width_px).map(move |u| (u, v)))
            .flat_map(|(u, v)| rgb_from_ycc(self.ycc(u, v).map(f32::from)))
            .collect()
    }
}

impl StereoFrame {
    /// Left image.
    #[must_use]
    pub fn left(&self) -> ImageFrame {
        self.0.columns(0, self.0.width_px / 2)
    }

    /// Right image.
    #[must_use]
    pub fn right(&self) -> ImageFrame {
        let half = self.0.width_px / 2;
        self.0.columns(half, half)
    }

    /// From V4L2 `YUYV` (Y0 Cb Y1 Cr), rows without padding.
    ///
    /// # Errors
    /// The number of bytes or the width does not fit.
    pub fn from_yuyv(
        bytes: &[u8],
        [width_px, height_px]: [usize; 2],
        stamp_ns: u64,
        sequence: u64,
    ) -> Result<Self, FrameError> {
        check_yuyv(bytes, [width_px, height_px])?;
        let mut frame = blank(width_px, height_px, stamp_ns, sequence);
        frame.fill(bytes.chunks_exact(4));
        Ok(Self(frame))
    }

    /// As V4L2 `YUYV`, rows without padding.
    #[must_use]
    pub fn to_yuyv(&self) -> Vec<u8> {
        let Self(frame) = self;
        let chroma = frame.cb.iter().zip(&frame.cr);
        let pairs = frame.luma.chunks_exact(2).zip(chroma);
        pairs
            .flat_map(|(y, (cb, cr))| [y[0], *cb, y[1], *cr])
            .collect()
    }

    /// From one baseline JPEG. Chroma is kept as the mean of two neighbours.
    ///
    /// # Errors
    /// The JPEG is damaged or its width is no side-by-side pair.
    pub fn from_jpeg(bytes: &[u8], stamp_ns: u64, sequence: u64) -> Result<Self, FrameError> {
        ImageFrame::from_jpeg(bytes, stamp_ns, sequence).map(Self)
    }

    /// From a PNG, grey or colour; transparency is ignored. Chroma is kept as the
    /// mean of two neighbours.
    ///
    /// # Errors
    /// The PNG is damaged or its width is no side-by-side pair.
    pub fn from_png(bytes: &[u8], stamp_ns: u64, sequence: u64) -> Result<Self, FrameError> {
        let fail = |e: png::DecodingError| FrameError::png(&e.to_string());
        let mut decoder = png::Decoder::new(Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(fail)?;
        let size_bytes = reader.output_buffer_size();
        let too_large = || FrameError::png("it has more pixels than any camera's picture");
        // What a file claims to hold is believed only so far.
        let size_bytes = size_bytes.filter(|bytes| *bytes <= PICTURE_MAX_BYTES);
        let mut pixels = vec![0; size_bytes.ok_or_else(too_large)?];
        let info = reader.next_frame(&mut pixels).map_err(fail)?;
        let size_px = [info.width as usize, info.height as usize];
        check_width(size_px[0])?;
        let samples = info.color_type.samples();
        let packed: Vec<u8> = pixels[..info.buffer_size()]
            .chunks_exact(samples)
            .flat_map(|pixel| {
                let rgb = if samples < 3 {
                    [pixel[0]; 3]
                } else {
                    [pixel[0], pixel[1], pixel[2]]
                };
                rounded(ycc_from_rgb(rgb))
            })
            .collect();
        let frame = planes(&packed, size_px, size_px[0], stamp_ns, sequence);
        Ok(Self(frame))
    }
}

/// Packed Y, Cb, Cr of every pixel into `packed`; width and height.
fn decode(bytes: &[u8], packed: &mut Vec<u8>) -> Result<[usize; 2], FrameError> {
    // Asking for YCbCr spares a colour conversion we would only undo.
    let options = DecoderOptions::new_fast()
        .jpeg_set_out_colorspace(ColorSpace::YCbCr)
        .set_strict_mode(true);
    // The decoder fills what is missing with grey; the end marker shows it.
    let end = bytes.iter().rposition(|&b| b != 0).unwrap_or(0);
    if end == 0 || bytes[end - 1..=end] != [0xff, 0xd9] {
        let reason = "it has no end marker, so a part is missing";
        return Err(FrameError::jpeg(reason));
    }
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let jpeg = |e: zune_jpeg::errors::DecodeErrors| FrameError::jpeg(&format!("{e:?}"));
    decoder.decode_headers().map_err(jpeg)?;
    let none = || FrameError::jpeg("no dimensions");
    let (width_px, height_px) = decoder.dimensions().ok_or_else(none)?;
    check_width(width_px)?;
    packed.resize(decoder.output_buffer_size().ok_or_else(none)?, 0);
    if packed.len() != width_px * height_px * 3 {
        return Err(FrameError::jpeg("not a colour picture"));
    }
    decoder.decode_into(packed).map_err(jpeg)?;
    Ok([width_px, height_px])
}

/// The first `columns` columns of a packed picture.
fn planes(
    packed: &[u8],
    [width_px, height_px]: [usize; 2],
    columns: usize,
    stamp_ns: u64,
    sequence: u64,
) -> ImageFrame {
    let mut frame = blank(columns, height_px, stamp_ns, sequence);
    let rows = packed.chunks_exact(width_px * 3);
    let half = columns / 2;
    let chroma = frame
        .cb
        .chunks_exact_mut(half)
        .zip(frame.cr.chunks_exact_mut(half));
    let luma = frame.luma.chunks_exact_mut(columns);
    widest(
        #[inline(always)]
        || {
            for ((row, luma), (cb, cr)) in rows.zip(luma).zip(chroma) {
                unpack(row, luma, cb, cr);
            }
        },
    );
    frame
}

/// A row of packed pixels into its planes.
#[inline(always)]
fn unpack(row: &[u8], luma: &mut [u8], cb: &mut [u8], cr: &mut [u8]) {
    let pairs = luma.chunks_exact_mut(2).zip(cb.iter_mut().zip(cr));
    for (six, (pair, (cb, cr))) in row.chunks_exact(6).zip(pairs) {
        (pair[0], pair[1]) = (six[0], six[3]);
        *cb = six[1].midpoint(six[4]);
        *cr = six[2].midpoint(six[5]);
    }
}

fn check_width(width_px: usize) -> Result<(), FrameError> {
    if width_px.is_multiple_of(4) && width_px > 0 {
        Ok(())
    } else {
        Err(FrameError(format!(
            "a width of {width_px} px is not a side-by-side pair with 4:2:2 chroma (must divide by 4)"
        )))
    }
}

/// Bytes and size of packed `YUYV` fit each other.
fn check_yuyv(bytes: &[u8], [width_px, height_px]: [usize; 2]) -> Result<(), FrameError> {
    check_width(width_px)?;
    let expected = width_px * height_px * 2;
    if bytes.len() != expected || expected == 0 {
        return Err(FrameError(format!(
            "{} bytes where {width_px}x{height_px} YUYV needs {expected}",
            bytes.len()
        )));
    }
    Ok(())
}

fn blank(width_px: usize, height_px: usize, stamp_ns: u64, sequence: u64) -> ImageFrame {
    ImageFrame {
        stamp_ns,
        sequence,
        ..ImageFrame::grey([width_px, height_px], 0)
    }
}

/// RGB of a full-range BT.601 colour.
#[must_use]
pub fn rgb_from_ycc([y, cb, cr]: [f32; 3]) -> [u8; 3] {
    let (b, r) = (cb - 128.0, cr - 128.0);
    rounded([
        y + 1.402 * r,
        y - 0.344_136 * b - 0.714_136 * r,
        y + 1.772 * b,
    ])
}

fn rounded(channels: [f32; 3]) -> [u8; 3] {
    channels.map(|c| c.round().clamp(0.0, 255.0) as u8)
}

/// Full-range BT.601 `[Y, Cb, Cr]` of an RGB colour.
#[must_use]
pub fn ycc_from_rgb(rgb: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(f32::from);
    let y = 0.299 * r + 0.587 * g + 0.114 * b;
    [y, 128.0 + (b - y) / 1.772, 128.0 + (r - y) / 1.402]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yuyv_planes_and_halves() {
        // Two rows, two images of two pixels each.
        let bytes: Vec<u8> = (0..16).collect();
        let frame = StereoFrame::from_yuyv(&bytes, [4, 2], 7, 3).unwrap();
        assert_eq!(frame.left().luma, [0, 2, 8, 10]);
        assert_eq!(frame.right().luma, [4, 6, 12, 14]);
        assert_eq!(
            (frame.left().cb, frame.right().cr),
            (vec![1, 9], vec![7, 15])
        );
        assert_eq!(frame.0.ycc(3, 1), [14, 13, 15]);
        assert_eq!(
            ImageFrame::left_from_yuyv(&bytes, [4, 2], 7, 3),
            Ok(frame.left())
        );
        assert!(ImageFrame::left_from_yuyv(&bytes[1..], [4, 2], 7, 3).is_err());
        assert_eq!((frame.0.stamp_ns, frame.0.sequence), (7, 3));
    }

    /// Memory for it is not even asked for.
    #[test]
    fn a_png_that_claims_more_pixels_than_cameras_have_is_refused() {
        let mut bytes = Vec::new();
        let encoder = png::Encoder::new(&mut bytes, 4096, 4_000_000);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(png::chunk::IDAT, &[0; 8]).unwrap();
        drop(writer);
        let refused = StereoFrame::from_png(&bytes, 0, 0).unwrap_err();
        assert!(refused.to_string().contains("more pixels"), "{refused}");
    }

    #[test]
    fn wrong_sizes_are_refused() {
        let refused = |bytes: &[u8], size_px| {
            let refused = StereoFrame::from_yuyv(bytes, size_px, 0, 0);
            refused.unwrap_err().to_string()
        };
        assert_eq!(
            refused(&[0; 15], [4, 2]),
            "15 bytes where 4x2 YUYV needs 16"
        );
        let width = refused(&[0; 24], [6, 2]);
        assert!(width.starts_with("a width of 6 px"), "{width}");
        let damaged = StereoFrame::from_jpeg(&[0xff, 0xd8, 0, 1, 0xff, 0xd9], 0, 0);
        let damaged = damaged.unwrap_err().to_string();
        assert!(damaged.starts_with("JPEG does not decode"), "{damaged}");
        for short in [&[][..], &[0], &[0xd9], &[0xff, 0xd8, 0xff, 0xe0]] {
            let error = StereoFrame::from_jpeg(short, 0, 0).unwrap_err();
            assert!(error.to_string().contains("end marker"), "{error}");
        }
    }

    #[test]
    fn colours_follow_bt601() {
        // ITU-R BT.601, full range: pure red is Y 76.245, Cb 84.97, Cr 255.5.
        let [y, cb, cr] = ycc_from_rgb([255, 0, 0]);
        assert!(
            (y - 76.245).abs() < 1e-3 && (cb - 84.97).abs() < 0.01 && (cr - 255.5).abs() < 0.01
        );
        for rgb in [[12, 200, 99], [255, 255, 255], [0, 0, 0], [214, 96, 22]] {
            assert_eq!(rgb_from_ycc(ycc_from_rgb(rgb)), rgb);
        }
    }
}
