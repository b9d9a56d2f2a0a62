//! Where the rope lies across a predicted curve, in every frame.
//!
//! Evidence is sampled along the curve's normals; a search over all nodes together finds
//! the offsets of most contrast without jumping, a centroid their fractions of a pixel.
//! Offsets change slowly along the rope and mostly slowly from frame to frame, so they are
//! smoothed in both, each node with the weight of its contrast; what is quicker is kept as far as
//! a rope's bending goes.

use super::curve::{Pixel, normals};

/// An offset (px) and its weight, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offset {
    pub(super) px: f64,
    pub(super) weight: f64,
}

impl Offset {
    /// Nothing seen.
    pub(super) const NONE: Self = Self {
        px: 0.0,
        weight: 0.0,
    };
}

/// Weight of what lies beside the rope against it.
const FLANKS: f32 = 0.7;
/// Largest jump between neighbouring nodes (px).
const JUMP_PX: usize = 3;
/// Stiffness of quick motion over time, as a part of that of slow motion.
const QUICK: f64 = 0.04;
/// Pull towards the prediction where nothing is seen.
const PULL: f64 = 1e-3;

/// How offsets are looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProfileSearch {
    /// To either side (px).
    pub(super) reach: usize,
    /// Half the rope's width (px).
    pub(super) half_width_px: f64,
    /// Price of a jump, per squared pixel.
    pub(super) jump: f32,
}

/// Offsets of all nodes of one frame, along the curve's normals. `at` gives evidence (0 to
/// 1) at a place.
pub(super) fn offsets(
    points: &[Pixel],
    look: ProfileSearch,
    at: impl Fn(Pixel) -> f32,
) -> Vec<Offset> {
    let width = 2 * look.reach + 1;
    let mut profiles = Vec::with_capacity(points.len() * width);
    for (p, n) in points.iter().zip(normals(points)) {
        let places = (0..width).map(|d| p + n * (d as f64 - look.reach as f64));
        profiles.extend(places.map(&at));
    }
    let half = look.half_width_px.round().max(1.0) as usize;
    let gains: Vec<f32> = profiles
        .chunks_exact(width)
        .flat_map(|profile| (0..width).map(|d| contrast(profile, d, half)))
        .collect();
    let path = best_path(&gains, width, look.jump);
    let centroid = |(node, d): (usize, usize)| {
        let (low, high) = (d.saturating_sub(half + 2), (d + half + 2).min(width - 1));
        let (mut sum, mut moment) = (1e-6, 0.0);
        for k in low..=high {
            let e = f64::from(profiles[node * width + k]);
            sum += e;
            moment += e * (k as f64 - look.reach as f64);
        }
        Offset {
            px: moment / sum,
            weight: f64::from(gains[node * width + d].max(0.0)),
        }
    };
    path.into_iter().enumerate().map(centroid).collect()
}

/// Mean over a band of the rope's width, less that of its flanks.
fn contrast(profile: &[f32], at: usize, half: usize) -> f32 {
    let mean = |low: isize, high: isize| {
        let last = profile.len() as isize - 1;
        let (low, high) = (low.max(0), high.min(last));
        if low > high {
            return 0.0;
        }
        let part = &profile[low as usize..=high as usize];
        part.iter().sum::<f32>() / part.len() as f32
    };
    let (at, half) = (at as isize, half as isize);
    let flanks = mean(at - 2 * half - 2, at - half - 2) + mean(at + half + 2, at + 2 * half + 2);
    mean(at - half, at + half) - FLANKS * 0.5 * flanks
}

/// The column of each row that together gain most, jumps paid for (Viterbi).
fn best_path(gains: &[f32], width: usize, jump: f32) -> Vec<usize> {
    let rows = gains.len() / width;
    let mut sums = gains[..width].to_vec();
    let mut came_from = vec![0; rows * width];
    for row in 1..rows {
        let next = (0..width).map(|d| {
            let near = d.saturating_sub(JUMP_PX)..=(d + JUMP_PX).min(width - 1);
            let value = |from: usize| sums[from] - jump * (from as f32 - d as f32).powi(2);
            let best = near.max_by(|a, b| value(*a).total_cmp(&value(*b)));
            let best = best.unwrap_or(d);
            came_from[row * width + d] = best;
            value(best) + gains[row * width + d]
        });
        sums = next.collect();
    }
    let mut path = vec![0; rows];
    let mut d = (0..width)
        .max_by(|a, b| sums[*a].total_cmp(&sums[*b]))
        .unwrap_or(0);
    for row in (0..rows).rev() {
        path[row] = d;
        d = came_from[row * width + d];
    }
    path
}

