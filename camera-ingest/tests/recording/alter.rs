//! What goes wrong with recordings, done to good ones.
#![allow(dead_code, reason = "not every test file uses everything")]

use super::Wiggle;
use super::recording::median;
use camera_ingest::ImageFrame;
use camera_ingest::frame::ycc_from_rgb;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::ops::Range;

fn byte(x: f64) -> u8 {
    x.round().clamp(0.0, 255.0) as u8
}

/// Luma and chroma planes, and how many pixels of a row a value stands for.
fn planes(frame: &mut ImageFrame) -> [(&mut Vec<u8>, usize); 3] {
    [(&mut frame.luma, 1), (&mut frame.cb, 2), (&mut frame.cr, 2)]
}

/// How another rope swings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SecondRope {
    /// Its clamp, to the right of the first one's (px).
    pub(crate) away_px: f64,
    pub(crate) rate_hz: f64,
    /// Where it begins.
    pub(crate) phase_rad: f64,
}

impl Wiggle {
    fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        let mut at = 0..;
        self.frames.retain(|_| wanted(at.next().unwrap()));
        let mut at = 0..;
        self.truth.retain(|_| wanted(at.next().unwrap()));
    }

    /// A part of the frames is missing, here and there.
    pub(crate) fn dropped(mut self, part: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let frames = self.frames.iter();
        let lost: Vec<bool> = frames.map(|_| rng.random::<f64>() < part).collect();
        self.keep(|i| i == 0 || !lost[i]);
        self
    }

    /// Some frames in a row are missing.
    pub(crate) fn without(mut self, gap: Range<usize>) -> Self {
        self.keep(|i| !gap.contains(&i));
        self
    }

    /// The exposure drifts until the last frame is `last` times as bright.
    pub(crate) fn drifting(mut self, last: f64) -> Self {
        let count = (self.frames.len() - 1) as f64;
        for (i, frame) in self.frames.iter_mut().enumerate() {
            let gain = 1.0 + (last - 1.0) * i as f64 / count;
            for y in &mut frame.luma {
                *y = byte(f64::from(*y) * gain);
            }
            for c in frame.cb.iter_mut().chain(&mut frame.cr) {
                *c = byte(128.0 + (f64::from(*c) - 128.0) * gain);
            }
        }
        self
    }

    /// Adds noise of a standard deviation (levels of 255; half of it in chroma).
    pub(crate) fn noisy(mut self, sigma: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for (plane, step) in self.frames.iter_mut().flat_map(planes) {
            let noise = Normal::new(0.0, sigma / step as f64).unwrap();
            for value in plane {
                *value = byte(f64::from(*value) + noise.sample(&mut rng));
            }
        }
        self
    }

    /// A hand goes before the middle of the rope for some frames.
    pub(crate) fn covered(mut self, during: Range<usize>) -> Self {
        let [y, cb, cr] = ycc_from_rgb([198, 150, 125]);
        let middle = self.nodes() / 2;
        for i in during {
            let [u, v] = self.truth[i][middle];
            // 9 cm by 16 cm at this distance.
            let inside = |x: f64, w: f64| ((x - u) / 17.0).powi(2) + ((w - v) / 30.0).powi(2) < 1.0;
            let around = [u - 18.0, v - 31.0, u + 18.0, v + 31.0];
            paint(&mut self.frames[i], around, [y, cb, cr], inside);
        }
        self
    }

    /// A second rope of the same colours swings next to the first one, held by
    /// something else.
    pub(crate) fn doubled(mut self, second: SecondRope, rgb: [[u8; 3]; 2]) -> Self {
        let [rope, lead] = rgb.map(ycc_from_rgb);
        let away_px = second.away_px;
        let start = self.truth[0].clone();
        let last = start.len() - 1;
        for (i, frame) in self.frames.iter_mut().enumerate() {
            let turns = second.rate_hz * i as f64 / 60.0;
            let swing = 0.5 * (std::f64::consts::TAU * turns + second.phase_rad).sin();
            let points: Vec<[f64; 2]> = start
                .iter()
                .map(|p| {
                    let down = p[1] - start[0][1];
                    let angle = swing * (1.0 + 0.3 * down / 200.0);
                    [
                        start[0][0] + away_px + down * angle.sin(),
                        start[0][1] + down * angle.cos(),
                    ]
                })
                .collect();
            let stroke = |frame: &mut ImageFrame, a: [f64; 2], b: [f64; 2], radius: f64, colour| {
                let low = [0, 1].map(|k| a[k].min(b[k]) - radius - 1.0);
                let high = [0, 1].map(|k| a[k].max(b[k]) + radius + 1.0);
                let inside = |x, y| distance([x, y], a, b) < radius;
                paint(frame, [low[0], low[1], high[0], high[1]], colour, inside);
            };
            for pair in points.windows(2) {
                stroke(frame, pair[0], pair[1], 2.3, rope);
            }
            stroke(frame, points[last], points[last], 7.0, lead);
        }
        self
    }

    /// Twice the motion blur: what differs from the still scene is smeared along
    /// its own motion. Boxes of lengths 1 and sqrt(3) have together twice the
    /// spread of the first.
    pub(crate) fn smeared(mut self) -> Self {
        const SAMPLES: usize = 9;
        let mut scene = median(&self.frames);
        let last = self.frames.len() - 1;
        for i in 0..=last {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            let dt = (self.frames[b].stamp_ns - self.frames[a].stamp_ns) as f64 * 1e-9;
            let exposure = 3.0_f64.sqrt() * self.camera.exposure_s / dt;
            let nodes = self.truth[a].iter().zip(&self.truth[b]).zip(&self.truth[i]);
            let nodes = nodes.map(|((a, b), here)| {
                let way = [0, 1].map(|k| (b[k] - a[k]) * exposure);
                (*here, way, (14.0 + way[0].hypot(way[1])).powi(2))
            });
            let nodes: Vec<_> = nodes.collect();
            let off2 = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2);
            let width = self.frames[i].width_px;
            let planes = planes(&mut self.frames[i]).into_iter();
            for ((plane, step), (still, _)) in planes.zip(self::planes(&mut scene)) {
                let row = width / step;
                let from = plane.clone();
                let smeared = |at: usize| {
                    let p = [(at % row * step) as f64, (at / row) as f64];
                    let off2 = |node: &&([f64; 2], _, _)| off2(p, node.0);
                    let nearest = nodes.iter().min_by(|x, y| off2(x).total_cmp(&off2(y)));
                    let (_, [du, dv], _) = nearest.filter(|node| off2(node) <= node.2)?;
                    let change = |k: usize| {
                        let part = (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
                        let x = ((p[0] - part * du) / step as f64).round();
                        let y = (p[1] - part * dv).round();
                        let x = x.clamp(0.0, (row - 1) as f64) as usize;
                        let y = y.clamp(0.0, (from.len() / row - 1) as f64) as usize;
                        f64::from(from[y * row + x]) - f64::from(still[y * row + x])
                    };
                    let sum: f64 = (0..SAMPLES).map(change).sum();
                    Some(byte(f64::from(still[at]) + sum / SAMPLES as f64))
                };
                for (at, value) in plane.iter_mut().enumerate() {
                    *value = smeared(at).unwrap_or(*value);
                }
            }
        }
        self
    }

    /// Out of focus: a Gaussian of the given spread (px).
    pub(crate) fn defocused(mut self, sigma_px: f64) -> Self {
        let width = self.frames[0].width_px;
        for (plane, step) in self.frames.iter_mut().flat_map(planes) {
            *plane = gaussian(plane, width / step, [sigma_px / step as f64, sigma_px]);
        }
        self
    }

    /// Everything seen in a mirror: the same as a mirrored world filmed by a
    /// mirrored camera.
    pub(crate) fn mirrored(mut self) -> Self {
        let width = self.frames[0].width_px;
        for (plane, step) in self.frames.iter_mut().flat_map(planes) {
            plane
                .chunks_exact_mut(width / step)
                .for_each(<[u8]>::reverse);
        }
        let last = width as f64 - 1.0;
        self.truth
            .iter_mut()
            .flatten()
            .for_each(|p| p[0] = last - p[0]);
        let image = &mut self.camera.left;
        image.cx = last - image.cx;
        image.distortion[3] = -image.distortion[3];
        let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        self.camera.r_w_cam = mirror * self.camera.r_w_cam * mirror;
        self.camera.p_w_cam_m = mirror * self.camera.p_w_cam_m;
        for pose in &mut self.poses {
            pose.p_m[0] = -pose.p_m[0];
            // Turns about axes in the mirror go the other way round.
            let [w, x, y, z] = pose.q_wxyz;
            pose.q_wxyz = [w, x, -y, -z];
        }
        self
    }

    /// A camera turned by 90 degrees about its optical axis: the picture's right
    /// becomes its bottom.
    pub(crate) fn turned(mut self) -> Self {
        let (w, h) = (self.frames[0].width_px, self.frames[0].height_px);
        for frame in &mut self.frames {
            // (u, v) -> (h - 1 - v, u).
            let source = frame.clone();
            let at = |u: usize, v: usize| source.ycc(v, h - 1 - u);
            (frame.width_px, frame.height_px) = (h, w);
            frame.luma = (0..w * h).map(|i| at(i % h, i / h)[0]).collect();
            let chroma = |k: usize| -> Vec<u8> {
                (0..w * h / 2)
                    .map(|i| {
                        let (u, v) = (i % (h / 2) * 2, i / (h / 2));
                        at(u, v)[k].midpoint(at(u + 1, v)[k])
                    })
                    .collect()
            };
            (frame.cb, frame.cr) = (chroma(1), chroma(2));
        }
        let last = h as f64 - 1.0;
        self.truth
            .iter_mut()
            .flatten()
            .for_each(|p| *p = [last - p[1], p[0]]);
        // New axes: x' = -y, y' = x.
        let turn = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let camera = &mut self.camera;
        camera.r_w_cam *= turn.transpose();
        (camera.width_px, camera.height_px) = (camera.height_px, camera.width_px);
        let image = camera.left;
        let [k1, k2, p1, p2, k3] = image.distortion;
        camera.left.fx = image.fy;
        camera.left.fy = image.fx;
        camera.left.cx = last - image.cy;
        camera.left.cy = image.cx;
        camera.left.distortion = [k1, k2, p2, -p1, k3];
        self
    }
}

