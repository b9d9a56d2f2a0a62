//! A folder of side-by-side pictures, PNG or JPEG, one a frame, in the order of
//! their names.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::stamps::{self, Stamp};
use super::{FrameSource, SourceError, StereoSource, read_bytes};
use crate::frame::{EyeFrame, FrameError, StereoFrame};

const REMEDY: &str = "export the recording again, one picture a frame";

/// A folder of pictures, each read when it is asked for.
#[derive(Debug)]
pub struct ImageSource {
    folder: PathBuf,
    files: Vec<PathBuf>,
    stamps: Vec<Stamp>,
    /// Both eyes together.
    size_px: [usize; 2],
}

/// How a picture is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Png,
    Jpeg,
}

impl Kind {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        let is = |name: &str| extension.eq_ignore_ascii_case(OsStr::new(name));
        if is("png") {
            Some(Self::Png)
        } else if is("jpg") || is("jpeg") {
            Some(Self::Jpeg)
        } else {
            None
        }
    }
}

impl ImageSource {
    /// Opens a folder; times come from its `timestamps.csv` or else from `rate_hz`.
    ///
    /// # Errors
    /// No pictures, pictures whose names' counters are out of order, no times, or a
    /// first picture that does not decode.
    pub fn open(folder: &Path, rate_hz: Option<f64>) -> Result<Self, SourceError> {
        let files = pictures(folder)?;
        let csv = folder.join("timestamps.csv");
        let mut source = Self {
            folder: folder.to_owned(),
            stamps: stamps::beside(folder, &csv, rate_hz, files.len())?,
            files,
            size_px: [0; 2],
        };
        let first = source.decode(0, stereo)?.0;
        source.size_px = [first.width_px, first.height_px];
        Ok(source)
    }

    fn decode<T>(
        &self,
        index: usize,
        decode: impl Fn(Kind, &[u8], Stamp) -> Result<T, FrameError>,
    ) -> Result<T, SourceError> {
        let (Some(path), Some(stamp)) = (self.files.get(index), self.stamps.get(index)) else {
            return Err(SourceError::OutOfRange {
                path: self.folder.clone(),
                frame: index,
                len: self.files.len(),
            });
        };
        let kind = Kind::of(path).unwrap_or(Kind::Jpeg);
        decode(kind, &read_bytes(path)?, *stamp).map_err(|source| self.damaged(index, source))
    }

    fn damaged(&self, index: usize, source: FrameError) -> SourceError {
        SourceError::Frame {
            path: self.files.get(index).unwrap_or(&self.folder).clone(),
            frame: index,
            source,
        }
    }

    fn check_size(&self, index: usize, found: [usize; 2]) -> Result<(), SourceError> {
        if found == self.size_px {
            return Ok(());
        }
        Err(self.damaged(
            index,
            FrameError::Size {
                found,
                expected: self.size_px,
            },
        ))
    }
}

fn stereo(kind: Kind, bytes: &[u8], stamp: Stamp) -> Result<StereoFrame, FrameError> {
    match kind {
        Kind::Png => StereoFrame::from_png(bytes, stamp.stamp_ns, stamp.sequence),
        Kind::Jpeg => StereoFrame::from_jpeg(bytes, stamp.stamp_ns, stamp.sequence),
    }
}

fn left(kind: Kind, bytes: &[u8], stamp: Stamp) -> Result<EyeFrame, FrameError> {
    match kind {
        Kind::Png => stereo(kind, bytes, stamp).map(|frame| frame.left()),
        Kind::Jpeg => {
            EyeFrame::left_from_jpeg(bytes, stamp.stamp_ns, stamp.sequence, &mut Vec::new())
        }
    }
}

impl FrameSource for ImageSource {
    fn len(&self) -> usize {
        self.files.len()
    }

    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        let frame = self.decode(index, left)?;
        self.check_size(index, [2 * frame.width_px, frame.height_px])?;
        Ok(frame)
    }
}

impl StereoSource for ImageSource {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        let frame = self.decode(index, stereo)?;
        self.check_size(index, [frame.0.width_px, frame.0.height_px])?;
        Ok(frame)
    }
}

