//! Films: the container and the pictures inside; pictures in files of their own.

use crate::folder;
use camera_ingest::source::{FrameSource, StereoSource};
use camera_ingest::{StereoFrame, open_video};

/// Pictures looked at in one film.
const PICTURES: usize = 3;

/// Reads `data` as a picture, opens it as a film and decodes its first pictures.
pub fn run(data: &[u8]) {
    let _ = StereoFrame::from_png(data, 0, 0);
    let _ = StereoFrame::from_png(&with_right_sums(data), 0, 0);
    let _ = StereoFrame::from_jpeg(data, 0, 0);
    let path = folder().join("video.avi");
    std::fs::write(&path, data).expect("a film");
    if let Ok(mut film) = open_video(&path, None) {
        for index in 0..film.len().min(PICTURES) {
            let _ = film.read(index);
        }
    }
}

/// The chunks of a PNG with the checksums that belong to them.
fn with_right_sums(data: &[u8]) -> Vec<u8> {
    let mut bytes = data.to_vec();
    let mut at = PNG_MAGIC.len();
    while let Some(head) = bytes.get(at..at + 8) {
        let len = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let Some(summed) = bytes.get(at + 4..(at + 8).saturating_add(len)) else {
            break;
        };
        let sum = crc32fast::hash(summed).to_be_bytes();
        at += 8 + len;
        let Some(place) = bytes.get_mut(at..at + 4) else {
            break;
        };
        place.copy_from_slice(&sum);
        at += 4;
    }
    bytes
}

fn chunk(code: &[u8; 4], body: &[u8]) -> Vec<u8> {
    let len = u32::try_from(body.len()).unwrap().to_le_bytes();
    let mut out = [code.as_slice(), &len, body].concat();
    out.resize(out.len() + out.len() % 2, 0);
    out
}

/// A film of two pictures, and one without any.
pub fn seeds() -> Vec<Vec<u8>> {
    let film = |pictures: &[&[u8]]| {
        let mut header = vec![0; 56];
        header[..4].copy_from_slice(&16_667_u32.to_le_bytes());
        let heads = [b"hdrl".as_slice(), &chunk(b"avih", &header)].concat();
        let mut movie = b"movi".to_vec();
        for picture in pictures {
            movie.extend(chunk(b"00dc", picture));
        }
        let lists = [chunk(b"LIST", &heads), chunk(b"LIST", &movie)].concat();
        chunk(b"RIFF", &[b"AVI ".as_slice(), &lists].concat())
    };
    let picture = jpeg();
    let torn = &picture[..picture.len() / 2];
    vec![
        film(&[&picture, &picture]),
        film(&[]),
        film(&[torn]),
        PNG.to_vec(),
        picture,
    ]
}

/// A picture of 16 x 8 grey pixels: two blocks without anything in them.
fn jpeg() -> Vec<u8> {
    let segment = |mark: u8, body: &[u8]| {
        let len = u16::try_from(body.len() + 2).unwrap().to_be_bytes();
        [&[0xFF, mark], len.as_slice(), body].concat()
    };
    // One code of one bit for each of direct and alternating parts.
    let codes = |class: u8| [&[class << 4, 1], [0; 15].as_slice(), &[0]].concat();
    [
        vec![0xFF, 0xD8],
        segment(0xDB, &[[0].as_slice(), &[16; 64]].concat()),
        segment(0xC0, &[8, 0, 8, 0, 16, 1, 1, 0x11, 0]),
        segment(0xC4, &codes(0)),
        segment(0xC4, &codes(1)),
        segment(0xDA, &[1, 1, 0, 0, 63, 0]),
        vec![0x0F, 0xFF, 0xD9],
    ]
    .concat()
}

/// How every PNG begins.
const PNG_MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// 16 x 1 black pixels.
const PNG: &[u8] =
    b"\x89PNG\x0d\x0a\x1a\x0a\x00\x00\x00\x0dIHDR\x00\x00\x00\x10\x00\x00\x00\x01\x08\x00\x00\
    \x00\x00\xf2\x12q\x83\x00\x00\x00\x0bIDATx\x9cc`@\x03\x00\x00\x11\x00\x01\xee&\x06O\x00\
    \x00\x00\x00IEND\xaeB`\x82";
