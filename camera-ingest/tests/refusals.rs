//! Videos that cannot be used are refused, with the frame and what to do.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod recording;

use std::path::PathBuf;

use camera_ingest::source::FrameSource;
use camera_ingest::{ImageFrame, TrackError, open_video};
use recording::{Wiggle, folder, median};

const FRAMES: usize = 60;

fn refusal(wiggle: &Wiggle) -> TrackError {
    wiggle.track().unwrap_err()
}

/// Takes the rope out of the frames from `first` on: only the scene is left.
fn emptied(mut wiggle: Wiggle, first: usize) -> Wiggle {
    let scene = median(&wiggle.frames);
    for frame in &mut wiggle.frames[first..] {
        *frame = ImageFrame {
            stamp_ns: frame.stamp_ns,
            sequence: frame.sequence,
            ..scene.clone()
        };
    }
    wiggle
}

#[test]
fn no_rope() {
    let Some(wiggle) = Wiggle::read_first("a1", FRAMES) else {
        return;
    };
    let error = refusal(&emptied(wiggle, 0));
    assert!(matches!(error, TrackError::NoRope { .. }), "{error}");
    assert!(error.to_string().contains("camera.toml"), "{error}");
    assert!(!error.is_input(), "{error}");
}

#[test]
fn a_rope_that_goes_away() {
    let Some(wiggle) = Wiggle::read_first("a1", FRAMES) else {
        return;
    };
    let error = refusal(&emptied(wiggle, 20));
    let TrackError::NoRope { evident, least } = error else {
        panic!("{error}");
    };
    // It is nowhere in most frames.
    assert!(evident[2] < least[2] / 2.0, "{error}");
}

#[test]
fn a_camera_that_looks_elsewhere() {
    let Some(mut wiggle) = Wiggle::read_first("a1", FRAMES) else {
        return;
    };
    wiggle.camera.p_w_cam_m.x += 3.0;
    let error = refusal(&wiggle).to_string();
    assert!(
        error.contains("frame 0") && error.contains("the clamp should be at"),
        "{error}"
    );
}

#[test]
fn another_size_and_too_few_frames() {
    let Some(mut wiggle) = Wiggle::read_first("a1", FRAMES) else {
        return;
    };
    let small = &mut wiggle.frames[5];
    small.height_px -= 2;
    small.luma.truncate(small.width_px * small.height_px);
    small.cb.truncate(small.width_px * small.height_px / 2);
    small.cr.truncate(small.width_px * small.height_px / 2);
    let error = refusal(&wiggle).to_string();
    assert!(error.contains("frame 5 is [672, 374] px"), "{error}");
    wiggle.frames.truncate(1);
    let error = refusal(&wiggle).to_string();
    assert!(
        error.ends_with("frames is 1, it must be at least 8"),
        "{error}"
    );
}

/// Where the bodies of an AVI's frames lie.
fn bodies(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let movi = bytes.windows(4).position(|w| w == b"movi").unwrap() + 4;
    let mut at = movi;
    let mut found = Vec::new();
    while bytes.get(at..at + 4) == Some(b"00dc") {
        let size = u32::from_le_bytes(bytes[at + 4..at + 8].try_into().unwrap()) as usize;
        found.push(at + 8..at + 8 + size);
        at += 8 + size + size % 2;
    }
    found
}

fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("refusal-{}-{name}.avi", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_truncated_video() {
    let Some(folder) = folder("a2") else { return };
    let bytes = std::fs::read(folder.join("video.avi")).unwrap();
    let frame = bodies(&bytes)[123].clone();
    let path = written("cut", &bytes[..frame.start + 1000]);
    let error = open_video(&path, None).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    assert!(
        error.contains("frame 123 ends beyond the file") && error.contains("copy it again"),
        "{error}"
    );
}

#[test]
fn corrupted_pictures() {
    let Some(folder) = folder("a2") else { return };
    let whole = std::fs::read(folder.join("video.avi")).unwrap();
    let body = bodies(&whole)[17].clone();
    let middle = body.start + body.len() / 2;
    type Damage<'a> = (&'a str, &'a dyn Fn(&mut [u8]));
    let damages: [Damage<'_>; 4] = [
        ("zeros", &|b| b[middle..middle + 400].fill(0)),
        ("ones", &|b| b[middle..middle + 400].fill(0xff)),
        ("noise", &|b| {
            for (i, x) in b[middle..middle + 400].iter_mut().enumerate() {
                *x ^= (i * i + 7 * i + 1) as u8;
            }
        }),
        ("head", &|b| b[body.start..body.start + 40].fill(0x55)),
    ];
    for (name, damage) in damages {
        let mut bytes = whole.clone();
        damage(&mut bytes);
        let path = written(name, &bytes);
        let mut video = open_video(&path, None).unwrap();
        assert!(video.read_left(16).is_ok(), "{name}");
        let read = video.read_left(17).map(|_| ());
        std::fs::remove_file(&path).unwrap();
        let error = read.expect_err(name).to_string();
        assert!(error.contains("frame 17"), "{name}: {error}");
    }
}
