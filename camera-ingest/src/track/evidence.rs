//! How much of a pixel is covered by something of a known colour.
//!
//! A pixel half covered by the rope (an edge, or motion blur) is a mixture
//! `I = B + a (R - B)` of background B and rope R. The coverage `a` is linear in
//! the mixture, so a centroid weighted with it is right under blur, too. What
//! does not lie on the line between B and R (a shadow, the arm) is held down
//! by its distance from it.

use super::background::Background;
use crate::frame::EyeFrame;
use crate::vectors::widest;

/// Colour in full-range BT.601 `[Y, Cb, Cr]`.
pub(super) type Colour = [f32; 3];

/// A rectangle of pixels, upper bounds exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) u0: usize,
    pub(super) v0: usize,
    pub(super) u1: usize,
    pub(super) v1: usize,
}

impl Window {
    /// Smallest window around pixels with a margin, inside the image.
    pub(super) fn around(
        pixels: impl Iterator<Item = [f64; 2]>,
        margin_px: f64,
        image: &EyeFrame,
    ) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in pixels {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let size = [image.width_px, image.height_px];
        let bound = |x: f64, k: usize| x.clamp(0.0, size[k] as f64) as usize;
        Self {
            u0: bound(low[0] - margin_px, 0),
            v0: bound(low[1] - margin_px, 1),
            u1: bound(high[0] + margin_px + 2.0, 0),
            v1: bound(high[1] + margin_px + 2.0, 1),
        }
    }
}

/// Columns of each row of a window that are looked at, upper bounds exclusive.
#[derive(Debug, Clone)]
pub(super) struct Band {
    columns: Vec<[usize; 2]>,
}

impl Band {
    /// All of a window.
    pub(super) fn all(window: Window) -> Self {
        Self {
            columns: vec![[window.u0, window.u1]; window.v1 - window.v0],
        }
    }

    /// What lies within `reach_px` of some pixels, on either axis. A rope's
    /// window is mostly empty of rope.
    pub(super) fn along(pixels: &[[f64; 2]], reach_px: f64, window: Window) -> Self {
        let mut columns = vec![[window.u1, window.u0]; window.v1 - window.v0];
        let bound = |x: f64, low: usize, high: usize| x.clamp(low as f64, high as f64) as usize;
        for [u, v] in pixels {
            let [left, right] =
                [u - reach_px, u + reach_px + 2.0].map(|x| bound(x, window.u0, window.u1));
            let [top, bottom] = [v - reach_px, v + reach_px + 2.0]
                .map(|x| bound(x, window.v0, window.v1) - window.v0);
            for row in &mut columns[top..bottom.max(top)] {
                *row = [row[0].min(left), row[1].max(right)];
            }
        }
        Self { columns }
    }
}

/// Coverage of the pixels of a window, 0 to about 1; 0 outside its band.
#[derive(Debug, Clone)]
pub(super) struct Coverage {
    pub(super) window: Window,
    width: usize,
    values: Vec<f32>,
}

/// What is looked for, against what, in which light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matter<'a> {
    pub(super) background: &'a Background,
    /// Colour looked for.
    pub(super) colour: Colour,
    /// How far that colour scatters (shading, texture).
    pub(super) scatter: f32,
    /// Brightness of the frame relative to the background.
    pub(super) gain: f32,
    /// Coverage that counts as full: 1 for a thin rope, whose coverage is
    /// measured; less for a fat, shaded lead, of which only the outline counts.
    pub(super) full: f32,
    /// Brightness of the shades to look for relative to `colour`: the dark side
    /// of a lead counts as much as its lit side.
    pub(super) shades: &'static [f32],
    /// Colour of what touches it and must not be taken for it: the rope where
    /// the lead is looked for.
    pub(super) rival: Option<Colour>,
    /// How far the chroma of a pixel may be off its luma, as a part of the contrast: two
    /// pixels share a chroma sample, so what is a few pixels wide has edges of the right
    /// brightness and another saturation.
    pub(super) smear: f32,
}

/// Squares of the grey levels at which evidence fades.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Contrast between rope and background.
    noise2: f32,
    /// Distance from the line between them.
    off2: f32,
    /// The same, as a part of the squared contrast in chroma.
    smear2: f32,
}

/// Pixels of a part of a row, channel by channel: what is seen, in the background's
/// light, and what is behind.
#[derive(Debug, Default)]
struct Row {
    seen: [Vec<f32>; 3],
    empty: [Vec<f32>; 3],
    /// Pixels before the part, of which a chroma sample covers two.
    before: usize,
}

