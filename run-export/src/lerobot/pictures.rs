//! The pictures of an episode: bytes as they were recorded, and what they look like.

use super::statistics::Distribution;
use anyhow::{Context, Result, ensure};
use camera_ingest::ImageFrame;
use parquet::data_type::ByteArray;

/// The picture that each frame shows.
#[derive(Debug)]
pub(super) struct Pictures {
    /// Width and height (px).
    pub(super) size_px: [usize; 2],
    /// A JPEG for each frame; frames that show the same one share its bytes.
    pub(super) jpegs: Vec<ByteArray>,
    /// How often each level of red, green and blue occurs in all frames.
    levels: [[u64; 256]; 3],
}

impl Pictures {
    /// Decodes the JPEG that each frame shows.
    ///
    /// # Errors
    /// One of them is damaged, or of another size than the first.
    pub(super) fn of(shown: &[(u64, &[u8])]) -> Result<Self> {
        let mut all = Self {
            size_px: [0; 2],
            jpegs: Vec::new(),
            levels: [[0; 256]; 3],
        };
        for same in shown.chunk_by(|a, b| a.0 == b.0) {
            let number = all.jpegs.len();
            let fail = || format!("the picture of frame {number}");
            let (stamp_ns, jpeg) = same[0];
            let picture = ImageFrame::from_jpeg(jpeg, stamp_ns, 0).with_context(fail)?;
            let size_px = [picture.width_px, picture.height_px];
            if number == 0 {
                all.size_px = size_px;
            }
            ensure!(
                size_px == all.size_px,
                "the picture of frame {number} has {size_px:?} px, the first one {:?} px",
                all.size_px
            );
            all.count(&picture, same.len() as u64);
            let bytes = ByteArray::from(jpeg);
            all.jpegs.extend(std::iter::repeat_n(bytes, same.len()));
        }
        Ok(all)
    }

    /// Counts the colours of a picture that so many frames show.
    fn count(&mut self, picture: &ImageFrame, times: u64) {
        for pixel in picture.to_rgb().chunks_exact(3) {
            for (levels, level) in self.levels.iter_mut().zip(pixel) {
                levels[usize::from(*level)] += times;
            }
        }
    }

    /// Red, green and blue of all pixels of all frames.
    pub(super) fn colours(&self) -> Vec<Distribution> {
        self.levels.iter().map(Distribution::of_levels).collect()
    }
}
