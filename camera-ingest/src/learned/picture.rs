//! Pictures as a network takes them: red, green and blue planes from 0 to 1.

use crate::frame::ImageFrame;

/// Width and height (px).
pub(super) type Size = [usize; 2];

/// Size of a frame.
pub(super) fn size_of(frame: &ImageFrame) -> Size {
    [frame.width_px, frame.height_px]
}

/// Appends the three planes of a frame, scaled to a size (bilinear).
pub(super) fn append_planes(frame: &ImageFrame, size: Size, out: &mut Vec<f32>) {
    let rgb = frame.to_rgb();
    let from = size_of(frame);
    for channel in 0..3 {
        let plane: Vec<f32> = rgb
            .chunks_exact(3)
            .map(|pixel| f32::from(pixel[channel]) / 255.0)
            .collect();
        if from == size {
            out.extend(plane);
        } else {
            out.extend(scaled(&plane, from, size));
        }
    }
}

/// A plane scaled from one size to another, bilinear, borders continued.
pub(super) fn scaled(plane: &[f32], from: Size, to: Size) -> Vec<f32> {
    let axis = |k: usize| -> Vec<(usize, usize, f32)> {
        let last = from[k] - 1;
        (0..to[k])
            .map(|at| {
                let place = place_in([at as f64; 2], to, from)[k].clamp(0.0, last as f64);
                let low = place as usize;
                (low, (low + 1).min(last), (place - low as f64) as f32)
            })
            .collect()
    };
    let columns = axis(0);
    let mut out = Vec::with_capacity(to[0] * to[1]);
    for (top, bottom, down) in axis(1) {
        let (top, bottom) = (&plane[top * from[0]..], &plane[bottom * from[0]..]);
        out.extend(columns.iter().map(|&(left, right, along)| {
            let row = |row: &[f32]| row[left] + (row[right] - row[left]) * along;
            row(top) + (row(bottom) - row(top)) * down
        }));
    }
    out
}

/// Where a pixel of one picture lies in the same picture of another size; whole
/// numbers are the pixels' centres.
pub(super) fn place_in(pixel: [f64; 2], from: Size, to: Size) -> [f64; 2] {
    core::array::from_fn(|k| (pixel[k] + 0.5) * to[k] as f64 / from[k] as f64 - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_keeps_a_ramp_and_places_go_there_and_back() {
        let (from, to) = ([8, 4], [16, 8]);
        let ramp: Vec<f32> = (0..32).map(|i| (i % 8) as f32).collect();
        let double = scaled(&ramp, from, to);
        for u in 1..15 {
            let [x, _] = place_in([u as f64, 0.0], to, from);
            assert!((double[3 * 16 + u] - x as f32).abs() < 1e-6, "column {u}");
        }
        let there = place_in([3.25, 1.5], from, to);
        let back = place_in(there, to, from);
        assert!((back[0] - 3.25).abs() < 1e-12 && (back[1] - 1.5).abs() < 1e-12);
    }
}
