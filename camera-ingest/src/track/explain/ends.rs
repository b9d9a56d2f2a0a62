//! Where the rope begins and ends: the median picture along the curves of all frames.
//!
//! In the curve's own frame everything else moves and fades; rope, pole and tip weight
//! stand still and sharp.

use super::colour::Colour;
use super::curve::from_end;

/// What is around one end of a curve: rows along it, columns across.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    /// Rows before the end and beyond it.
    pub(super) before: usize,
    pub(super) beyond: usize,
    /// Columns to either side.
    pub(super) reach: usize,
}

impl Window {
    fn rows(self) -> usize {
        self.before + self.beyond + 1
    }

    fn columns(self) -> usize {
        2 * self.reach + 1
    }
}

/// Frames around one end, of which a picture is made.
#[derive(Debug)]
pub(super) struct EndFrames {
    window: Window,
    /// Evidence and colour in every frame, place by place.
    seen: Vec<Vec<[f32; 4]>>,
}

/// Median over frames around one end of a curve.
#[derive(Debug, Clone)]
pub(super) struct EndPicture {
    window: Window,
    evidence: Vec<f64>,
    colour: Vec<[f64; 3]>,
}

/// Contrast (levels) from which a colour is another one.
const OTHER_COLOUR: f64 = 18.0;
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

impl EndFrames {
    pub(super) fn new(window: Window) -> Self {
        Self {
            window,
            seen: vec![Vec::new(); window.rows() * window.columns()],
        }
    }

    /// Adds a frame: the curve's end is its last point; `sample` gives evidence and
    /// colour at a place.
    pub(super) fn add(
        &mut self,
        points: &[[f64; 2]],
        sample: impl Fn([f64; 2]) -> Option<(f32, Colour)>,
    ) {
        let columns = self.window.columns();
        for row in 0..self.window.rows() {
            let (p, t) = from_end(points, row as f64 - self.window.before as f64);
            for column in 0..columns {
                let aside = column as f64 - self.window.reach as f64;
                let place = [p[0] - t[1] * aside, p[1] + t[0] * aside];
                if let Some((evidence, [a, b, c])) = sample(place) {
                    self.seen[row * columns + column].push([evidence, a, b, c]);
                }
            }
        }
    }

    /// Medians: what passes by in some frames is left out.
    pub(super) fn picture(&self) -> EndPicture {
        let mut values = Vec::new();
        let mut middle = |seen: &Vec<[f32; 4]>, k: usize| {
            values.clear();
            values.extend(seen.iter().map(|s| s[k]));
            let at = values.len() / 2;
            let middle = |v: &mut Vec<f32>| *v.select_nth_unstable_by(at, f32::total_cmp).1;
            (!values.is_empty()).then(|| f64::from(middle(&mut values)))
        };
        let mut median = |k: usize| -> Vec<f64> {
            let of = |seen| middle(seen, k).unwrap_or(0.0);
            self.seen.iter().map(of).collect()
        };
        let [evidence, y, cb, cr] = [0, 1, 2, 3].map(&mut median);
        let colour = y.into_iter().zip(cb).zip(cr);
        EndPicture {
            window: self.window,
            evidence,
            colour: colour.map(|((y, cb), cr)| [y, cb, cr]).collect(),
        }
    }
}

impl EndPicture {
    fn at(&self, row: usize, column: usize) -> f64 {
        self.evidence[row * self.window.columns() + column]
    }

    /// Evidence on the curve.
    fn line(&self, row: usize) -> f64 {
        let middle = self.window.reach - 1..=self.window.reach + 1;
        middle.map(|c| self.at(row, c)).sum::<f64>() / 3.0
    }

    /// Colour on the curve.
    fn colour(&self, row: usize) -> [f64; 3] {
        let columns = self.window.columns();
        core::array::from_fn(|k| {
            let middle = self.window.reach - 1..=self.window.reach + 1;
            middle
                .map(|c| self.colour[row * columns + c][k])
                .sum::<f64>()
                / 3.0
        })
    }

    /// Half of what is evident in a row, its edges at half of the middle's.
    fn half_width_px(&self, row: usize) -> f64 {
        let peak = self.line(row);
        let ground = 0.5 * (self.at(row, 1) + self.at(row, self.window.columns() - 2));
        let part =
            |c: usize| ((self.at(row, c) - ground) / (peak - ground).max(0.05)).clamp(0.0, 1.0);
        (0..self.window.columns()).map(part).sum::<f64>() / 2.0
    }

    /// Half the rope's width, well before the end.
    pub(super) fn rope_half_px(&self) -> f64 {
        median(
            (0..self.window.before * 2 / 3)
                .map(|r| self.half_width_px(r))
                .collect(),
        )
    }

    /// Places along the curve from its end on and across it (px), and the evidence there.
    pub(super) fn places(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let px = |index: usize, middle: usize| index as f64 - middle as f64;
        (0..self.window.rows()).flat_map(move |row| {
            let at = move |c| {
                (
                    px(row, self.window.before),
                    px(c, self.window.reach),
                    self.at(row, c),
                )
            };
            (0..self.window.columns()).map(at)
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
        let near = self.window.before - OFF_PX
            ..=(self.window.before + OFF_PX).min(self.window.rows() - SIDE - 1);
        let most = near.clone().map(step).fold(0.0, f64::max);
        let is_top = |row: &usize| {
            let here = step(*row);
            let beside = (row - 2..=row + 2).map(step).fold(0.0, f64::max);
            here >= beside && here > (0.5 * most).max(2.0 * OTHER_COLOUR)
        };
        // The first one from the rope's side.
        near.into_iter().find(is_top).map(|row| {
            let off = |row: usize| row as f64 - 0.5 - self.window.before as f64;
            let weight = |row: usize| step(row).powi(4);
            let beside = row - 2..=row + 2;
            let moment: f64 = beside.clone().map(|r| weight(r) * off(r)).sum();
            -moment / beside.map(weight).sum::<f64>()
        })
    }
}