/// Paints within a box `[u0, v0, u1, v1]`.
fn paint(
    frame: &mut ImageFrame,
    [u0, v0, u1, v1]: [f64; 4],
    [y, cb, cr]: [f32; 3],
    inside: impl Fn(f64, f64) -> bool,
) {
    let width = frame.width_px;
    let bound = |x: f64, most: usize| x.clamp(0.0, most as f64) as usize;
    for v in bound(v0, frame.height_px)..bound(v1, frame.height_px) {
        for u in bound(u0, width)..bound(u1, width) {
            if inside(u as f64, v as f64) {
                frame.luma[v * width + u] = y as u8;
                frame.cb[v * (width / 2) + u / 2] = cb as u8;
                frame.cr[v * (width / 2) + u / 2] = cr as u8;
            }
        }
    }
}

fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let long = (d[0] * d[0] + d[1] * d[1]).max(1e-9);
    let part = ((d[0] * e[0] + d[1] * e[1]) / long).clamp(0.0, 1.0);
    (e[0] - part * d[0]).hypot(e[1] - part * d[1])
}

/// A plane blurred along rows and columns (px).
fn gaussian(plane: &[u8], width: usize, sigma: [f64; 2]) -> Vec<u8> {
    let height = plane.len() / width;
    let kernel = |s: f64| -> Vec<f64> {
        let reach = (3.0 * s).ceil() as i32;
        let raw = (-reach..=reach).map(|i| (-0.5 * (f64::from(i) / s).powi(2)).exp());
        let sum: f64 = raw.clone().sum();
        raw.map(|k| k / sum).collect()
    };
    let pass = |from: &[f64], k: &[f64], [du, dv]: [isize; 2]| -> Vec<f64> {
        let reach = (k.len() / 2) as isize;
        let at = |at: usize, d: isize| {
            let (u, v) = ((at % width) as isize, (at / width) as isize);
            let u = (u + d * du).clamp(0, width as isize - 1) as usize;
            let v = (v + d * dv).clamp(0, height as isize - 1) as usize;
            from[v * width + u]
        };
        let sum = |i: usize| k.iter().zip(-reach..).map(|(k, d)| k * at(i, d)).sum();
        (0..from.len()).map(sum).collect()
    };
    let start: Vec<f64> = plane.iter().map(|&b| f64::from(b)).collect();
    let rows = pass(&start, &kernel(sigma[0]), [1, 0]);
    let both = pass(&rows, &kernel(sigma[1]), [0, 1]);
    both.into_iter().map(byte).collect()
}
