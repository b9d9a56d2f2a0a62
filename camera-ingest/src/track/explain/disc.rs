//! The tip weight in one frame: a disc.

use super::curve::Pixel;

/// Where a disc is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Where it should be (px).
    pub(super) centre: Pixel,
    pub(super) radius_px: f64,
    /// Unit vector along the curve, away from the rope.
    pub(super) outwards: Pixel,
    /// How far off it may be (px).
    pub(super) reach_px: f64,
}

/// Width of the ring around the disc that must be empty (px).
const RING_PX: [f64; 2] = [1.0, 4.0];
/// What lies within this cosine of the rope's direction may be rope.
const ROPE_SIDE: f64 = 0.35;
/// Price of an offset, per squared pixel.
const PULL: f64 = 0.004;

impl Disc {
    /// Offset of the disc that stands out most from the ring around it, but for the
    /// rope's side (px), and how much it does. `at` gives evidence at a place.
    pub(super) fn find(&self, at: impl Fn(Pixel) -> f32) -> (Pixel, f64) {
        let reach = self.reach_px.floor() as i32;
        let kernel = (self.radius_px + RING_PX[1]).ceil() as i32;
        let size = kernel + reach + 1;
        let side = (2 * size + 1) as usize;
        let place = |i: i32, j: i32| Pixel::new(f64::from(i), f64::from(j));
        let mut patch = Vec::with_capacity(side * side);
        for j in -size..=size {
            for i in -size..=size {
                // Beyond the ring of the furthest centre nothing is compared.
                let is_near =
                    place(i, j).norm() <= f64::from(reach + 2) + self.radius_px + RING_PX[1];
                patch.push(if is_near {
                    at(self.centre + place(i, j))
                } else {
                    0.0
                });
            }
        }
        let across = (2 * reach + 3) as usize;
        let (mut disc, mut ring) = (Vec::new(), Vec::new());
        for j in -kernel..=kernel {
            for i in -kernel..=kernel {
                let r = f64::from(i).hypot(f64::from(j));
                let out = place(i, j).dot(&self.outwards);
                // From the first place of a row of centres.
                let offset = (j + size) as usize * side + (i + size - reach - 1) as usize;
                if r <= self.radius_px - 0.5 {
                    disc.push(offset);
                } else if r >= self.radius_px + RING_PX[0]
                    && r <= self.radius_px + RING_PX[1]
                    && out >= -ROPE_SIDE * r
                {
                    ring.push(offset);
                }
            }
        }
        // Of all centres, one further than the reach, those of a row side by side.
        let mut values = Vec::with_capacity(across * across);
        for j in 0..across {
            let sums = |offsets: &[usize]| {
                let mut sums = vec![0.0_f32; across];
                for at in offsets {
                    let first = at + j * side - (reach + 1) as usize * side;
                    for (sum, value) in sums.iter_mut().zip(&patch[first..first + across]) {
                        *sum += value;
                    }
                }
                let count = offsets.len().max(1) as f64;
                sums.into_iter().map(move |sum| f64::from(sum) / count)
            };
            values.extend(sums(&disc).zip(sums(&ring)).map(|(disc, ring)| disc - ring));
        }
        let value =
            |i: i32, j: i32| values[(j + reach + 1) as usize * across + (i + reach + 1) as usize];
        let mut best = (f64::MIN, 0, 0);
        for j in -reach..=reach {
            for i in -reach..=reach {
                let far2 = f64::from(i * i + j * j);
                let worth = value(i, j) - PULL * far2;
                if far2 <= self.reach_px * self.reach_px && worth > best.0 {
                    best = (worth, i, j);
                }
            }
        }
        let (_, i, j) = best;
        let here = value(i, j);
        let top = |before: f64, after: f64| {
            let bend = before - 2.0 * here + after;
            if bend < -1e-9 {
                (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
            } else {
                0.0
            }
        };
        let beside = Pixel::new(
            top(value(i - 1, j), value(i + 1, j)),
            top(value(i, j - 1), value(i, j + 1)),
        );
        (place(i, j) + beside, here.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of a row of centres side by side are those of each centre alone.
    #[test]
    fn the_disc_that_stands_out_most_is_found() {
        let picture = |p: Pixel| (0.5 + 0.5 * (1.3 * p.x).sin() * (0.9 * p.y).cos()) as f32;
        let disc = Disc {
            centre: Pixel::new(40.0, 30.0),
            radius_px: 5.3,
            outwards: Pixel::new(0.6, 0.8),
            reach_px: 6.0,
        };
        let mean = |centre: Pixel, belongs: &dyn Fn(Pixel) -> bool| {
            let (mut sum, mut count) = (0.0_f32, 0.0);
            for (j, i) in (-12..=12).flat_map(|j| (-12..=12).map(move |i| (j, i))) {
                let off = Pixel::new(f64::from(i), f64::from(j));
                if belongs(off) {
                    sum += picture(centre + off);
                    count += 1.0;
                }
            }
            f64::from(sum) / count
        };
        let inside = |off: Pixel| off.norm() <= disc.radius_px - 0.5;
        let around = |off: Pixel| {
            let r = off.norm() - disc.radius_px;
            (RING_PX[0]..=RING_PX[1]).contains(&r)
                && off.dot(&disc.outwards) >= -ROPE_SIDE * off.norm()
        };
        let value = |off: Pixel| {
            let centre = disc.centre + off;
            mean(centre, &inside) - mean(centre, &around)
        };
        let worth = |off: Pixel| value(off) - PULL * off.norm_squared();
        let offs =
            (-6..=6).flat_map(|j| (-6..=6).map(move |i| Pixel::new(f64::from(i), f64::from(j))));
        let near = offs.filter(|off| off.norm() <= disc.reach_px);
        let best = near.max_by(|a, b| worth(*a).total_cmp(&worth(*b))).unwrap();
        let (found, weight) = disc.find(picture);
        let off = found - best;
        assert!(off.amax() <= 0.5, "{found:?}, {best:?}");
        assert!((value(best) - weight).abs() < 1e-5, "{weight}");
    }

    #[test]
    fn a_disc_on_a_rope_is_found_where_it_is() {
        for (x, y) in [(0.0, 0.0), (2.4, -1.3), (-3.2, 2.0)] {
            // The rope comes from above.
            let picture = |p: Pixel| {
                let off = p - Pixel::new(40.0 + x, 30.0 + y);
                let disc = (6.5 - off.norm()).clamp(0.0, 1.0);
                let rope = (3.5 - off.x.abs()).clamp(0.0, 1.0);
                (if off.y < 0.0 { disc.max(rope) } else { disc }) as f32
            };
            let disc = Disc {
                centre: Pixel::new(40.0, 30.0),
                radius_px: 6.0,
                outwards: Pixel::y(),
                reach_px: 5.0,
            };
            let (found, weight) = disc.find(picture);
            let off = (found - Pixel::new(x, y)).norm();
            assert!(
                off < 0.35 && weight > 0.8,
                "{found:?} for {x}, {y}: {weight}"
            );
        }
    }
}