/// Smooths values over their order, each with its weight: second differences cost
/// `stiffness` (Whittaker's smoother), a value without weight is drawn to 0 by `pull`.
pub(super) fn smoothed(values: &[Offset], stiffness: f64, pull: f64) -> Vec<Offset> {
    const DIFFERENCE: [f64; 3] = [1.0, -2.0, 1.0];
    let count = values.len();
    if count < 3 {
        return values.to_vec();
    }
    // Row i holds the elements (i, i), (i, i - 1), (i, i - 2).
    let mut matrix: Vec<[f64; 3]> = values.iter().map(|v| [v.weight + pull, 0.0, 0.0]).collect();
    let mut x: Vec<f64> = values.iter().map(|v| v.weight * v.px).collect();
    for start in 0..count - 2 {
        for i in 0..3 {
            for k in 0..=i {
                matrix[start + i][i - k] += stiffness * DIFFERENCE[i] * DIFFERENCE[k];
            }
        }
    }
    // Cholesky, forwards and backwards.
    for i in 0..count {
        for d in (0..=2.min(i)).rev() {
            let k = i - d;
            let known: f64 = (d + 1..=2.min(i))
                .map(|e| matrix[i][e] * matrix[k][e - d])
                .sum();
            let left = matrix[i][d] - known;
            matrix[i][d] = if d == 0 {
                left.max(1e-12).sqrt()
            } else {
                left / matrix[k][0]
            };
        }
        let known: f64 = (1..=2.min(i)).map(|d| matrix[i][d] * x[i - d]).sum();
        x[i] = (x[i] - known) / matrix[i][0];
    }
    for i in (0..count).rev() {
        let reach = 2.min(count - 1 - i);
        let known: f64 = (1..=reach).map(|d| matrix[i + d][d] * x[i + d]).sum();
        x[i] = (x[i] - known) / matrix[i][0];
    }
    x.into_iter()
        .zip(values)
        .map(|(px, v)| Offset { px, ..*v })
        .collect()
}

/// How offsets are smoothed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Smoothing {
    /// Stiffness over time.
    pub(super) over_time: f64,
    /// Stiffness along the rope.
    pub(super) along: f64,
    /// How far quick motion may go beyond what is smoothed over time (px).
    pub(super) quick_px: f64,
}

/// Smooths the offsets of all frames, over time and then along the rope.
pub(super) fn smooth_field(field: &mut [Vec<Offset>], smoothing: Smoothing) {
    let Smoothing {
        over_time,
        along,
        quick_px,
    } = smoothing;
    let nodes = field.first().map_or(0, Vec::len);
    for node in 0..nodes {
        let column: Vec<Offset> = field.iter().map(|f| f[node]).collect();
        let slow = smoothed(&column, over_time, PULL);
        // In films of 60 Hz the slow part lacks up to two thirds of a stiff rope's bending of 8
        // to 16 Hz. A tenth of a pixel of it makes the rope look like another one.
        let beyond = column.iter().zip(&slow).map(|(seen, slow)| Offset {
            px: (seen.px - slow.px).clamp(-quick_px, quick_px),
            ..*seen
        });
        let quick = smoothed(&beyond.collect::<Vec<_>>(), QUICK * over_time, PULL);
        for ((frame, slow), quick) in field.iter_mut().zip(slow).zip(quick) {
            frame[node].px = slow.px + quick.px;
        }
    }
    for frame in field {
        *frame = smoothed(frame, along, PULL);
    }
}

