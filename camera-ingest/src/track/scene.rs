//! The scene without the rope, and how noisy it is.

use super::inpainting;
use crate::frame::ImageFrame;
use crate::vectors::widest;

/// Frames that the tracker's scene is made of; a median of fewer shows the rope.
pub(super) const SCENE_FRAMES: usize = 31;
/// A still scene differs by less than what compression leaves around things that move
/// (grey levels).
const QUIETEST: f32 = 3.5;
/// Every which pixel is looked at for a whole picture's light or noise: prime, so that all
/// columns are met.
const SPARSE: usize = 97;

/// One eye's scene without what moves before it.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) image: ImageFrame,
    /// Typical distance of a still pixel from the median (root of the median
    /// square over the three channels).
    pub(super) noise: f32,
}

impl Scene {
    /// Of a film: the median over frames in which much has moved.
    pub(super) fn of(frames: &[ImageFrame]) -> Self {
        let chosen = frames_by_motion(frames, SCENE_FRAMES);
        let median = median(&chosen);
        Self {
            noise: noise_about(&median, chosen[chosen.len() / 2]).max(QUIETEST),
            image: uncovered(median, &chosen),
        }
    }

    /// Brightness of a frame relative to the scene.
    pub(super) fn gain(&self, frame: &ImageFrame) -> f32 {
        gain(&self.image, frame)
    }
}

/// The scene behind what moves in some frames, of which `count` at most are looked at.
pub(crate) fn uncovered_scene(frames: &[ImageFrame], count: usize) -> ImageFrame {
    let chosen = frames_by_motion(frames, count);
    uncovered(median(&chosen), &chosen)
}

/// Per-pixel median of some frames.
pub(crate) fn median_frame(frames: &[ImageFrame]) -> ImageFrame {
    median(&frames.iter().collect::<Vec<_>>())
}

fn median(frames: &[&ImageFrame]) -> ImageFrame {
    let mut values = vec![0; frames.len()];
    let mut plane = |pick: fn(&ImageFrame) -> &[u8]| -> Vec<u8> {
        let planes: Vec<&[u8]> = frames.iter().map(|f| pick(f)).collect();
        let mut middle = |at: usize| {
            for (value, plane) in values.iter_mut().zip(&planes) {
                *value = plane[at];
            }
            *values.select_nth_unstable(planes.len() / 2).1
        };
        (0..planes[0].len()).map(&mut middle).collect()
    };
    ImageFrame {
        luma: plane(|f| &f.luma),
        cb: plane(|f| &f.cb),
        cr: plane(|f| &f.cr),
        ..frames[0].clone()
    }
}

/// The median over some frames without what covers the scene in most of them.
fn uncovered(mut median: ImageFrame, frames: &[&ImageFrame]) -> ImageFrame {
    let lit: Vec<_> = frames.iter().map(|f| (*f, gain(&median, f))).collect();
    inpainting::uncover(&mut median, &lit);
    median
}

/// Brightness of a frame relative to the scene (automatic exposure drifts): median over a
/// sparse grid, so that what moves does not count.
fn gain(scene: &ImageFrame, frame: &ImageFrame) -> f32 {
    let mut ratios: Vec<f32> = (0..frame.luma.len())
        .step_by(SPARSE)
        .filter(|&i| (40..220).contains(&scene.luma[i]))
        .map(|i| f32::from(frame.luma[i]) / f32::from(scene.luma[i]))
        .collect();
    if ratios.len() < 20 {
        return 1.0;
    }
    let middle = ratios.len() / 2;
    let gain = *ratios.select_nth_unstable_by(middle, f32::total_cmp).1;
    gain.clamp(0.5, 2.0)
}

/// `count` frames equally spaced in how much has moved, not in time: while the
/// rope stands still it must not become part of the median.
fn frames_by_motion(frames: &[ImageFrame], count: usize) -> Vec<&ImageFrame> {
    /// Part of the frames spread over time whatever moves.
    const EVEN: f64 = 0.1;
    let mut moved = vec![0.0];
    for pair in frames.windows(2) {
        moved.push(moved[moved.len() - 1] + changed(&pair[0], &pair[1]));
    }
    let last = frames.len() - 1;
    let total = moved[last].max(1e-9);
    let place = |i: usize| (1.0 - EVEN) * moved[i] / total + EVEN * i as f64 / last as f64;
    let count = count.min(frames.len());
    let top = place(last);
    let mut next = 0;
    let mut chosen = Vec::with_capacity(count);
    for k in 0..count {
        let wanted = top * k as f64 / (count - 1) as f64;
        while next < last && place(next) < wanted - 1e-12 {
            next += 1;
        }
        chosen.push(next);
    }
    chosen.dedup();
    chosen.into_iter().map(|i| &frames[i]).collect()
}

/// Part of the pixels that changed by more than noise, on every fourth row.
fn changed(a: &ImageFrame, b: &ImageFrame) -> f64 {
    /// Grey levels, for the sum of two pixels.
    const THRESHOLD: u16 = 40;
    let (mut count, mut all) = (0_u32, 0_u32);
    let rows = |f: &ImageFrame| f.width_px * 4;
    widest(
        #[inline(always)]
        || {
            for (row_a, row_b) in a.luma.chunks(rows(a)).zip(b.luma.chunks(rows(b))) {
                let (row_a, row_b) = (&row_a[..a.width_px], &row_b[..b.width_px]);
                for (p, q) in row_a.chunks_exact(2).zip(row_b.chunks_exact(2)) {
                    let sum = |x: &[u8]| u16::from(x[0]) + u16::from(x[1]);
                    count += u32::from(sum(p).abs_diff(sum(q)) > THRESHOLD);
                    all += 1;
                }
            }
        },
    );
    f64::from(count) / f64::from(all.max(1))
}

fn noise_about(scene: &ImageFrame, frame: &ImageFrame) -> f32 {
    let width = scene.width_px;
    let square = |i: usize| {
        let [a, b] = [scene, frame].map(|f| f.ycc(i % width, i / width).map(f32::from));
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
    };
    let places = (0..frame.luma.len()).step_by(SPARSE);
    let mut squares: Vec<f32> = places.map(square).collect();
    let middle = squares.len() / 2;
    let square = *squares.select_nth_unstable_by(middle, f32::total_cmp).1;
    square.sqrt()
}
