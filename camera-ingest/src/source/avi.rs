//! Side-by-side Motion-JPEG in a RIFF AVI.
//!
//! `RIFF 'AVI ' { LIST 'hdrl' { 'avih' ... }, LIST 'movi' { '00dc' ... } }`; every
//! `00dc` (or `00db`) chunk is one complete JPEG, chunks are padded to even
//! length. The index at the end is not needed and not read.

use std::ops::Range;
use std::path::Path;

use super::error::SourceError;
use super::stamps;
use super::stored::{Pictures, Stored};

const REMEDY: &str = "record side-by-side Motion-JPEG into an AVI, or convert to it";
const TRUNCATED: &str = "the file is truncated: copy it again or record again";

/// Opens a file, held in memory in its compressed form; times come from `csv`, or else from
/// `rate_hz`, or else from the header's frame rate.
///
/// # Errors
/// No such file, no AVI, truncated, or timestamps that do not fit.
pub(super) fn open(
    path: &Path,
    csv: Option<&Path>,
    rate_hz: Option<f64>,
) -> Result<Stored, SourceError> {
    let bytes = std::fs::read(path).map_err(SourceError::io(path))?;
    let (frame_us, chunks) = walk(path, &bytes)?;
    let stamps = match (csv, rate_hz) {
        (Some(csv), _) => stamps::read(csv, chunks.len())?,
        (None, Some(hz)) => stamps::even(chunks.len(), 1e9 / hz),
        (None, None) => stamps::even(chunks.len(), f64::from(frame_us) * 1e3),
    };
    Ok(Stored::new(path, Pictures::Avi(bytes, chunks), stamps))
}

/// Header of the chunk at `at`: four-character code and its body's range.
fn chunk(bytes: &[u8], at: usize) -> Option<([u8; 4], Range<usize>)> {
    let head = bytes.get(at..at + 8)?;
    let code = [head[0], head[1], head[2], head[3]];
    let size = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
    Some((code, at + 8..(at + 8).saturating_add(size)))
}

