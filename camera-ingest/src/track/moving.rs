//! What differs from the scene without rope.

use super::models::ModelError;
use crate::frame::EyeFrame;
use crate::vectors::widest;

/// What is known when the first frame is looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct FirstScene<'a> {
    /// The frame; the rope hangs still in it.
    pub(super) frame: &'a EyeFrame,
    /// The scene without rope.
    pub(super) empty: &'a EyeFrame,
    /// Brightness of the frame relative to the scene without rope.
    pub(super) gain: f32,
    /// Typical distance of a still pixel from the scene without rope (grey levels).
    pub(super) noise: f32,
}

/// Says which pixels of the first frame are rope and lead.
pub(super) trait FirstMask {
    /// One value a pixel, row by row. More than the rope may be in it: what does not
    /// hang on the clamp, or lies beyond the lead, is left out later.
    ///
    /// # Errors
    /// No answer.
    fn mask(&mut self, scene: &FirstScene<'_>) -> Result<Vec<bool>, ModelError>;
}

/// What differs from the scene without rope: the built-in mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Moving;

impl FirstMask for Moving {
    fn mask(&mut self, scene: &FirstScene<'_>) -> Result<Vec<bool>, ModelError> {
        Ok(moving(scene))
    }
}

/// Threshold of the moving mask in units of the image noise.
const MASK_NOISE: f32 = 2.5;
/// Least threshold (grey levels): reflected light and compression stay below.
const MASK_LEAST: f32 = 6.0;

/// Pixels that differ from the background, smoothed over 3x3 pixels.
pub(super) fn moving(scene: &FirstScene<'_>) -> Vec<bool> {
    let (width, height) = (scene.frame.width_px, scene.frame.height_px);
    let threshold = 9.0 * (MASK_NOISE * scene.noise).max(MASK_LEAST).powi(2);
    let mut mask = vec![false; width * height];
    // Sums of three along the rows, then of three rows; the border is never moving.
    let mut square = vec![0.0; width];
    let mut threes = [(); 3].map(|()| vec![0.0; width]);
    widest(
        #[inline(always)]
        || {
            for v in 0..height {
                threes.rotate_left(1);
                let [above, here, below] = &mut threes;
                squares(scene, v, &mut square);
                for (near, out) in square.windows(3).zip(&mut below[1..]) {
                    *out = near[0] + near[1] + near[2];
                }
                if v < 2 {
                    continue;
                }
                let row = &mut mask[(v - 1) * width..v * width];
                let sums = above.iter().zip(&*here).zip(&*below).zip(row);
                for (((above, here), below), out) in sums.skip(1).take(width - 2) {
                    *out = above + here + below > threshold;
                }
            }
        },
    );
    mask
}

/// Squared distance of every pixel's colour in a row, in the background's light, from the
/// background.
#[inline(always)]
fn squares(scene: &FirstScene<'_>, v: usize, out: &mut [f32]) {
    let FirstScene {
        frame, empty, gain, ..
    } = scene;
    let chroma =
        |seen: u8, empty: u8| ((f32::from(seen) - 128.0) / gain + 128.0 - f32::from(empty)).powi(2);
    let pixels = v * frame.width_px..(v + 1) * frame.width_px;
    let samples = pixels.start / 2..pixels.end / 2;
    let luma = frame.luma[pixels.clone()].chunks_exact(2);
    let luma = luma.zip(empty.luma[pixels].chunks_exact(2));
    let blue = frame.cb[samples.clone()]
        .iter()
        .zip(&empty.cb[samples.clone()]);
    let red = frame.cr[samples.clone()].iter().zip(&empty.cr[samples]);
    for (pair, ((y, ey), (b, r))) in out.chunks_exact_mut(2).zip(luma.zip(blue.zip(red))) {
        let (b, r) = (chroma(*b.0, *b.1), chroma(*r.0, *r.1));
        for k in 0..2 {
            pair[k] = (f32::from(y[k]) / gain - f32::from(ey[k])).powi(2) + b + r;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::EyeFrame;

    const WIDTH: usize = 38;
    const HEIGHT: usize = 11;

    /// Any frame does; this one is darker here and there.
    fn frame(period: usize, level: usize) -> EyeFrame {
        let plane = |count: usize, level: usize, deep: usize| -> Vec<u8> {
            (0..count)
                .map(|i| (level - if i * i % period < 9 { deep } else { i % 3 }) as u8)
                .collect()
        };
        EyeFrame {
            stamp_ns: 0,
            sequence: 0,
            width_px: WIDTH,
            height_px: HEIGHT,
            luma: plane(WIDTH * HEIGHT, level, 28),
            cb: plane(WIDTH * HEIGHT / 2, 130, 6),
            cr: plane(WIDTH * HEIGHT / 2, 126, 4),
        }
    }

    #[test]
    fn a_pixel_moves_where_its_surroundings_differ() {
        let (seen, empty, gain) = (frame(151, 140), frame(9999, 155), 0.9);
        let scene = FirstScene {
            frame: &seen,
            empty: &empty,
            gain,
            noise: 1.0,
        };
        let mask = moving(&scene);
        let square = |u: usize, v: usize| -> f32 {
            let (y, e) = (
                seen.ycc(u, v).map(f32::from),
                empty.ycc(u, v).map(f32::from),
            );
            (y[0] / gain - e[0]).powi(2)
                + ((y[1] - 128.0) / gain + 128.0 - e[1]).powi(2)
                + ((y[2] - 128.0) / gain + 128.0 - e[2]).powi(2)
        };
        let mut count = 0;
        for v in 0..HEIGHT {
            for u in 0..WIDTH {
                let inside = (1..WIDTH - 1).contains(&u) && (1..HEIGHT - 1).contains(&v);
                let sum = |v: usize| (u - 1..=u + 1).map(|u| square(u, v)).sum::<f32>();
                let wanted =
                    inside && (v - 1..=v + 1).map(sum).sum::<f32>() > 9.0 * MASK_LEAST * MASK_LEAST;
                assert_eq!(mask[v * WIDTH + u], wanted, "{u} {v}");
                count += usize::from(wanted);
            }
        }
        assert!((50..250).contains(&count), "{count}");
    }
}
