//! The scene without the rope, and how noisy it is.

use super::covered;
use crate::frame::EyeFrame;
use crate::vectors::widest;

/// Median image and the noise about it.
#[derive(Debug, Clone)]
pub(super) struct Background {
    pub(super) image: EyeFrame,
    /// Typical distance of a still pixel from the median (root of the median
    /// square over the three channels).
    pub(super) noise: f32,
}

impl Background {
    /// Per-pixel median over the chosen frames.
    pub(super) fn median(frames: &[EyeFrame], chosen: &[usize]) -> Self {
        let plane = |pick: fn(&EyeFrame) -> &Vec<u8>| -> Vec<u8> {
            let planes: Vec<&[u8]> = chosen
                .iter()
                .map(|&i| pick(&frames[i]).as_slice())
                .collect();
            medians(&planes)
        };
        let image = EyeFrame {
            luma: plane(|f| &f.luma),
            cb: plane(|f| &f.cb),
            cr: plane(|f| &f.cr),
            ..frames[chosen[0]].clone()
        };
        let noise = noise_about(&image, &frames[chosen[chosen.len() / 2]]);
        Self { image, noise }
    }

    /// Per-pixel median over the chosen frames, without what covers the scene in most.
    pub(super) fn uncovered(frames: &[EyeFrame], chosen: &[usize]) -> Self {
        let mut background = Self::median(frames, chosen);
        let lit = |i: &usize| (&frames[*i], background.gain(&frames[*i]));
        let lit: Vec<_> = chosen.iter().map(lit).collect();
        covered::uncover(&mut background.image, &lit);
        background
    }

    /// Brightness of a frame relative to the background (automatic exposure
    /// drifts): median over a sparse grid, so that what moves does not count.
    pub(super) fn gain(&self, frame: &EyeFrame) -> f32 {
        let mut ratios: Vec<f32> = sparse(frame.luma.len())
            .filter(|&i| (40..220).contains(&self.image.luma[i]))
            .map(|i| f32::from(frame.luma[i]) / f32::from(self.image.luma[i]))
            .collect();
        if ratios.len() < 20 {
            return 1.0;
        }
        let middle = ratios.len() / 2;
        let gain = *ratios.select_nth_unstable_by(middle, f32::total_cmp).1;
        gain.clamp(0.5, 2.0)
    }
}

/// Median of every place over some planes of one length.
fn medians(planes: &[&[u8]]) -> Vec<u8> {
    /// Places sorted side by side, which a processor does with a few of its vectors.
    const BLOCK: usize = 64;
    let network = sorting_network(planes.len());
    let mut values = vec![[0_u8; BLOCK]; planes.len()];
    let mut out = vec![0; planes[0].len()];
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        for (value, plane) in values.iter_mut().zip(planes) {
            value[..out.len()].copy_from_slice(&plane[block * BLOCK..][..out.len()]);
        }
        for &[low, high] in &network {
            let (before, after) = values.split_at_mut(high);
            for (a, b) in before[low].iter_mut().zip(&mut after[0]) {
                (*a, *b) = ((*a).min(*b), (*a).max(*b));
            }
        }
        out.copy_from_slice(&values[planes.len() / 2][..out.len()]);
    }
    out
}

/// Pairs of places that, exchanged one after the other where the first is the greater,
/// sort `count` values: Batcher's merge exchange (Knuth, volume 3, 5.2.2, algorithm M).
fn sorting_network(count: usize) -> Vec<[usize; 2]> {
    let top = count.next_power_of_two() / 2;
    let mut pairs = Vec::new();
    let mut p = top;
    while p > 0 {
        let (mut q, mut r, mut d) = (top, 0, p);
        loop {
            pairs.extend((0..count - d).filter(|i| i & p == r).map(|i| [i, i + d]));
            if q == p {
                break;
            }
            (d, q, r) = (q - p, q / 2, p);
        }
        p /= 2;
    }
    pairs
}

/// `count` frames equally spaced in how much has moved, not in time: while the
/// rope stands still it must not become part of the median.
pub(super) fn frames_by_motion(frames: &[EyeFrame], count: usize) -> Vec<usize> {
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
    chosen
}

/// Part of the pixels that changed by more than noise, on every fourth row.
fn changed(a: &EyeFrame, b: &EyeFrame) -> f64 {
    /// Grey levels, for the sum of two pixels.
    const THRESHOLD: u16 = 40;
    let (mut count, mut all) = (0_u32, 0_u32);
    let rows = |f: &EyeFrame| f.width_px * 4;
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

/// Every 97th pixel: prime, so that it meets all columns.
fn sparse(len: usize) -> impl Iterator<Item = usize> {
    (0..len).step_by(97)
}

fn noise_about(image: &EyeFrame, frame: &EyeFrame) -> f32 {
    let width = image.width_px;
    let mut squares: Vec<f32> = sparse(frame.luma.len())
        .map(|i| {
            let (a, b) = (
                image.ycc(i % width, i / width),
                frame.ycc(i % width, i / width),
            );
            (0..3)
                .map(|k| (f32::from(a[k]) - f32::from(b[k])).powi(2))
                .sum()
        })
        .collect();
    let middle = squares.len() / 2;
    let square = *squares.select_nth_unstable_by(middle, f32::total_cmp).1;
    square.sqrt().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_those_of_sorting() {
        // Any numbers do; these are spread and repeat each other.
        let value = |plane: usize, at: usize| (plane * 97 + at * at * 31 + plane * at * 7) as u8;
        for count in 1..=40 {
            let planes: Vec<Vec<u8>> = (0..count)
                .map(|plane| (0..150).map(|at| value(plane, at)).collect())
                .collect();
            let all: Vec<&[u8]> = planes.iter().map(Vec::as_slice).collect();
            let found = medians(&all);
            for at in 0..150 {
                let mut sorted: Vec<u8> = planes.iter().map(|p| p[at]).collect();
                sorted.sort_unstable();
                assert_eq!(found[at], sorted[count / 2], "{count} planes, place {at}");
            }
        }
    }
}
