//! Raw V4L2 `YUYV` frames one after the other, without any header.

use std::fs::File;
use std::path::Path;

use super::error::SourceError;
use super::stamps;
use super::stored::{Pictures, Stored};

/// Opens a raw file whose name contains its size, as `wiggle_1344x376.yuyv`. Its times come
/// from the CSV of the same name next to it (`wiggle_1344x376.csv`) or else from `rate_hz`.
///
/// # Errors
/// No size in the name, no times, no such file, or a length that does not fit.
pub(super) fn open(path: &Path, rate_hz: Option<f64>) -> Result<Stored, SourceError> {
    let file = File::open(path).map_err(SourceError::io(path))?;
    let size_px = size_in_name(path).ok_or_else(|| {
        let reason = "its name does not end in the size of both images together, as in \
                      `wiggle_1344x376.yuyv`; rename it";
        SourceError::video(path, reason)
    })?;
    let frames = whole_frames(path, &file, size_px)?;
    let stamps = stamps::beside(path, &path.with_extension("csv"), rate_hz, frames)?;
    Ok(Stored::new(path, Pictures::Yuyv(file, size_px), stamps))
}

/// `[1344, 376]` of `wiggle_1344x376.yuyv`.
fn size_in_name(path: &Path) -> Option<[usize; 2]> {
    let stem = path.file_stem()?.to_str()?;
    let (width, height) = stem.rsplit('_').next()?.split_once('x')?;
    // As large as any camera's, so that no product of them overflows.
    let side = |text: &str| {
        let px = text.parse().ok()?;
        (1..=16_384).contains(&px).then_some(px)
    };
    Some([side(width)?, side(height)?])
}

/// How many frames are in the file.
fn whole_frames(path: &Path, file: &File, size_px: [usize; 2]) -> Result<usize, SourceError> {
    let bytes = file.metadata().map_err(SourceError::io(path))?.len();
    let frame = (size_px[0] * size_px[1] * 2) as u64;
    let frames = bytes.checked_div(frame).unwrap_or(0);
    match usize::try_from(frames) {
        Ok(count) if count > 0 && frames * frame == bytes => Ok(count),
        _ => {
            let [width, height] = size_px;
            let reason = format!(
                "{bytes} bytes are not a whole number of {width}x{height} YUYV frames ({frame} bytes \
                 each); give the size of both images together, or copy the file again"
            );
            Err(SourceError::video(path, reason))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{FrameSource, StereoSource};

    #[test]
    fn the_name_tells_the_size() {
        let size = |name: &str| size_in_name(Path::new(name));
        assert_eq!(size("sample_1344x376.yuyv"), Some([1344, 376]));
        assert_eq!(size("a/b_c/2560x720.yuyv"), Some([2560, 720]));
        for name in ["sample.yuyv", "a_1344.yuyv", "a_0x2.yuyv", "a_99999x2.yuyv"] {
            assert_eq!(size(name), None, "{name}");
        }
    }

    #[test]
    fn frames_have_the_times_beside_them_and_damage_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name| folder.path().join(name);
        // A file that is not there has no name to complain of.
        let absent = super::open(&at("sample.yuyv"), None).err().unwrap();
        assert!(!absent.to_string().contains("rename"), "{absent}");
        let (raw, csv) = (at("r_8x2.yuyv"), at("r_8x2.csv"));
        std::fs::write(&raw, (0..64).collect::<Vec<u8>>()).unwrap();
        let open = |rate_hz| super::open(&raw, rate_hz);
        let untimed = open(None).unwrap_err().to_string();
        assert!(untimed.contains("r_8x2.csv"), "{untimed}");
        let mut even = open(Some(50.0)).unwrap();
        assert_eq!(even.len(), 2);
        let second = even.read(1).unwrap().0;
        assert_eq!((second.stamp_ns, second.luma[0]), (20_000_000, 32));
        std::fs::write(&csv, "frame,sequence,monotonic_ns\n0,5,100\n1,7,250\n").unwrap();
        let timed = open(None).unwrap().read(1).unwrap().0;
        assert_eq!((timed.stamp_ns, timed.sequence), (250, 7));
        let twice = open(Some(50.0)).unwrap_err().to_string();
        assert!(twice.contains("leave out the frame rate"), "{twice}");
        // The file gets shorter while it is open.
        std::fs::write(&raw, [0; 40]).unwrap();
        let torn = even.read(1).unwrap_err().to_string();
        assert!(torn.contains("r_8x2.yuyv"), "{torn}");
        let uneven = open(None).unwrap_err().to_string();
        assert!(uneven.contains("40 bytes"), "{uneven}");
    }
}
