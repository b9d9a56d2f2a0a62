//! Coloured blobs by chroma coverage.
//!
//! Chroma separates a lead or a ball from plaster, rope and shadows, and is linear
//! under motion blur: a pixel covered to a part `a` has chroma `b + a (t - b)`
//! with the background's `b` and the blob's `t`.

use crate::frame::{ImageFrame, ycc_from_rgb};

/// Chroma `[Cb, Cr]` about zero.
pub(super) type Chroma = [f64; 2];

/// Coverage from which a pixel belongs to a blob.
const MIN_COVERAGE: f64 = 0.2;
/// Cosine between a blob's chroma and the one looked for.
const MIN_COSINE: f64 = 0.88;
/// Smallest blob (chroma samples; two pixels each).
const MIN_SAMPLES: usize = 8;

pub(super) fn chroma_of_rgb(rgb: [u8; 3]) -> Chroma {
    let [_, cb, cr] = ycc_from_rgb(rgb);
    [f64::from(cb) - 128.0, f64::from(cr) - 128.0]
}

/// What a frame's chroma is compared with.
#[derive(Debug, Clone, Copy)]
pub(super) enum Behind<'a> {
    /// The scene without the blob (for what moves), and what most of it looks like.
    ///
    /// A change towards the colour is not enough: where something of the opposite hue
    /// goes away, plain plaster is such a change.
    Scene {
        scene: &'a ImageFrame,
        middle: Chroma,
    },
    /// One chroma everywhere (for what stands still).
    Flat(Chroma),
}

/// Coverage map of one colour in one image.
#[derive(Debug, Clone)]
pub(super) struct BlobMap {
    /// Chroma samples per row, each two pixels wide.
    width: usize,
    values: Vec<f64>,
}

/// One blob, raw pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Blob {
    pub(super) centre: [f64; 2],
    /// Sum of coverage (px).
    pub(super) area_px: f64,
    /// Variances `uu`, `uv`, `vv` of its pixels (px^2).
    spread: [f64; 3],
    /// Long over short axis.
    pub(super) stretch: f64,
}

impl Blob {
    /// How far it reaches from its centre along a direction: the radius of a disc, more
    /// along motion blur (px).
    pub(super) fn reach_px(&self, [u, v]: [f64; 2]) -> f64 {
        let [uu, uv, vv] = self.spread;
        let square = u * u + v * v;
        // A disc's variance along any axis is a quarter of its radius squared.
        2.0 * ((uu * u * u + 2.0 * uv * u * v + vv * v * v) / square.max(1e-12))
            .max(0.0)
            .sqrt()
    }
}

impl BlobMap {
    pub(super) fn new(frame: &ImageFrame, wanted: Chroma, behind: Behind<'_>) -> Self {
        let sample = |cb: u8, cr: u8| [f64::from(cb) - 128.0, f64::from(cr) - 128.0];
        let values = (0..frame.cb.len())
            .map(|at| {
                let seen = sample(frame.cb[at], frame.cr[at]);
                match behind {
                    Behind::Scene { scene, middle } => {
                        let empty = sample(scene.cb[at], scene.cr[at]);
                        let changed = coverage(seen, empty, wanted);
                        changed.min(coverage(seen, middle, wanted))
                    }
                    Behind::Flat(middle) => coverage(seen, middle, wanted),
                }
            })
            .collect();
        Self {
            width: frame.width_px / 2,
            values,
        }
    }

    /// Connected blobs, largest first, their centres refined to sub-pixel.
    pub(super) fn blobs(&self) -> Vec<Blob> {
        let mut seen = vec![false; self.values.len()];
        let mut found = Vec::new();
        for start in 0..self.values.len() {
            if seen[start] || self.values[start] < MIN_COVERAGE {
                continue;
            }
            let members = self.component(start, &mut seen);
            if members.len() >= MIN_SAMPLES {
                found.push(self.measure(&members));
            }
        }
        found.sort_by(|a, b| b.area_px.total_cmp(&a.area_px));
        found
    }