/// A curve whose points are moved along its normals (px).
pub(super) fn moved(points: &[Pixel], px: impl Iterator<Item = f64>) -> Vec<Pixel> {
    let places = points.iter().zip(normals(points)).zip(px);
    places.map(|((p, n), px)| p + n * px).collect()
}

#[cfg(test)]
mod tests {
    use super::super::read::{NODES, SECOND};
    use super::*;
    use core::f64::consts::TAU;

    #[test]
    fn a_band_beside_the_curve_is_found_to_a_tenth_of_a_pixel() {
        let points: Vec<Pixel> = (0..40)
            .map(|i| Pixel::new(50.0, 3.0 * f64::from(i)))
            .collect();
        // A band 6 px wide, 4.3 px aside, with soft edges; a spot elsewhere.
        let band = |p: Pixel| {
            let stray = (p.x - 42.0).abs() < 2.0 && (p.y - 60.0).abs() < 5.0;
            let edge = (3.5 - (p.x - 54.3).abs()).clamp(0.0, 1.0) as f32;
            if stray { 1.0 } else { edge }
        };
        let look = ProfileSearch {
            reach: 12,
            half_width_px: 3.0,
            jump: 0.05,
        };
        // The normals of a curve that runs down point to the left.
        for offset in offsets(&points, look, band) {
            assert!(
                (offset.px + 4.3).abs() < 0.1 && offset.weight > 0.8,
                "{offset:?}"
            );
        }
    }

    #[test]
    fn what_is_not_seen_is_filled_from_its_neighbours() {
        let value = |i: usize| 0.5 * i as f64;
        let offset = |i: usize| {
            let is_seen = !(10..14).contains(&i);
            let (px, weight) = if is_seen {
                (value(i), 1.0)
            } else {
                (-20.0, 0.0)
            };
            Offset { px, weight }
        };
        let values: Vec<Offset> = (0..30).map(offset).collect();
        // A straight line has no second differences.
        for (i, v) in smoothed(&values, 2.0, 1e-9).iter().enumerate() {
            assert!((v.px - value(i)).abs() < 1e-5, "{i}: {v:?}");
        }
    }

    #[test]
    fn an_outlier_moves_a_node_by_less_than_quick_motion_may() {
        let seen = |frame: usize| Offset {
            px: if frame == 50 { 8.0 } else { 0.0 },
            weight: 0.8,
        };
        let smooth = |quick_px| {
            let mut field: Vec<Vec<Offset>> = (0..100).map(|i| vec![seen(i); NODES]).collect();
            smooth_field(&mut field, Smoothing { quick_px, ..SECOND });
            field[50][NODES / 2].px
        };
        let (slow, both) = (smooth(0.0), smooth(SECOND.quick_px));
        assert!(slow < 4.0 && both > slow, "{slow} and {both} px");
        assert!(both - slow <= SECOND.quick_px, "{slow} and {both} px");
    }

    #[test]
    fn the_second_look_lets_a_stiff_ropes_fast_bending_pass() {
        const FRAMES: usize = 200;
        const PERIOD_S: f64 = 1.0 / 60.0;
        for (frequency_hz, least) in [(8.0, 0.98), (12.0, 0.94), (16.0, 0.88)] {
            // The second bending mode, seen with the contrast that a rope has.
            let bent = |frame: usize, node: usize| {
                let (t_s, part) = (frame as f64 * PERIOD_S, node as f64 / NODES as f64);
                let px = 0.5 * (frequency_hz * TAU * t_s).sin() * (TAU * part).sin();
                Offset { px, weight: 0.8 }
            };
            let mut field: Vec<Vec<Offset>> = (0..FRAMES)
                .map(|frame| (0..NODES).map(|node| bent(frame, node)).collect())
                .collect();
            smooth_field(&mut field, SECOND);
            let (mut kept, mut all) = (0.0, 0.0);
            for (frame, offsets) in field.iter().enumerate().take(FRAMES - 10).skip(10) {
                for (node, offset) in offsets.iter().enumerate() {
                    kept += offset.px * bent(frame, node).px;
                    all += bent(frame, node).px.powi(2);
                }
            }
            let part = kept / all;
            assert!(part > least, "{part} of {frequency_hz} Hz is left");
        }
    }
}
