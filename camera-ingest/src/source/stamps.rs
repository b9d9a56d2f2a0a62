//! When each frame of a recording was taken: a CSV next to it, or an even rate.

use std::path::Path;

use super::error::SourceError;

/// Number and time of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    pub(super) sequence: u64,
    pub(super) stamp_ns: u64,
}

/// `frames` stamps, one every `frame_ns`, the first at 0.
pub(super) fn even(frames: usize, frame_ns: f64) -> Vec<Stamp> {
    (0..frames as u64)
        .map(|sequence| Stamp {
            sequence,
            stamp_ns: (sequence as f64 * frame_ns).round() as u64,
        })
        .collect()
}

/// Stamps of a recording that does not carry any: from `csv` if it is there, else
/// even ones at `rate_hz`.
///
/// # Errors
/// Neither is known, or both; or the CSV does not fit.
pub(super) fn beside(
    recording: &Path,
    csv: &Path,
    rate_hz: Option<f64>,
    frames: usize,
) -> Result<Vec<Stamp>, SourceError> {
    match (csv.exists(), rate_hz) {
        (true, None) => read(csv, frames),
        (false, Some(hz)) => Ok(even(frames, 1e9 / hz)),
        (true, Some(hz)) => Err(twice(recording, csv, hz)),
        (false, None) => {
            let reason = format!(
                "its frame times are unknown; give the frame rate, or put {} there with rows \
                 `frame,sequence,monotonic_ns`",
                csv.display()
            );
            Err(SourceError::video(recording, reason))
        }
    }
}

/// The times of a recording are given twice.
pub(super) fn twice(recording: &Path, csv: &Path, rate_hz: f64) -> SourceError {
    let csv = csv.display();
    let reason =
        format!("{csv} contains its frame times; leave out the frame rate of {rate_hz} per second");
    SourceError::video(recording, reason)
}

/// Rows `frame,sequence,monotonic_ns`, one a frame.
pub(super) fn read(path: &Path, frames: usize) -> Result<Vec<Stamp>, SourceError> {
    let text = std::fs::read_to_string(path).map_err(SourceError::io(path))?;
    let fail = |line: usize, reason: String| SourceError::timestamps(path, line, reason);
    let mut stamps: Vec<Stamp> = Vec::new();
    for (index, row) in text.lines().enumerate().skip(1) {
        if row.trim().is_empty() {
            continue;
        }
        let numbers: Vec<u64> = row
            .split(',')
            .map(|c| c.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|e| format!("{row:?} is not three whole numbers ({e})"))
            .map_err(|reason| fail(index + 1, reason))?;
        let [frame, sequence, stamp_ns] = numbers[..] else {
            return Err(fail(index + 1, format!("{} columns", numbers.len())));
        };
        if frame != stamps.len() as u64 {
            let reason = format!("frame {frame} where {} is due", stamps.len());
            return Err(fail(index + 1, reason));
        }
        if stamps.last().is_some_and(|last| last.stamp_ns >= stamp_ns) {
            return Err(fail(index + 1, "times do not increase".to_owned()));
        }
        stamps.push(Stamp { sequence, stamp_ns });
    }
    if stamps.len() == frames {
        Ok(stamps)
    } else {
        let reason = format!("{} rows, but the video has {frames} frames", stamps.len());
        Err(fail(stamps.len() + 1, reason))
    }
}