    fn component(&self, start: usize, seen: &mut [bool]) -> Vec<usize> {
        let (mut open, mut members) = (vec![start], Vec::new());
        seen[start] = true;
        while let Some(at) = open.pop() {
            members.push(at);
            let (x, y) = (at % self.width, at / self.width);
            let height = self.values.len() / self.width;
            for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for u in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                    let next = v * self.width + u;
                    if !seen[next] && self.values[next] >= MIN_COVERAGE {
                        seen[next] = true;
                        open.push(next);
                    }
                }
            }
        }
        members
    }

    /// Centroid over the component grown by two pixels, so that the soft rim
    /// below the threshold counts, too.
    fn measure(&self, members: &[usize]) -> Blob {
        let height = self.values.len() / self.width;
        let (mut x0, mut y0, mut x1, mut y1) = (usize::MAX, usize::MAX, 0, 0);
        for &at in members {
            let (x, y) = (at % self.width, at / self.width);
            (x0, x1) = (x0.min(x), x1.max(x));
            (y0, y1) = (y0.min(y), y1.max(y));
        }
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for y in y0.saturating_sub(2)..=(y1 + 2).min(height - 1) {
            for x in x0.saturating_sub(1)..=(x1 + 1).min(self.width - 1) {
                let w = self.values[y * self.width + x];
                // A chroma sample lies in the middle of its two pixels.
                let (u, v) = (2.0 * x as f64 + 0.5, y as f64);
                sum += w;
                first[0] += w * u;
                first[1] += w * v;
                second[0] += w * u * u;
                second[1] += w * u * v;
                second[2] += w * v * v;
            }
        }
        let centre = [first[0] / sum, first[1] / sum];
        let spread = [
            second[0] / sum - centre[0] * centre[0],
            second[1] / sum - centre[0] * centre[1],
            second[2] / sum - centre[1] * centre[1],
        ];
        let (middle, half) = (
            f64::midpoint(spread[0], spread[2]),
            ((spread[0] - spread[2]) / 2.0).hypot(spread[1]),
        );
        Blob {
            centre,
            area_px: 2.0 * sum,
            spread,
            stretch: ((middle + half) / (middle - half).max(1e-3)).sqrt(),
        }
    }
}

/// Coverage of one sample, 0 where its chroma points elsewhere.
pub(super) fn coverage(seen: Chroma, empty: Chroma, wanted: Chroma) -> f64 {
    let d = [seen[0] - empty[0], seen[1] - empty[1]];
    let t = [wanted[0] - empty[0], wanted[1] - empty[1]];
    let (dot, tt) = (d[0] * t[0] + d[1] * t[1], t[0] * t[0] + t[1] * t[1]);
    let cosine = dot / (d[0].hypot(d[1]) * tt.sqrt()).max(1e-9);
    // Against a background of the blob's own colour nothing can be inferred.
    if cosine < MIN_COSINE || tt < 100.0 {
        return 0.0;
    }
    (dot / tt).clamp(0.0, 1.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_covered_rim_gives_the_true_centre() {
        let wanted = chroma_of_rgb([255, 107, 13]);
        let (width_px, height_px) = (80, 40);
        let mut frame = ImageFrame::grey([width_px, height_px], 90);
        let empty = frame.clone();
        let truth = [33.7, 18.2];
        for y in 0..height_px {
            for x in 0..width_px / 2 {
                let away = (2.0 * x as f64 + 0.5 - truth[0]).hypot(y as f64 - truth[1]);
                let a = (7.5 - away).clamp(0.0, 1.0);
                let mix = |k: usize| (128.0 + a * wanted[k]).round() as u8;
                (
                    frame.cb[y * width_px / 2 + x],
                    frame.cr[y * width_px / 2 + x],
                ) = (mix(0), mix(1));
            }
        }
        let still = Behind::Scene {
            scene: &empty,
            middle: [0.0, 0.0],
        };
        for behind in [still, Behind::Flat([0.0, 0.0])] {
            let blobs = BlobMap::new(&frame, wanted, behind).blobs();
            assert_eq!(blobs.len(), 1);
            let off = (blobs[0].centre[0] - truth[0]).hypot(blobs[0].centre[1] - truth[1]);
            assert!(off < 0.1 && blobs[0].stretch < 1.1, "{:?}", blobs[0]);
            assert!((blobs[0].area_px / (std::f64::consts::PI * 49.0) - 1.0).abs() < 0.05);
        }
        let other = chroma_of_rgb([26, 191, 64]);
        assert!(BlobMap::new(&frame, other, still).blobs().is_empty());
    }
}
