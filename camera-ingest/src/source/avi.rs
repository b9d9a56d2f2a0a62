//! Side-by-side Motion-JPEG in a RIFF AVI.
//!
//! `RIFF 'AVI ' { LIST 'hdrl' { 'avih' ... }, LIST 'movi' { '00dc' ... } }`; every
//! `00dc` (or `00db`) chunk is one complete JPEG, chunks are padded to even
//! length. The index at the end is not needed and not read.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::error::SourceError;
use super::stamps::{self, Stamp};
use super::stored::{Coding, Stored};

const REMEDY: &str = "record side-by-side Motion-JPEG into an AVI, or convert to it";
const TRUNCATED: &str = "the file is truncated: copy it again or record again";

/// An AVI file held in memory in its compressed form.
#[derive(Debug)]
pub struct AviSource {
    path: PathBuf,
    bytes: Vec<u8>,
    chunks: Vec<Range<usize>>,
    stamps: Vec<Stamp>,
    /// For decoding.
    room: Vec<u8>,
}

impl AviSource {
    /// Opens a file; times come from `timestamps` or else from the header's
    /// frame rate.
    ///
    /// # Errors
    /// No such file, no AVI, truncated, or timestamps that do not fit.
    pub fn open(path: &Path, timestamps: Option<&Path>) -> Result<Self, SourceError> {
        let bytes = std::fs::read(path).map_err(SourceError::io(path))?;
        let (frame_us, chunks) = walk(path, &bytes)?;
        let stamps = match timestamps {
            Some(csv) => stamps::read(csv, chunks.len())?,
            None => stamps::even(chunks.len(), f64::from(frame_us) * 1e3),
        };
        Ok(Self {
            path: path.to_owned(),
            bytes,
            chunks,
            stamps,
            room: Vec::new(),
        })
    }

    /// The same frames at another rate than the header's.
    #[must_use]
    pub fn at_rate(mut self, rate_hz: f64) -> Self {
        self.stamps = stamps::even(self.chunks.len(), 1e9 / rate_hz);
        self
    }
}

impl Stored for AviSource {
    fn path(&self) -> &Path {
        &self.path
    }

    fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    fn picture(&self, index: usize) -> Result<(Coding, Cow<'_, [u8]>), SourceError> {
        let jpeg = &self.bytes[self.chunks[index].clone()];
        Ok((Coding::Jpeg, Cow::Borrowed(jpeg)))
    }

    fn room(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.room)
    }

    fn keep(&mut self, room: Vec<u8>) {
        self.room = room;
    }
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
    let fail = |reason: String, remedy| SourceError::Container {
        path: path.to_owned(),
        reason,
        remedy,
    };
    if bytes.get(..4) != Some(b"RIFF") || bytes.get(8..12) != Some(b"AVI ") {
        return Err(fail("not a RIFF AVI file".to_owned(), REMEDY));
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
            return Err(fail(
                format!("frame {} ends beyond the file", frames.len()),
                TRUNCATED,
            ));
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
        return Err(fail(reason, TRUNCATED));
    }
    match (frame_us, frames.is_empty()) {
        (Some(us), false) if us > 0 => Ok((us, frames)),
        (_, true) => Err(fail("no video frames in it".to_owned(), REMEDY)),
        _ => Err(fail("the header has no frame rate".to_owned(), REMEDY)),
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

    fn open(bytes: &[u8], csv: Option<&str>) -> Result<AviSource, SourceError> {
        let folder = tempfile::tempdir().unwrap();
        let (video, stamps) = (folder.path().join("a.avi"), folder.path().join("a.csv"));
        std::fs::write(&video, bytes).unwrap();
        let csv = csv.map(|csv| std::fs::write(&stamps, csv).unwrap());
        AviSource::open(&video, csv.map(|()| stamps.as_path()))
    }

    fn refusal(bytes: &[u8], csv: Option<&str>) -> String {
        open(bytes, csv).unwrap_err().to_string()
    }

    #[test]
    fn frames_are_found_and_damage_is_named() {
        let mut source = open(&avi(&[b"abc", b"defg"]), None).unwrap();
        assert_eq!(source.len(), 2);
        assert_eq!(&source.bytes[source.chunks[1].clone()], b"defg");
        assert_eq!(source.stamps[1].stamp_ns, 16_667_000);
        let damaged = source.read(1).unwrap_err().to_string();
        assert!(
            damaged.contains("frame 1") && damaged.contains("record again"),
            "{damaged}"
        );
        assert!(matches!(
            source.read(2),
            Err(SourceError::OutOfRange { len: 2, .. })
        ));
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
