//! A folder of side-by-side pictures, PNG or JPEG, one a frame, in the order of
//! their names.

use std::path::{Path, PathBuf};

use super::error::SourceError;
use super::frames::StereoSource;
use super::stamps;
use super::stored::{Coding, Pictures, Stored};

/// Opens a folder, each picture of which is read when it is asked for; times come from its
/// `timestamps.csv` or else from `rate_hz`.
///
/// # Errors
/// No pictures, pictures whose names' counters are out of order, no times, or a first
/// picture that does not decode.
pub(super) fn open(folder: &Path, rate_hz: Option<f64>) -> Result<Stored, SourceError> {
    let files = pictures(folder)?;
    let csv = folder.join("timestamps.csv");
    let stamps = stamps::beside(folder, &csv, rate_hz, files.len())?;
    let mut source = Stored::new(folder, Pictures::Files(files), stamps);
    let first = source.read(0)?.0;
    source.size_px = Some([first.width_px, first.height_px]);
    Ok(source)
}

/// The pictures of a folder in the order of their names.
fn pictures(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let io = SourceError::io(folder);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&io)? {
        let path = entry.map_err(&io)?.path();
        if Coding::of_file(&path).is_some() {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        let reason = "neither video.avi nor PNG or JPEG pictures in it; export the recording again, \
                      one picture a frame";
        return Err(SourceError::video(folder, reason));
    }
    // `frame10` sorts before `frame9`: which is never intended.
    for pair in files.windows(2) {
        if let [Some(before), Some(after)] = [counter(&pair[0]), counter(&pair[1])]
            && before >= after
        {
            let name = |path: &Path| path.file_name().unwrap_or_default().display().to_string();
            let (one, next) = (name(&pair[0]), name(&pair[1]));
            let reason = format!(
                "{one} is followed by {next}, sorted by name; number the pictures with leading zeros"
            );
            return Err(SourceError::video(folder, reason));
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
    use crate::source::FrameSource;

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

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (file, bytes) in files {
            std::fs::write(folder.path().join(file), bytes).unwrap();
        }
        folder
    }

    fn refused(files: &[(&str, &[u8])]) -> String {
        let read = open(folder(files).path(), Some(10.0))
            .and_then(|mut source| (0..source.len()).try_for_each(|i| source.read(i).map(|_| ())));
        read.unwrap_err().to_string()
    }

    #[test]
    fn pictures_come_in_the_order_of_their_names() {
        let (a, b) = (png(8, 2, 60), png(8, 2, 61));
        let folder = folder(&[("f09.png", &a), ("f10.PNG", &b), ("x.txt", b"")]);
        let mut source = open(folder.path(), Some(10.0)).unwrap();
        let (first, second) = (source.read(0).unwrap(), source.read_left(1).unwrap());
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
        type Case<'a> = (&'a [(&'a str, &'a [u8])], [&'a str; 2]);
        let cases: [Case; 5] = [
            (&[("x.txt", b"")], ["PNG or JPEG", "video.avi"]),
            (
                &[("f1.png", &small), ("f2.png", &large)],
                ["frame 1", "12x2"],
            ),
            (
                &[("f9.png", &small), ("f10.png", &small)],
                ["f9.png", "zeros"],
            ),
            (
                &[("f1.png", &small), ("f2.png", &small[..40])],
                ["f2.png", "PNG"],
            ),
            (&[("f1.jpg", b"words")], ["f1.jpg", "JPEG"]),
        ];
        for (files, words) in cases {
            let said = refused(files);
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
    }
}
