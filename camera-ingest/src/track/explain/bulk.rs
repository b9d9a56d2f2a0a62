//! What is too large to be a rope: people, doors, the arm.
//!
//! A rope fills little of its surroundings. Where evidence fills a large part of them,
//! something else is there, and what is seen there tells nothing about the rope.

use super::evidence::Scene;
use crate::frame::EyeFrame;

/// Cells along the picture's height.
const CELLS_HIGH: usize = 47;
/// Surroundings: this many cells to every side.
const AROUND: usize = 4;
/// Every which pixel of a cell is looked at, in both directions.
const EVERY: usize = 4;
/// Part of the surroundings from which evidence begins to count less, and from which it
/// counts nothing.
const FILLED: [f32; 2] = [0.45, 0.7];

/// How far evidence counts, in cells of one frame.
#[derive(Debug, Clone)]
pub(super) struct Bulk {
    cell_px: usize,
    columns: usize,
    counts: Vec<f32>,
}

impl Bulk {
    /// Of a frame with a gain against its scene.
    pub(super) fn of(frame: &EyeFrame, gain: f32, scene: &Scene) -> Self {
        let cell_px = (frame.height_px / CELLS_HIGH).max(EVERY);
        let columns = frame.width_px.div_ceil(cell_px);
        let rows = frame.height_px.div_ceil(cell_px);
        let mut filled = vec![[0.0_f32; 2]; columns * rows];
        for v in (0..frame.height_px).step_by(EVERY) {
            for u in (0..frame.width_px).step_by(EVERY) {
                let [sum, count] = &mut filled[v / cell_px * columns + u / cell_px];
                *sum += scene.unexplained_at(frame, gain, [u, v]);
                *count += 1.0;
            }
        }
        Self {
            cell_px,
            columns,
            counts: counts(&filled, columns, rows),
        }
    }

    /// From 0, in something large, to 1.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> f32 {
        let cell = |x: f64| (x.max(0.0) as usize) / self.cell_px;
        let at = cell(v) * self.columns + cell(u).min(self.columns - 1);
        self.counts.get(at).copied().unwrap_or(1.0)
    }

    /// Side of a cell (px).
    pub(super) fn cell_px(&self) -> usize {
        self.cell_px
    }
}

/// From evidence and number of looks per cell: means over the surroundings, from sums over
/// all cells above and to the left.
fn counts(filled: &[[f32; 2]], columns: usize, rows: usize) -> Vec<f32> {
    let [low, high] = FILLED;
    let wide = columns + 1;
    let mut sums = vec![[0.0_f32; 2]; wide * (rows + 1)];
    for row in 0..rows {
        let mut line = [0.0; 2];
        for column in 0..columns {
            for k in 0..2 {
                line[k] += filled[row * columns + column][k];
                sums[(row + 1) * wide + column + 1][k] = sums[row * wide + column + 1][k] + line[k];
            }
        }
    }
    let near = |at: usize, count: usize| (at.saturating_sub(AROUND), (at + AROUND + 1).min(count));
    let count = |at: usize| {
        let ((top, bottom), (left, right)) =
            (near(at / columns, rows), near(at % columns, columns));
        let [evidence, looks] = [0, 1].map(|k| {
            let sum = |row: usize, column: usize| sums[row * wide + column][k];
            sum(bottom, right) - sum(top, right) - sum(bottom, left) + sum(top, left)
        });
        ((high - evidence / looks.max(1.0)) / (high - low)).clamp(0.0, 1.0)
    };
    (0..columns * rows).map(count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walker_counts_nothing_and_a_rope_in_full() {
        let wall = |stamp_ns| EyeFrame {
            stamp_ns,
            ..EyeFrame::grey([400, 376], 160)
        };
        let scene = Scene::of(&[wall(1), wall(2), wall(3)], 3);
        let mut frame = wall(4);
        for v in 0..376 {
            for u in (60..180).chain(300..310) {
                frame.luma[v * 400 + u] = 250;
            }
        }
        let bulk = Bulk::of(&frame, 1.0, &scene);
        assert_eq!(bulk.at([120.0, 200.0]), 0.0);
        assert!(bulk.at([62.0, 200.0]) < 0.9, "the edge counts less");
        assert_eq!(bulk.at([305.0, 200.0]), 1.0);
        assert_eq!(bulk.at([399.0, 375.0]), 1.0);
    }
}
