//! Colours of rope and tip weight, learnt where they were found, and how much of a pixel
//! they cover.

use super::curve::Pixel;
use super::statistics::median;
use crate::frame::ImageFrame;

/// Luma and both chromas about grey, in the scene's light; chroma weighs more than luma,
/// since light changes it less.
pub(super) type Colour = [f32; 3];

/// Weight of chroma against luma.
pub(super) const CHROMA_WEIGHT: f32 = 1.5;
/// Colours further apart than this are of two yarns or two sides (levels).
const APART: f32 = 30.0;
/// Groups with a smaller share are not the thing's own.
const LEAST_SHARE: f32 = 0.07;
/// A round thing is lit from one side.
pub(super) const SHADES: [f32; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];
/// Coverage from which a pixel is the thing's edge, and what is added until it is the
/// thing: its sides must count alike however they are lit.
const EDGE: [f32; 2] = [0.1, 0.3];

/// A pixel's own colour, in the light of a scene that is darker by `gain`.
pub(super) fn pixel_colour(frame: &ImageFrame, gain: f32, [u, v]: [usize; 2]) -> Colour {
    let [y, cb, cr] = frame.ycc(u, v).map(f32::from);
    let chroma = |c: f32| CHROMA_WEIGHT * (c - 128.0) / gain;
    [y / gain, chroma(cb), chroma(cr)]
}

/// Colour of a frame at a place (px), divided by the frame's gain; luma interpolated
/// between pixels, chroma between pairs. `None` outside.
#[inline]
pub(super) fn colour_at(frame: &ImageFrame, gain: f32, p: Pixel) -> Option<Colour> {
    let (u, v) = (p.x, p.y);
    let inside =
        u >= 0.0 && v >= 0.0 && u < frame.width_px as f64 - 1.0 && v < frame.height_px as f64 - 1.0;
    if !inside {
        return None;
    }
    let (column, row) = (u as usize, v as usize);
    let (a, b) = ((u - column as f64) as f32, (v - row as f64) as f32);
    let half = frame.width_px / 2;
    // A chroma sample stands between the two pixels of its pair.
    let pair = ((u - 0.5) * 0.5).clamp(0.0, half as f64 - 1.001);
    let (left, part) = (pair as usize, pair.fract() as f32);
    let chroma = |plane: &[u8]| {
        CHROMA_WEIGHT * (interpolated(plane, half, [left, row], [part, b]) - 128.0) / gain
    };
    Some([
        interpolated(&frame.luma, frame.width_px, [column, row], [a, b]) / gain,
        chroma(&frame.cb),
        chroma(&frame.cr),
    ])
}

/// Value of a plane at parts of a step beyond a column and a row (bilinear).
#[inline]
pub(super) fn interpolated(
    plane: &[u8],
    width: usize,
    [column, row]: [usize; 2],
    [a, b]: [f32; 2],
) -> f32 {
    let across = |at: usize| {
        let [left, right] = [f32::from(plane[at]), f32::from(plane[at + 1])];
        left + (right - left) * a
    };
    let at = row * width + column;
    let (top, bottom) = (across(at), across(at + width));
    top + (bottom - top) * b
}

fn square_distance(a: &Colour, b: &Colour) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// Whether two colours are those of different things, however they are lit.
pub(super) fn are_apart(a: &Colour, b: &Colour) -> bool {
    square_distance(a, b) > (1.5 * APART).powi(2)
}

fn middle(of: &[&Colour]) -> Colour {
    core::array::from_fn(|k| median(of.iter().map(|c| f64::from(c[k]))) as f32)
}

