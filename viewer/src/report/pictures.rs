//! Pictures of the film, made small enough to send.

use super::data::Picture;
use anyhow::{Context, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::BufReader;
use std::path::Path;

/// Quality of the JPEG: the drawn-in rope stays sharp.
const QUALITY: u8 = 82;
/// Most pixels of a picture; a sheet of frames has a twentieth of it.
const PIXELS_MAX: usize = 16_000_000;
/// Most bytes of a picture in the report.
const BYTES_MAX: usize = 1_500_000;

/// Pictures a run may hold.
const PICTURES: [(&str, &str); 2] = [
    (
        "wiggle.png",
        "Wiggle: keypoints of the rope as it was followed, over frames of the film",
    ),
    (
        "throw.png",
        "Throw: several exposures in one picture. Of a strike the last is at the closest approach, \
         with times since the first frame, a ring around the target, and that frame magnified",
    ),
];

/// The pictures of a run that are there.
pub(crate) fn read(run: &Path, missing: &mut Vec<String>) -> anyhow::Result<Vec<Picture>> {
    let mut pictures = Vec::new();
    for (file, title) in PICTURES {
        let path = run.join(file);
        if !path.is_file() {
            missing.push(format!("{file}: no picture of the film"));
            continue;
        }
        let jpeg = as_jpeg(&path).with_context(|| format!("picture `{}`", path.display()))?;
        if jpeg.len() > BYTES_MAX {
            missing.push(format!("{file}: too large to be put in"));
            continue;
        }
        pictures.push(Picture {
            file,
            title,
            url: format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)),
        });
    }
    Ok(pictures)
}

fn as_jpeg(path: &Path) -> anyhow::Result<Vec<u8>> {
    let file = BufReader::new(std::fs::File::open(path)?);
    let mut reader = png::Decoder::new(file).read_info()?;
    let (width, height) = reader.info().size();
    let pixels = width as usize * height as usize;
    ensure!(
        pixels <= PIXELS_MAX,
        "it has {pixels} pixels, more than {PIXELS_MAX}"
    );
    ensure!(
        reader.output_color_type() == (png::ColorType::Rgb, png::BitDepth::Eight),
        "only 8-bit RGB as `wag` writes it is read"
    );
    let mut rgb = vec![0; pixels * 3];
    reader.next_frame(&mut rgb)?;
    let side = |px: u32| u16::try_from(px).context("a side has more than 65535 pixels");
    let mut jpeg = Vec::new();
    jpeg_encoder::Encoder::new(&mut jpeg, QUALITY).encode(
        &rgb,
        side(width)?,
        side(height)?,
        jpeg_encoder::ColorType::Rgb,
    )?;
    Ok(jpeg)
}
