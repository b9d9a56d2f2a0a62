//! The scene without the rope, and how noisy it is.

use crate::frame::EyeFrame;

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
            let mut values = vec![0_u8; planes.len()];
            (0..planes[0].len())
                .map(|at| {
                    for (value, plane) in values.iter_mut().zip(&planes) {
                        *value = plane[at];
                    }
                    *values.select_nth_unstable(planes.len() / 2).1
                })
                .collect()
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
