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

/// Where the tip weight is, from the hypothesis's end on (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub(super) centre_px: f64,
    pub(super) radius_px: f64,
    /// Half the rope's width.
    pub(super) rope_half_px: f64,
}

/// Contrast (levels) from which a colour is another one.
const OTHER_COLOUR: f64 = 18.0;
/// The weight is looked for this far before its edge (px).
const WEIGHT_PX: usize = 30;

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

    fn middle_colour(&self, rows: core::ops::Range<usize>) -> [f64; 3] {
        core::array::from_fn(|k| median(rows.clone().map(|r| self.colour(r)[k]).collect()))
    }

    /// Half of what is evident in a row, its edges at half of the middle's.
    fn half_width_px(&self, row: usize) -> f64 {
        let peak = self.line(row);
        let ground = 0.5 * (self.at(row, 1) + self.at(row, self.columns() - 2));
        let part =
            |c: usize| ((self.at(row, c) - ground) / (peak - ground).max(0.05)).clamp(0.0, 1.0);
        (0..self.columns()).map(part).sum::<f64>() / 2.0
    }

    /// Where the evidence ends, and the tip weight before that.
    pub(super) fn end(&self) -> End {
        let inner = self.before * 2 / 3;
        let level = median((0..inner).map(|r| self.line(r)).collect()).max(0.05);
        let floor = median((self.rows - 12..self.rows).map(|r| self.line(r)).collect());
        let floor = floor.min(0.6 * level);
        let half = f64::midpoint(floor, level);
        let edge = (inner..self.rows - 3)
            .find(|row| (*row..row + 3).all(|r| self.line(r) < half))
            .unwrap_or(self.rows - 1);
        let (last, first) = (self.line(edge - 1), self.line(edge));
        let part = if last > first {
            ((last - half) / (last - first)).clamp(0.0, 1.0)
        } else {
            0.5
        };
        let edge_px = edge as f64 - 1.0 + part - self.before as f64;
        let rope_half_px = median((0..inner).map(|r| self.half_width_px(r)).collect());
        // The widest row that its own width lets belong to a disc at the edge.
        let mut radius_px = rope_half_px;
        for row in edge.saturating_sub(WEIGHT_PX)..edge {
            let wide_px = self.half_width_px(row);
            if (edge - row) as f64 <= 1.8 * wide_px {
                radius_px = radius_px.max(wide_px);
            }
        }
        let radius_px = self.radius_by_colour(edge, edge_px, inner, radius_px);
        End {
            centre_px: edge_px - radius_px,
            radius_px,
            rope_half_px,
        }
    }

    /// The tip weight's radius where it has a colour of its own; else that by its width.
    fn radius_by_colour(&self, edge: usize, edge_px: f64, inner: usize, by_width_px: f64) -> f64 {
        let rope = self.middle_colour(0..inner);
        let differs = |row: usize| {
            let colour = self.colour(row);
            let square: f64 = (0..3).map(|k| (colour[k] - rope[k]).powi(2)).sum();
            square.sqrt()
        };
        // Where the end itself fades, the colour turns into the scene's.
        let whole = |row: &usize| self.line(*row) > 0.75 * self.line(inner);
        let near = (edge.saturating_sub(12)..edge).filter(whole);
        let Some(peak) = near.max_by(|a, b| differs(*a).total_cmp(&differs(*b))) else {
            return by_width_px;
        };
        if differs(peak) < OTHER_COLOUR {
            return by_width_px;
        }
        let top = (inner..=peak)
            .rev()
            .find(|row| differs(*row) <= 0.5 * differs(peak))
            .unwrap_or(inner);
        let by_colour_px = (edge_px - (top as f64 + 0.5 - self.before as f64)) / 2.0;
        if by_colour_px > 1.6 * by_width_px + 2.0 {
            // Something else is behind the end.
            return by_width_px;
        }
        // Light around an edge makes it look a little wider than its colour does.
        0.5 * (by_width_px.min(by_colour_px + 2.0) + by_colour_px)
    }

    /// Centre, beyond the curve's end, and radius of the disc at the free end (px), where
    /// the evidence is how much of a pixel is covered: half the covered width `w` of the
    /// rows `s` beyond its widest one obeys `w² + s² = r² - c² + 2 c s`. `None` where there
    /// is no such end.
    pub(super) fn disc(&self) -> Option<[f64; 2]> {
        /// The centre is within this of the curve's end (px).
        const OFF_PX: usize = 8;
        let half_width = |row: usize| {
            let columns = self.columns();
            let ground = 0.5 * (self.at(row, 0) + self.at(row, columns - 1));
            let sum: f64 = (0..columns)
                .map(|c| (self.at(row, c) - ground).max(0.0))
                .sum();
            sum / 2.0
        };
        let near = self.before - OFF_PX..=self.before + OFF_PX;
        let widest = near.max_by(|a, b| half_width(*a).total_cmp(&half_width(*b)))?;
        let most = half_width(widest);
        let rows = (widest..self.rows).take_while(|row| half_width(*row) > 0.3 * most);
        let points: Vec<[f64; 2]> = rows
            .map(|row| {
                let s = row as f64 - self.before as f64;
                [s, half_width(row).powi(2) + s * s]
            })
            .collect();
        if points.len() < 3 || most < 1.0 {
            return None;
        }
        let count = points.len() as f64;
        let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / count;
        let (s, y) = (mean(0), mean(1));
        let product: f64 = points.iter().map(|p| (p[0] - s) * (p[1] - y)).sum();
        let square: f64 = points.iter().map(|p| (p[0] - s).powi(2)).sum();
        let centre = 0.5 * product / square;
        let radius = (y - 2.0 * centre * s + centre * centre).max(0.0).sqrt();
        let plausible = centre.abs() <= OFF_PX as f64 && radius < 2.0 * most && radius > 0.5 * most;
        // What is lit from one side is covered in part only by its colours.
        let middle = (self.before as f64 + centre).round().max(2.0) as usize;
        let covered = (middle - 2..=middle + 2).map(|r| self.line(r)).sum::<f64>() / 5.0;
        plausible.then(|| [centre, radius / covered.clamp(0.6, 1.0)])
    }

    /// Where the rope begins, from the clamp of the hypothesis on (px): the colour of the
    /// pole or of what clamps the rope begins there. For a picture whose curves end at the
    /// clamp; 0 where no such change is seen.
    pub(super) fn start_px(&self) -> f64 {
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
        near.into_iter().find(is_top).map_or(0.0, |row| {
            let off = |row: usize| row as f64 - 0.5 - self.before as f64;
            let weight = |row: usize| step(row).powi(4);
            let beside = row - 2..=row + 2;
            let moment: f64 = beside.clone().map(|r| weight(r) * off(r)).sum();
            -moment / beside.map(weight).sum::<f64>()
        })
    }
}