/// Which centre is nearest.
fn nearest(centres: &[Colour], sample: &Colour) -> usize {
    let distance = |i: &usize| square_distance(&centres[*i], sample);
    (0..centres.len())
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

/// Middles of at most `count` groups of colours, the largest first; empty without samples.
pub(super) fn groups(samples: &[Colour], count: usize) -> Vec<Colour> {
    const ROUNDS: usize = 6;
    if samples.is_empty() {
        return Vec::new();
    }
    let mut centres = vec![middle(&samples.iter().collect::<Vec<_>>())];
    let members = |centres: &[Colour]| {
        let mut groups: Vec<Vec<&Colour>> = vec![Vec::new(); centres.len()];
        for sample in samples {
            groups[nearest(centres, sample)].push(sample);
        }
        groups
    };
    while centres.len() < count {
        // A tenth of the samples must be far from all groups to be one of its own.
        let mut far: Vec<(f32, usize)> = samples
            .iter()
            .map(|s| square_distance(&centres[nearest(&centres, s)], s))
            .zip(0..)
            .collect();
        far.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (distance, index) = far[far.len() * 9 / 10];
        if distance < APART * APART {
            break;
        }
        centres.push(samples[index]);
        for _ in 0..ROUNDS {
            let groups = members(&centres);
            for (centre, group) in centres.iter_mut().zip(groups) {
                if !group.is_empty() {
                    *centre = middle(&group);
                }
            }
        }
    }
    let sizes: Vec<usize> = members(&centres).iter().map(Vec::len).collect();
    let mut order: Vec<usize> = (0..centres.len()).collect();
    order.retain(|i| sizes[*i] as f32 > LEAST_SHARE * samples.len() as f32);
    order.sort_by_key(|i| core::cmp::Reverse(sizes[*i]));
    order.into_iter().map(|i| centres[i]).collect()
}

/// How much of a pixel one of some colours covers, 0 to 1: the mixture of it with what is
/// behind that comes nearest to what is seen, held down by what is left and where both
/// differ by hardly more than the noise.
pub(super) fn coverage(
    seen: Colour,
    behind: Colour,
    colours: &[Colour],
    shades: &[f32],
    noise: f32,
) -> f32 {
    let mut best = 0.0_f32;
    for (colour, shade) in colours
        .iter()
        .flat_map(|c| shades.iter().map(move |s| (c, *s)))
    {
        let (mut seen2, mut whole2, mut product) = (0.0, 0.0, 0.0);
        for k in 0..3 {
            let (d, whole) = (seen[k] - behind[k], colour[k] * shade - behind[k]);
            seen2 += d * d;
            whole2 += whole * whole;
            product += d * whole;
        }
        let part = (product / whole2.max(1.0)).min(1.3);
        if part <= 0.0 {
            continue;
        }
        let left2 = (seen2 - part * (2.0 * product - part * whole2)).max(0.0);
        let scatter2 = (3.0 * noise).powi(2) + 0.04 * whole2;
        let trust = whole2 / (whole2 + (6.0 * noise).powi(2));
        best = best.max(part.min(1.0) * (-0.5 * left2 / scatter2).exp() * trust);
    }
    best
}

/// Coverage as evidence of the thing, its edges included.
pub(super) fn presence(coverage: f32) -> f32 {
    ((coverage - EDGE[0]) / EDGE[1]).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_yarns_are_two_groups_and_a_stray_is_none() {
        let mut samples = vec![[100.0, 0.0, 60.0]; 60];
        samples.extend(vec![[180.0, -40.0, 0.0]; 38]);
        samples.extend(vec![[20.0, 90.0, -80.0]; 2]);
        let found = groups(&samples, 3);
        assert_eq!(found, [[100.0, 0.0, 60.0], [180.0, -40.0, 0.0]]);
        assert!(groups(&[], 3).is_empty());
    }

    #[test]
    fn half_a_mixture_is_half_covered_and_a_shadow_is_not() {
        let (wall, rope) = ([160.0, 4.0, 2.0], [110.0, -40.0, 90.0]);
        let mixed = core::array::from_fn(|k| 0.5 * (wall[k] + rope[k]));
        let covered = coverage(mixed, wall, &[rope], &SHADES, 2.0);
        assert!((covered - 0.5).abs() < 0.1, "{covered}");
        let shadow = wall.map(|c| 0.6 * c);
        assert_eq!(presence(coverage(shadow, wall, &[rope], &SHADES, 2.0)), 0.0);
        assert!(coverage(rope, wall, &[rope], &SHADES, 2.0) > 0.95);
    }

    #[test]
    fn a_place_between_pixels_is_interpolated() {
        let mut frame = ImageFrame::grey([8, 4], 100);
        frame.luma[8 + 3] = 200;
        let seen = colour_at(&frame, 1.0, Pixel::new(2.5, 1.0)).unwrap();
        assert_eq!(seen, [150.0, 0.0, 0.0]);
        for u in [7.0, -0.1] {
            assert!(colour_at(&frame, 1.0, Pixel::new(u, 1.0)).is_none());
        }
    }
}