impl Row {
    #[inline(always)]
    fn fill(
        &mut self,
        frame: &EyeFrame,
        empty: &EyeFrame,
        gain: f32,
        v: usize,
        [from, to]: [usize; 2],
    ) {
        let inverse_gain = 1.0 / gain;
        let light = |c: u8| 128.0 + (f32::from(c) - 128.0) * inverse_gain;
        let (first, last) = (from / 2, to.div_ceil(2));
        self.before = from - 2 * first;
        let row = v * frame.width_px;
        let luma = |plane: &[u8], out: &mut Vec<f32>, scale: f32| {
            let pixels = &plane[row + 2 * first..row + 2 * last];
            out.resize(pixels.len(), 0.0);
            for (out, y) in out.iter_mut().zip(pixels) {
                *out = f32::from(*y) * scale;
            }
        };
        luma(&frame.luma, &mut self.seen[0], inverse_gain);
        luma(&empty.luma, &mut self.empty[0], 1.0);
        let planes = [(&frame.cb, &empty.cb), (&frame.cr, &empty.cr)];
        for (k, (seen, behind)) in planes.into_iter().enumerate() {
            let samples = row / 2 + first..row / 2 + last;
            let (out, out_behind) = (&mut self.seen[k + 1], &mut self.empty[k + 1]);
            out.resize(2 * samples.len(), 0.0);
            out_behind.resize(2 * samples.len(), 0.0);
            for (pair, c) in out.chunks_exact_mut(2).zip(&seen[samples.clone()]) {
                pair.fill(light(*c));
            }
            for (pair, c) in out_behind.chunks_exact_mut(2).zip(&behind[samples]) {
                pair.fill(f32::from(*c));
            }
        }
    }
}

impl Matter<'_> {
    /// Coverage of one pixel: the best over the shades looked for.
    #[inline(always)]
    fn of_pixel(
        &self,
        seen: Colour,
        empty: Colour,
        shades: &[Colour],
        rival: Option<Colour>,
        limits: Limits,
    ) -> f32 {
        let difference: Colour = core::array::from_fn(|k| seen[k] - empty[k]);
        let dd: f32 = difference.iter().map(|d| d * d).sum();
        // Part of a mixture with `pure`, and the squared distance from the
        // nearest such mixture.
        let mixture = |pure: &Colour| -> (f32, f32, f32) {
            let (mut dot, mut rr) = (0.0, 0.0);
            for k in 0..3 {
                let r = pure[k] - empty[k];
                dot += difference[k] * r;
                rr += r * r;
            }
            // Where the background has the rope's own colour, `a` is unknown:
            // the noise in the denominator lets it fade to 0 instead of
            // exploding.
            let a = (dot / (rr + limits.noise2)).clamp(0.0, 1.2);
            let luma = pure[0] - empty[0];
            let off2 = limits.off2 + limits.smear2 * (rr - luma * luma);
            (a, (dd - 2.0 * a * dot + a * a * rr).max(0.0), off2)
        };
        let (mut best, mut least_off) = (0.0_f32, f32::INFINITY);
        for shade in shades {
            let (a, off, off2) = mixture(shade);
            best = best.max((a / self.full).min(1.2) * off2 / (off2 + off));
            least_off = least_off.min(off);
        }
        // Against a rival of the same colour this does nothing.
        rival.map_or(best, |rival| {
            let off = mixture(&rival).1;
            let n = limits.noise2;
            best * ((2.0 * off + n) / (off + least_off + n)).min(1.0)
        })
    }

    /// Coverage of a window of a frame.
    pub(super) fn coverage(&self, frame: &EyeFrame, window: Window) -> Coverage {
        self.coverage_of(frame, window, &Band::all(window))
    }

    /// Coverage of a band of a window.
    pub(super) fn coverage_of(&self, frame: &EyeFrame, window: Window, band: &Band) -> Coverage {
        let noise2 = (4.0 * self.background.noise).powi(2);
        let limits = Limits {
            noise2,
            off2: noise2.max(4.0 * self.scatter * self.scatter),
            smear2: self.smear * self.smear,
        };
        let shades: Vec<Colour> = self
            .shades
            .iter()
            .map(|s| {
                let [y, cb, cr] = self.colour;
                [y * s, 128.0 + (cb - 128.0) * s, 128.0 + (cr - 128.0) * s]
            })
            .collect();
        let width = window.u1 - window.u0;
        let mut values = vec![0.0; width * (window.v1 - window.v0)];
        let mut row = Row::default();
        widest(
            #[inline(always)]
            || {
                for (v, &[from, to]) in (window.v0..window.v1).zip(&band.columns) {
                    if from >= to {
                        continue;
                    }
                    row.fill(frame, &self.background.image, self.gain, v, [from, to]);
                    let start = (v - window.v0) * width;
                    let out = &mut values[start + from - window.u0..start + to - window.u0];
                    // The usual numbers of shades as constants: the loops over them unroll,
                    // and several pixels are worked on at once.
                    match (&shades[..], self.rival) {
                        ([a], None) => self.fill(&row, &[*a], None, limits, out),
                        ([a, b, c], Some(rival)) => {
                            self.fill(&row, &[*a, *b, *c], Some(rival), limits, out);
                        }
                        ([a, b, c], None) => self.fill(&row, &[*a, *b, *c], None, limits, out),
                        (all, rival) => self.fill(&row, all, rival, limits, out),
                    }
                }
            },
        );
        Coverage {
            window,
            width,
            values,
        }
    }

    #[inline(always)]
    fn fill(
        &self,
        row: &Row,
        shades: &[Colour],
        rival: Option<Colour>,
        limits: Limits,
        out: &mut [f32],
    ) {
        let count = out.len();
        let part = row.before..row.before + count;
        let [y, cb, cr] = [0, 1, 2].map(|k| &row.seen[k][part.clone()]);
        let [ey, ecb, ecr] = [0, 1, 2].map(|k| &row.empty[k][part.clone()]);
        for i in 0..count {
            let (seen, empty) = ([y[i], cb[i], cr[i]], [ey[i], ecb[i], ecr[i]]);
            out[i] = self.of_pixel(seen, empty, shades, rival, limits);
        }
    }
}

