//! Films: the container and the pictures inside.

use crate::folder;
use camera_ingest::open_video;
use camera_ingest::source::{FrameSource, StereoSource};

/// Pictures looked at in one film.
const PICTURES: usize = 3;

/// Opens `data` as a film and decodes its first pictures.
pub fn run(data: &[u8]) {
    let path = folder().join("video.avi");
    std::fs::write(&path, data).expect("a film");
    if let Ok(mut film) = open_video(&path, None) {
        for index in 0..film.len().min(PICTURES) {
            let _ = film.read(index);
        }
    }
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
    vec![film(&[&picture, &picture]), film(&[]), film(&[torn])]
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