/// The pictures of a folder in the order of their names.
fn pictures(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let io = |source| SourceError::Io {
        path: folder.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if Kind::of(&path).is_some() {
            files.push(path);
        }
    }
    files.sort();
    let fail = |reason: String, remedy| SourceError::Container {
        path: folder.to_owned(),
        reason,
        remedy,
    };
    if files.is_empty() {
        return Err(fail(
            "neither video.avi nor PNG or JPEG pictures in it".to_owned(),
            REMEDY,
        ));
    }
    // `frame10` sorts before `frame9`: an order nobody means.
    for pair in files.windows(2) {
        if let [Some(before), Some(after)] = [counter(&pair[0]), counter(&pair[1])]
            && before >= after
        {
            let name = |path: &Path| path.file_name().unwrap_or_default().display().to_string();
            return Err(fail(
                format!(
                    "{} is followed by {}, sorted by name",
                    name(&pair[0]),
                    name(&pair[1])
                ),
                "number the pictures with leading zeros",
            ));
        }
    }
    Ok(files)
}

/// The number a picture's name ends in.
fn counter(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[digits..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a PNG: grey, its right half red.
    fn png(width: u32, height: u32, grey: u8) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let row = |u: u32| {
            if u < width / 2 {
                [grey; 3]
            } else {
                [255, 0, 0]
            }
        };
        let pixels: Vec<u8> = (0..height).flat_map(|_| (0..width).flat_map(row)).collect();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&pixels).unwrap();
        drop(writer);
        bytes
    }

    fn folder(name: &str, files: &[(&str, &[u8])]) -> PathBuf {
        let path = std::env::temp_dir().join(format!("images-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        for (file, bytes) in files {
            std::fs::write(path.join(file), bytes).unwrap();
        }
        path
    }

    fn refused(name: &str, files: &[(&str, &[u8])]) -> String {
        let path = folder(name, files);
        let read = ImageSource::open(&path, Some(10.0))
            .and_then(|mut source| (0..source.len()).try_for_each(|i| source.read(i).map(|_| ())));
        std::fs::remove_dir_all(&path).unwrap();
        read.unwrap_err().to_string()
    }

    #[test]
    fn pictures_come_in_the_order_of_their_names() {
        let (a, b) = (png(8, 2, 60), png(8, 2, 61));
        let path = folder("order", &[("f09.png", &a), ("f10.PNG", &b), ("x.txt", b"")]);
        let mut source = ImageSource::open(&path, Some(10.0)).unwrap();
        let (first, second) = (source.read(0).unwrap(), source.read_left(1).unwrap());
        std::fs::remove_dir_all(&path).unwrap();
        assert_eq!(source.len(), 2);
        assert_eq!((first.0.luma[0], second.luma[0]), (60, 61));
        assert_eq!((second.width_px, second.stamp_ns), (4, 100_000_000));
        // BT.601: pure red is Y 76, Cb 85, Cr 255.
        assert_eq!(first.right().ycc(0, 0), [76, 85, 255]);
        assert_eq!(first.left().ycc(3, 1), [60, 128, 128]);
    }

    #[test]
    fn what_is_no_recording_says_why() {
        let (small, large) = (png(8, 2, 60), png(12, 2, 60));
        let none = refused("none", &[("x.txt", b"")]);
        assert!(none.contains("PNG or JPEG"), "{none}");
        let sizes = refused("sizes", &[("f1.png", &small), ("f2.png", &large)]);
        assert!(
            sizes.contains("frame 1") && sizes.contains("12x2"),
            "{sizes}"
        );
        let order = refused("count", &[("f9.png", &small), ("f10.png", &small)]);
        assert!(
            order.contains("f9.png") && order.contains("zeros"),
            "{order}"
        );
        let torn = refused("torn", &[("f1.png", &small), ("f2.png", &small[..40])]);
        assert!(torn.contains("f2.png") && torn.contains("PNG"), "{torn}");
        let text = refused("text", &[("f1.jpg", b"words")]);
        assert!(text.contains("f1.jpg") && text.contains("JPEG"), "{text}");
    }
}
