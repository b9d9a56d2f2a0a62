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
const MIN_SHARE: f32 = 0.07;
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

/// A place in pictures of one size: samples to its left and above, and the part of a step
/// beyond them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    luma: [usize; 2],
    chroma: [usize; 2],
    beyond: [f32; 2],
    beyond_pair: f32,
}

impl Place {
    /// Of a place (px) in a frame of that size; `None` outside.
    #[inline]
    pub(super) fn of(p: Pixel, frame: &ImageFrame) -> Option<Self> {
        let (u, v) = (p.x, p.y);
        let [last_u, last_v] = [frame.width_px, frame.height_px].map(|n| n as f64 - 1.0);
        if !(u >= 0.0 && v >= 0.0 && u < last_u && v < last_v) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        // A chroma sample stands between the two pixels of its pair.
        let half = (frame.width_px / 2) as f64;
        let pair = ((u - 0.5) * 0.5).clamp(0.0, half - 1.001);
        let left = pair as usize;
        Some(Self {
            luma: [column, row],
            chroma: [left, row],
            beyond: [(u - column as f64) as f32, (v - row as f64) as f32],
            beyond_pair: (pair - left as f64) as f32,
        })
    }

    /// Colour there of a frame of that size, divided by the frame's gain; luma interpolated
    /// between pixels, chroma between pairs.
    #[inline]
    pub(super) fn colour(&self, frame: &ImageFrame, gain: f32) -> Colour {
        let [a, b] = self.beyond;
        let chroma = |plane: &[u8]| {
            let half = frame.width_px / 2;
            let value = interpolated(plane, half, self.chroma, [self.beyond_pair, b]);
            CHROMA_WEIGHT * (value - 128.0) / gain
        };
        [
            interpolated(&frame.luma, frame.width_px, self.luma, [a, b]) / gain,
            chroma(&frame.cb),
            chroma(&frame.cr),
        ]
    }
}

/// Value of a plane at parts of a step beyond a column and a row (bilinear).
#[inline]
pub(super) fn interpolated(
    plane: &[u8],
    width: usize,
    [column, row]: [usize; 2],
    [a, b]: [f32; 2],
) -> f32 {
    let at = row * width + column;
    let pair = |at: usize| -> [f32; 2] {
        let pair = &plane[at..at + 2];
        [f32::from(pair[0]), f32::from(pair[1])]
    };
    let [top, bottom] = [pair(at), pair(at + width)].map(|[left, right]| left + (right - left) * a);
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
    order.retain(|i| sizes[*i] as f32 > MIN_SHARE * samples.len() as f32);
    order.sort_by_key(|i| core::cmp::Reverse(sizes[*i]));
    order.into_iter().map(|i| centres[i]).collect()
}

/// Colours as they look in some shades.
pub(super) fn shaded(colours: &[Colour], shades: &[f32]) -> Vec<Colour> {
    let shaded = |c: &Colour| shades.iter().map(|s| c.map(|v| v * s)).collect::<Vec<_>>();
    colours.iter().flat_map(shaded).collect()
}

/// How much of a pixel one of some colours covers, 0 to 1: the mixture of it with what is
/// behind that comes nearest to what is seen, held down by what is left and where both
/// differ by hardly more than the noise. `least` where it is less.
#[inline]
pub(super) fn coverage(
    seen: Colour,
    behind: Colour,
    colours: &[Colour],
    noise: f32,
    least: f32,
) -> f32 {
    let mut best = least;
    for colour in colours {
        let (mut seen2, mut whole2, mut product) = (0.0, 0.0, 0.0);
        for k in 0..3 {
            let (d, whole) = (seen[k] - behind[k], colour[k] - behind[k]);
            seen2 += d * d;
            whole2 += whole * whole;
            product += d * whole;
        }
        let part = (product / whole2.max(1.0)).min(1.3);
        let trust = whole2 / (whole2 + (6.0 * noise).powi(2));
        // What is left only holds it down: most pixels need no exponential.
        if part.min(1.0) * trust <= best {
            continue;
        }
        let left2 = (seen2 - part * (2.0 * product - part * whole2)).max(0.0);
        let scatter2 = (3.0 * noise).powi(2) + 0.04 * whole2;
        best = best.max(part.min(1.0) * (-0.5 * left2 / scatter2).exp() * trust);
    }
    best
}

/// Evidence (0 to 1) that one of some colours is at a pixel, edges of the thing included.
#[inline]
pub(super) fn presence(seen: Colour, behind: Colour, colours: &[Colour], noise: f32) -> f32 {
    let covered = coverage(seen, behind, colours, noise, EDGE[0]);
    ((covered - EDGE[0]) / EDGE[1]).clamp(0.0, 1.0)
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
        let rope_shades = shaded(&[rope], &SHADES);
        let covered = coverage(mixed, wall, &rope_shades, 2.0, 0.0);
        assert!((covered - 0.5).abs() < 0.1, "{covered}");
        let shadow = wall.map(|c| 0.6 * c);
        assert_eq!(presence(shadow, wall, &rope_shades, 2.0), 0.0);
        assert!(coverage(rope, wall, &rope_shades, 2.0, 0.0) > 0.95);
    }

    /// Colours that cannot cover more than the best one so far are left out, and nothing else.
    #[test]
    fn what_is_left_out_would_not_have_covered_more() {
        let behind = [120.0, 10.0, -5.0];
        let colours = shaded(&[[60.0, 20.0, 80.0], [200.0, -60.0, 10.0]], &SHADES);
        for k in 0..2000_u32 {
            let part =
                |n: u32| (k.wrapping_mul(2_654_435_761).wrapping_add(n * 977) >> 8 & 255) as f32;
            let seen = [part(1), part(2) - 128.0, part(3) - 128.0];
            let alone = |c: &Colour| coverage(seen, behind, core::slice::from_ref(c), 2.0, 0.0);
            let most = colours.iter().map(alone).fold(0.0, f32::max);
            let all = coverage(seen, behind, &colours, 2.0, 0.0);
            assert_eq!(all.to_bits(), most.to_bits(), "{seen:?}");
            let shown = presence(seen, behind, &colours, 2.0);
            let expected = ((most - EDGE[0]) / EDGE[1]).clamp(0.0, 1.0);
            assert_eq!(shown.to_bits(), expected.to_bits(), "{seen:?}");
        }
    }

    #[test]
    fn a_place_between_pixels_is_interpolated() {
        let mut frame = ImageFrame::grey([8, 4], 100);
        frame.luma[8 + 3] = 200;
        let place = Place::of(Pixel::new(2.5, 1.0), &frame).unwrap();
        assert_eq!(place.colour(&frame, 1.0), [150.0, 0.0, 0.0]);
        for u in [7.0, -0.1] {
            assert!(Place::of(Pixel::new(u, 1.0), &frame).is_none());
        }
    }
}