/// Frame time (us) and the ranges of the frames.
fn walk(path: &Path, bytes: &[u8]) -> Result<(u32, Vec<Range<usize>>), SourceError> {
    let fail = |reason: &str, remedy| SourceError::video(path, format!("{reason}; {remedy}"));
    if bytes.get(..4) != Some(b"RIFF") || bytes.get(8..12) != Some(b"AVI ") {
        return Err(fail("not a RIFF AVI file", REMEDY));
    }
    let mut frame_us = None;
    let mut frames = Vec::new();
    let (mut at, mut missing) = (12, 0);
    while let Some((code, body)) = chunk(bytes, at) {
        let list = bytes.get(body.start..body.start + 4);
        if &code == b"LIST" && (list == Some(b"movi") || list == Some(b"hdrl")) {
            // Go inside: the next chunk starts after the list's name.
            // A list that ends beyond the file is walked to where the file ends, so
            // that the error can name the frame.
            missing = missing.max(body.end.saturating_sub(bytes.len()));
            at = body.start + 4;
            continue;
        }
        if body.end > bytes.len() {
            let reason = format!("frame {} ends beyond the file", frames.len());
            return Err(fail(&reason, TRUNCATED));
        }
        match &code {
            b"avih" => {
                frame_us = bytes
                    .get(body.start..body.start + 4)
                    .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            }
            b"00dc" | b"00db" if !body.is_empty() => frames.push(body.clone()),
            _ => {}
        }
        at = body.end + body.len() % 2;
    }
    if missing > 0 {
        let reason = format!(
            "it ends {missing} bytes early, before frame {}",
            frames.len()
        );
        return Err(fail(&reason, TRUNCATED));
    }
    match (frame_us, frames.is_empty()) {
        (Some(us), false) if us > 0 => Ok((us, frames)),
        (_, true) => Err(fail("no video frames in it", REMEDY)),
        _ => Err(fail("the header has no frame rate", REMEDY)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{FrameSource, StereoSource};

    fn chunk_bytes(code: &[u8; 4], body: &[u8]) -> Vec<u8> {
        let size = u32::try_from(body.len()).unwrap();
        let mut out = [&code[..], &size.to_le_bytes(), body].concat();
        out.resize(out.len() + body.len() % 2, 0);
        out
    }

    /// AVI with the given chunks as frames.
    fn avi(frames: &[&[u8]]) -> Vec<u8> {
        let avih = chunk_bytes(b"avih", &[&16_667_u32.to_le_bytes()[..], &[0; 52]].concat());
        let hdrl = chunk_bytes(b"LIST", &[&b"hdrl"[..], &avih].concat());
        let movi: Vec<u8> = frames
            .iter()
            .flat_map(|f| chunk_bytes(b"00dc", f))
            .collect();
        let movi = chunk_bytes(b"LIST", &[&b"movi"[..], &movi].concat());
        chunk_bytes(b"RIFF", &[&b"AVI "[..], &hdrl, &movi].concat())
    }

    fn open(bytes: &[u8], csv: Option<&str>) -> Result<Stored, SourceError> {
        let folder = tempfile::tempdir().unwrap();
        let (video, stamps) = (folder.path().join("a.avi"), folder.path().join("a.csv"));
        std::fs::write(&video, bytes).unwrap();
        let csv = csv.map(|csv| std::fs::write(&stamps, csv).unwrap());
        super::open(&video, csv.map(|()| stamps.as_path()), None)
    }

    fn refusal(bytes: &[u8], csv: Option<&str>) -> String {
        open(bytes, csv).unwrap_err().to_string()
    }

    #[test]
    fn frames_are_found_and_damage_is_named() {
        let mut source = open(&avi(&[b"abc", b"defg"]), None).unwrap();
        assert_eq!(source.len(), 2);
        assert_eq!(&*source.picture(1).unwrap().1, b"defg");
        assert_eq!(source.stamps[1].stamp_ns, 16_667_000);
        let damaged = source.read(1).unwrap_err().to_string();
        assert!(
            damaged.contains("frame 1") && damaged.contains("record again"),
            "{damaged}"
        );
        let beyond = source.read(2).unwrap_err().to_string();
        assert!(
            beyond.contains("frame 2 requested, but it has 2"),
            "{beyond}"
        );
    }

    #[test]
    fn truncation_and_other_files_are_refused() {
        let whole = avi(&[b"abc", b"defg"]);
        let cut = refusal(&whole[..whole.len() - 3], None);
        assert!(
            cut.contains("truncated") && cut.contains("frame 1 ends"),
            "{cut}"
        );
        let other = refusal(b"RIFF....WAVEfmt ", None);
        assert!(other.contains("not a RIFF AVI"), "{other}");
        let empty = refusal(&avi(&[]), None);
        assert!(empty.contains("no video frames"), "{empty}");
        let second = refusal(&whole[..whole.len() - 13], None);
        assert!(second.contains("before frame 1"), "{second}");
        // Whatever is cut off, there is an answer and no panic.
        for end in 0..whole.len() {
            let _ = open(&whole[..end], None);
        }
    }

    #[test]
    fn timestamps_must_fit() {
        let video = avi(&[b"abc", b"defg"]);
        let csv = "frame,sequence,monotonic_ns\n0,5,100\n1,7,250\n";
        let source = open(&video, Some(csv)).unwrap();
        assert_eq!(
            (source.stamps[1].sequence, source.stamps[1].stamp_ns),
            (7, 250)
        );
        for (csv, what) in [
            ("h\n0,5,100\n", "1 rows, but the video has 2"),
            ("h\n0,5,100\n1,6,100\n", "do not increase"),
            ("h\n0,x,100\n1,6,200\n", "line 2"),
            ("h\n0,5,100\n2,6,200\n", "frame 2 where 1 is due"),
        ] {
            let message = refusal(&video, Some(csv));
            assert!(message.contains(what), "{message}");
        }
    }
}