impl Coverage {
    /// Value at a raw pixel, bilinear; 0 outside the window.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> f32 {
        let (x, y) = (u - self.window.u0 as f64, v - self.window.v0 as f64);
        let rows = self.window.v1 - self.window.v0;
        if !(x >= 0.0 && y >= 0.0) {
            return 0.0;
        }
        let (i, j) = (x as usize, y as usize);
        if i + 1 >= self.width || j + 1 >= rows {
            return 0.0;
        }
        let (a, b) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let at = j * self.width + i;
        let (top, bottom) = (
            &self.values[at..at + 2],
            &self.values[at + self.width..at + self.width + 2],
        );
        (1.0 - b) * ((1.0 - a) * top[0] + a * top[1]) + b * ((1.0 - a) * bottom[0] + a * bottom[1])
    }

    /// Largest sum over a square of the area of a disc of `radius_px`, its centre within
    /// `reach_px` of `centre` on either axis, without what lies within `clear_px` of it.
    pub(super) fn most_beside(
        &self,
        centre: [f64; 2],
        clear_px: f64,
        radius_px: f64,
        reach_px: f64,
    ) -> f64 {
        let side = ((radius_px * std::f64::consts::PI.sqrt()).round() as usize).max(1);
        let near = self.window;
        let far = reach_px + side as f64 / 2.0;
        let within = |x: usize, k: usize| (x as f64 - centre[k]).abs() <= far;
        // Sums over the squares' columns, row by row the oldest going and the newest coming.
        let mut columns = vec![0.0_f64; self.width];
        let value = |u: usize, v: usize| -> f64 {
            let (du, dv) = (u as f64 - centre[0], v as f64 - centre[1]);
            if !within(u, 0) || du * du + dv * dv <= clear_px * clear_px {
                return 0.0;
            }
            f64::from(self.values[(v - near.v0) * self.width + u - near.u0])
        };
        let rows: Vec<usize> = (near.v0..near.v1).filter(|v| within(*v, 1)).collect();
        let mut most: f64 = 0.0;
        for (count, &v) in rows.iter().enumerate() {
            for (u, sum) in (near.u0..near.u1).zip(&mut columns) {
                *sum += value(u, v);
                if count >= side {
                    *sum -= value(u, v - side);
                }
            }
            let mut sum = 0.0;
            for at in 0..columns.len() {
                sum += columns[at];
                if at >= side {
                    sum -= columns[at - side];
                }
                most = most.max(sum);
            }
        }
        most
    }

    /// Sum and centroid within `radius_px` of a raw pixel.
    pub(super) fn centroid(&self, centre: [f64; 2], radius_px: f64) -> (f64, [f64; 2]) {
        let (mut sum, mut u_sum, mut v_sum) = (0.0, 0.0, 0.0);
        // What lies beyond this on one axis has no weight; nor has what is not covered.
        let reach = radius_px + 1.0;
        let within = (radius_px - 0.5).max(0.0).powi(2);
        for (row, v) in self
            .values
            .chunks_exact(self.width.max(1))
            .zip(self.window.v0..)
        {
            let dv = v as f64 - centre[1];
            if dv.abs() > reach {
                continue;
            }
            for (&value, u) in row.iter().zip(self.window.u0..) {
                let du = u as f64 - centre[0];
                if value <= 0.0 || du.abs() > reach {
                    continue;
                }
                // A soft edge of one pixel keeps the centroid a smooth function
                // of the window's place; only there the distance must be known.
                let square = du * du + dv * dv;
                let inside = if square < within {
                    1.0
                } else {
                    radius_px + 0.5 - du.hypot(dv)
                };
                if inside > 0.0 {
                    let w = f64::from(value) * inside.min(1.0);
                    sum += w;
                    u_sum += w * u as f64;
                    v_sum += w * v as f64;
                }
            }
        }
        if sum > 1e-6 {
            (sum, [u_sum / sum, v_sum / sum])
        } else {
            (0.0, centre)
        }
    }
}
