//! Where the rope begins and ends: the median picture along the curves of all frames.
//!
//! In the curve's own frame everything else moves and fades; rope, pole and tip weight
//! stand still and sharp.

use super::colour::Colour;
use super::curve::{Pixel, across, from_end};
use super::statistics::median;

/// Contrast (levels) from which a colour is another one.
const OTHER_COLOUR: f64 = 18.0;

/// How far pictures of the free end reach to either side (columns), and how many columns that
/// are.
pub(super) const END_REACH: usize = 24;
pub(super) const COLUMNS: usize = 2 * END_REACH + 1;

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

/// What is seen in all frames around the last points of their curves, row by row.
fn seen<T, F: Fn(Pixel) -> Option<T>>(
    window: Window,
    frames: impl Iterator<Item = (Vec<Pixel>, F)>,
) -> Vec<Vec<T>> {
    let columns = window.columns();
    let mut seen: Vec<Vec<T>> = (0..window.rows() * columns).map(|_| Vec::new()).collect();
    for (curve, sample) in frames {
        for row in 0..window.rows() {
            let (p, t) = from_end(&curve, row as f64 - window.before as f64);
            for column in 0..columns {
                let aside = column as f64 - window.reach as f64;
                seen[row * columns + column].extend(sample(p + across(t) * aside));
            }
        }
    }
    seen
}

/// Median evidence over frames around one end of a curve.
#[derive(Debug, Clone)]
pub(super) struct EndPicture {
    window: Window,
    evidence: Vec<f64>,
}

impl EndPicture {
    /// From curves whose last points are the end, each with what gives evidence at a place of
    /// its frame. Medians leave out what passes by in some frames.
    pub(super) fn of<F: Fn(Pixel) -> Option<f32>>(
        window: Window,
        frames: impl Iterator<Item = (Vec<Pixel>, F)>,
    ) -> Self {
        let middle = |of: Vec<f32>| median(of.into_iter().map(f64::from));
        Self {
            window,
            evidence: seen(window, frames).into_iter().map(middle).collect(),
        }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.evidence[row * self.window.columns() + column]
    }

    /// Mean of three columns on the curve.
    fn on_curve(&self, value: impl Fn(usize) -> f64) -> f64 {
        let middle = self.window.reach - 1..=self.window.reach + 1;
        middle.map(value).sum::<f64>() / 3.0
    }

    /// Half of what is evident in a row, its edges at half of the middle's.
    fn half_width_px(&self, row: usize) -> f64 {
        let peak = self.on_curve(|c| self.at(row, c));
        let ground = 0.5 * (self.at(row, 1) + self.at(row, self.window.columns() - 2));
        let part =
            |c: usize| ((self.at(row, c) - ground) / (peak - ground).max(0.05)).clamp(0.0, 1.0);
        (0..self.window.columns()).map(part).sum::<f64>() / 2.0
    }

    /// Half the rope's width, well before the end.
    pub(super) fn rope_half_px(&self) -> f64 {
        median((0..self.window.before * 2 / 3).map(|row| self.half_width_px(row)))
    }

    /// Places along the curve from its end on (px), and the evidence across it there; of a
    /// picture that reaches [`END_REACH`].
    #[inline(always)]
    pub(super) fn rows(&self) -> impl Iterator<Item = (f64, &[f64; COLUMNS])> {
        debug_assert_eq!(self.window.reach, END_REACH);
        let (rows, _) = self.evidence.as_chunks();
        let before = self.window.before as f64;
        rows.iter()
            .enumerate()
            .map(move |(row, across)| (row as f64 - before, across))
    }
}

/// Rows before a clamp and beyond it in which the rope's beginning is looked for.
const CLAMP: Window = Window {
    before: 45,
    beyond: 25,
    reach: 1,
};

/// Where the rope begins, from the clamp of the hypothesis on (px): the colour of the pole or
/// of what clamps the rope begins there. From curves that end at the clamp, each with what
/// gives the colour at a place of its frame; `None` where no such change is seen.
pub(super) fn start_px<F: Fn(Pixel) -> Option<Colour>>(
    frames: impl Iterator<Item = (Vec<Pixel>, F)>,
) -> Option<f64> {
    /// How far off the camera's file may put the clamp (px).
    const OFF_PX: usize = 9;
    /// Rows compared on either side.
    const SIDE: usize = 6;
    let middle = |of: &Vec<Colour>| -> [f64; 3] {
        core::array::from_fn(|k| median(of.iter().map(|c| f64::from(c[k]))))
    };
    let medians: Vec<[f64; 3]> = seen(CLAMP, frames).iter().map(middle).collect();
    // Mean of the columns on the curve.
    let colours: Vec<[f64; 3]> = medians
        .chunks(CLAMP.columns())
        .map(|row| {
            core::array::from_fn(|k| row.iter().map(|c| c[k]).sum::<f64>() / row.len() as f64)
        })
        .collect();
    let mean = |rows: core::ops::Range<usize>| -> [f64; 3] {
        let count = rows.len() as f64;
        core::array::from_fn(|k| rows.clone().map(|r| colours[r][k]).sum::<f64>() / count)
    };
    let step = |row: usize| {
        let (rope, pole) = (mean(row - SIDE..row), mean(row..row + SIDE));
        (0..3)
            .map(|k| (pole[k] - rope[k]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let near = CLAMP.before - OFF_PX..=(CLAMP.before + OFF_PX).min(CLAMP.rows() - SIDE - 1);
    let most = near.clone().map(step).fold(0.0, f64::max);
    let is_top = |row: &usize| {
        let here = step(*row);
        let beside = (row - 2..=row + 2).map(step).fold(0.0, f64::max);
        here >= beside && here > (0.5 * most).max(2.0 * OTHER_COLOUR)
    };
    // The first one from the rope's side.
    near.into_iter().find(is_top).map(|row| {
        let off = |row: usize| row as f64 - 0.5 - CLAMP.before as f64;
        let weight = |row: usize| step(row).powi(4);
        let beside = row - 2..=row + 2;
        let moment: f64 = beside.clone().map(|r| weight(r) * off(r)).sum();
        -moment / beside.map(weight).sum::<f64>()
    })
}
