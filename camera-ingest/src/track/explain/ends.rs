//! Where the rope begins and ends: the mean picture along the curves of all frames.
//!
//! In the curve's own frame everything else moves and fades; rope, pole and tip weight
//! stand still and sharp.

use super::colour::Colour;
use super::curve::from_end;

/// Mean over frames around one end of a curve: rows along it, columns across.
#[derive(Debug, Clone)]
pub(super) struct EndPicture {
    /// Rows before the end; the rest lie beyond it.
    before: usize,
    rows: usize,
    /// Columns to either side.
    reach: usize,
    evidence: Vec<f64>,
    colour: Vec<[f64; 3]>,
    frames: f64,
}

/// Contrast (levels) from which a colour is another one.
const OTHER_COLOUR: f64 = 18.0;
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

impl EndPicture {
    pub(super) fn new(before: usize, beyond: usize, reach: usize) -> Self {
        let (rows, columns) = (before + beyond + 1, 2 * reach + 1);
        Self {
            before,
            rows,
            reach,
            evidence: vec![0.0; rows * columns],
            colour: vec![[0.0; 3]; rows * columns],
            frames: 0.0,
        }
    }

    fn columns(&self) -> usize {
        2 * self.reach + 1
    }

    /// Adds a frame: the curve's end is its last point; `sample` gives evidence and
    /// colour at a place.
    pub(super) fn add(
        &mut self,
        points: &[[f64; 2]],
        sample: impl Fn([f64; 2]) -> Option<(f32, Colour)>,
    ) {
        let columns = self.columns();
        for row in 0..self.rows {
            let (p, t) = from_end(points, row as f64 - self.before as f64);
            for column in 0..columns {
                let aside = column as f64 - self.reach as f64;
                let place = [p[0] - t[1] * aside, p[1] + t[0] * aside];
                if let Some((evidence, colour)) = sample(place) {
                    let at = row * columns + column;
                    self.evidence[at] += f64::from(evidence);
                    for (sum, c) in self.colour[at].iter_mut().zip(colour) {
                        *sum += f64::from(c);
                    }
                }
            }
        }
        self.frames += 1.0;
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.evidence[row * self.columns() + column] / self.frames.max(1.0)
    }

    /// Evidence on the curve.
    fn line(&self, row: usize) -> f64 {
        let middle = self.reach - 1..=self.reach + 1;
        middle.map(|c| self.at(row, c)).sum::<f64>() / 3.0
    }

    /// Colour on the curve.
    fn colour(&self, row: usize) -> [f64; 3] {
        let columns = self.columns();
        core::array::from_fn(|k| {
            let middle = self.reach - 1..=self.reach + 1;
            let sum: f64 = middle.map(|c| self.colour[row * columns + c][k]).sum();
            sum / (3.0 * self.frames.max(1.0))
        })
    }

    /// Half of what is evident in a row, its edges at half of the middle's.
    fn half_width_px(&self, row: usize) -> f64 {
        let peak = self.line(row);
        let ground = 0.5 * (self.at(row, 1) + self.at(row, self.columns() - 2));
        let part =
            |c: usize| ((self.at(row, c) - ground) / (peak - ground).max(0.05)).clamp(0.0, 1.0);
        (0..self.columns()).map(part).sum::<f64>() / 2.0
    }

    /// Half the rope's width, well before the end.
    pub(super) fn rope_half_px(&self) -> f64 {
        median(
            (0..self.before * 2 / 3)
                .map(|r| self.half_width_px(r))
                .collect(),
        )
    }

    /// Places along the curve from its end on and across it (px), and the evidence there.
    pub(super) fn places(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let px = |index: usize, middle: usize| index as f64 - middle as f64;
        (0..self.rows).flat_map(move |row| {
            let at = move |c| (px(row, self.before), px(c, self.reach), self.at(row, c));
            (0..self.columns()).map(at)
        })
    }

    /// Where the rope begins, from the clamp of the hypothesis on (px): the colour of the
    /// pole or of what clamps the rope begins there. For a picture whose curves end at the
    /// clamp; `None` where no such change is seen.
    pub(super) fn start_px(&self) -> Option<f64> {
        /// How far off the camera's file may put the clamp (px).
        const OFF_PX: usize = 9;
        /// Rows compared on either side.
        const SIDE: usize = 6;
        let mean = |rows: core::ops::Range<usize>| -> [f64; 3] {
            let count = rows.len() as f64;
            core::array::from_fn(|k| rows.clone().map(|r| self.colour(r)[k]).sum::<f64>() / count)
        };
        let step = |row: usize| {
            let (rope, pole) = (mean(row - SIDE..row), mean(row..row + SIDE));
            (0..3)
                .map(|k| (pole[k] - rope[k]).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        let near = self.before - OFF_PX..=(self.before + OFF_PX).min(self.rows - SIDE - 1);
        let most = near.clone().map(step).fold(0.0, f64::max);
        let is_top = |row: &usize| {
            let here = step(*row);
            let beside = (row - 2..=row + 2).map(step).fold(0.0, f64::max);
            here >= beside && here > (0.5 * most).max(2.0 * OTHER_COLOUR)
        };
        // The first one from the rope's side.
        near.into_iter().find(is_top).map(|row| {
            let off = |row: usize| row as f64 - 0.5 - self.before as f64;
            let weight = |row: usize| step(row).powi(4);
            let beside = row - 2..=row + 2;
            let moment: f64 = beside.clone().map(|r| weight(r) * off(r)).sum();
            -moment / beside.map(weight).sum::<f64>()
        })
    }
}
