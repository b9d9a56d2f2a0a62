//! Residuals of a point of the fit and their slopes: simulator sensitivities for the
//! rope, one batch for all of them; the clock and the camera need no simulation.

use super::camera_pose::{CORRECTIONS, View};
use super::coordinates::{
    CAMERA, CLOCK, Coordinates, FREE, LINKS, PLAIN, Point, SIMULATED, SIMULATED_PLAIN, SWAY,
    Square, link_range, simulated_rope, sway_of,
};
use super::error::IdentifyError;
use super::film::{Detection, Fidelity, Film, Grid, Instant, is_finite, sample_s};
use super::noise::{Noise, RESIDUAL, Row, Rows};
use crate::workers::map_in_order;
use nalgebra::SMatrix;
use rope_sim::sensitivity::{Family, Perturbation, Sensitivity, sensitivities};
use rope_sim::{Candidate, NodeTrack, Rollout, Sway};
use shared_types::RopeParams;

/// Steps of the one-sided differences in double precision: length (m), three
/// logarithms, lead radius (m), inertia radius (1); two curvatures and friction (1/m), the
/// logarithms of its slip and of the clamp, two angles (rad) and their rates (rad/s). Friction is not smooth:
/// its steps are longer than rounding asks for.
const FINE_STEPS: [f64; SIMULATED.len()] = [
    2e-5, 5e-4, 5e-4, 5e-4, 1e-4, 5e-3, 1e-3, 1e-3, 4e-3, 2e-2, 2e-3, 1e-4, 1e-4, 5e-4, 5e-4,
];
/// In single precision, in which only plain fits are made.
const COARSE_STEPS: [f64; SIMULATED_PLAIN] = [2e-3, 4e-2, 4e-2, 4e-2, 2e-3, 0.0];
/// Step of the camera's corrections (m, rad) and of the clock (s).
const CAMERA_STEP: f64 = 1e-4;
const CLOCK_STEP_S: f64 = 5e-4;
/// Link counts between which the slope over the count is taken lie this far away.
const LINKS_STEP: u32 = 3;
/// Frames of one part of a sum; parts do not depend on the number of threads.
const FRAMES_OF_PART: usize = 40;
/// Whitened residuals beyond this count linearly (Huber).
const HUBER: f64 = 3.0;
/// Places this far apart along the rope give its direction in the picture.
const TANGENT_SPAN: f64 = 0.02;

/// The normal equations of a point.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) information: Square,
    pub(super) gradient: Point,
    /// Huber's cost of the whitened residuals: half of their squares where small.
    pub(super) cost: f64,
    /// The gradient by part of the film, for its spread.
    pub(super) parts: Vec<Point>,
}

/// A point with its residuals and slopes.
#[derive(Debug, Clone)]
pub(super) struct Linearised {
    pub(super) rows: Rows,
    /// How many of the coordinates move, the first ones.
    fitted: usize,
    /// Root mean square distance between seen and simulated keypoints (px).
    pub(super) distance_px: f64,
}

/// Rollouts beside a base along one coordinate.
struct Pair<'a> {
    coordinate: usize,
    to: &'a Rollout,
    /// `None` is the base itself.
    from: Option<&'a Rollout>,
    span: f64,
}

/// Residuals and slopes over the first `fitted` coordinates at each point, for ropes of
/// `links` links; `None` where the rope cannot be simulated or is not in view. Also how
/// many ropes were simulated.
///
/// `near` are the rows of a point nearby, one per point or none at all: the slopes over
/// the link count, which hardly change and fill no lanes, are taken over from there.
pub(super) fn linearise(
    film: &Film<'_>,
    points: &[Point],
    near: &[&Rows],
    links: u32,
    fitted: usize,
    fidelity: Fidelity,
) -> Result<(Vec<Option<Linearised>>, usize), IdentifyError> {
    type Neighbours<'a> = Vec<Perturbation<'a>>;
    let fine = fidelity == Fidelity::Fine;
    let family = |x: &Point| {
        let neighbours = perturbations(x, links, fitted, fine);
        (simulated_rope(x, links), sway_of(x), neighbours)
    };
    let mut ropes: Vec<(RopeParams, Sway, Neighbours<'_>)> = points.iter().map(family).collect();
    let counts = neighbour_counts(links);
    if fine && near.is_empty() {
        let of = |x| counts.map(|n| (simulated_rope(x, n), sway_of(x), Vec::new()));
        ropes.extend(points.iter().flat_map(of));
    }
    let families = ropes.iter().map(|(rope, sway, perturbations)| Family {
        base: Candidate::new(rope, film.observation.motion).with_sway(*sway),
        perturbations,
    });
    let families: Vec<Family<'_>> = families.collect();
    let all = sensitivities(&families, &film.sim_options(fidelity))?;
    let simulations = all.iter().map(|s| 1 + s.neighbours.len()).sum();
    let (bases, others) = all.split_at(points.len());
    let out = points.iter().zip(bases).enumerate().map(|(i, (x, at))| {
        let mut pairs = pairs(at);
        if let Some([to, from]) = others.get(2 * i..2 * i + 2)
            && is_finite(&to.base)
            && is_finite(&from.base)
        {
            pairs.push(Pair {
                coordinate: LINKS,
                to: &to.base,
                from: Some(&from.base),
                span: f64::from(counts[0]) - f64::from(counts[1]),
            });
        }
        is_finite(&at.base)
            .then(|| {
                let near = near.get(i).copied();
                compare(film, x, links, &at.base, &pairs, near, (fitted, fidelity))
            })
            .flatten()
    });
    Ok((out.collect(), simulations))
}

/// A larger and a smaller link count beside one, within the ranges.
pub(super) fn neighbour_counts(links: u32) -> [u32; 2] {
    let (low, high) = link_range();
    [
        (links + LINKS_STEP).min(high),
        links.saturating_sub(LINKS_STEP).max(low),
    ]
}

fn perturbations(x: &Point, links: u32, fitted: usize, fine: bool) -> Vec<Perturbation<'static>> {
    let steps: &[f64] = if fine { &FINE_STEPS } else { &COARSE_STEPS };
    SIMULATED
        .into_iter()
        .zip(steps)
        .filter(|(i, step)| *i < fitted && **step > 0.0)
        .map(|(i, step)| {
            let (mut moved, distance) = (*x, *step);
            moved[i] += step;
            if i >= SWAY {
                let sway = sway_of(&moved);
                return Perturbation::Sway { sway, distance };
            }
            let rope = simulated_rope(&moved, links);
            Perturbation::Rope { rope, distance }
        })
        .collect()
}

/// Neighbours are in the order of [`SIMULATED`].
fn pairs(at: &Sensitivity) -> Vec<Pair<'_>> {
    let neighbours = at.neighbours.iter().zip(SIMULATED);
    neighbours
        .filter(|(n, _)| n.valid)
        .map(|(n, coordinate)| Pair {
            coordinate,
            to: &n.rollout,
            from: None,
            span: n.distance,
        })
        .collect()
}

/// The camera's corrections of a point.
pub(super) fn corrections(x: &Point) -> [f64; CORRECTIONS] {
    core::array::from_fn(|i| x[CAMERA + i])
}

/// What one comparison needs.
struct Comparison<'a> {
    nodes: &'a NodeTrack,
    pairs: &'a [Pair<'a>],
    view: View<'a>,
    beside: [View<'a>; CORRECTIONS],
    clock_s: f64,
    period_s: f64,
    /// Links of the point beyond those of the simulated rope, as a real number.
    more_links: f64,
}

fn compare(
    film: &Film<'_>,
    x: &Point,
    links: u32,
    base: &Rollout,
    pairs: &[Pair<'_>],
    near: Option<&Rows>,
    (fitted, fidelity): (usize, Fidelity),
) -> Option<Linearised> {
    let c = corrections(x);
    let comparison = Comparison {
        nodes: &base.nodes,
        pairs,
        view: film.viewer.view(&c),
        beside: film.viewer.perturbed(&c, CAMERA_STEP),
        clock_s: x[CLOCK],
        period_s: sample_s(fidelity),
        more_links: x[LINKS] - f64::from(links),
    };
    let cells = &film.grid(fidelity).cells;
    let rows: Vec<Option<Option<[Row; 2]>>> = map_in_order(cells, film.options.threads, |cell| {
        // The outer `None`: seen by the camera, but not by the simulated one.
        match cell {
            Some(detection) => comparison.rows(detection).map(Some),
            None => Some(None),
        }
    });
    let mut rows: Rows = rows.into_iter().collect::<Option<_>>()?;
    for (row, near) in rows.iter_mut().zip(near.into_iter().flatten()) {
        if let (Some(row), Some(near)) = (row, near) {
            for (row, near) in row.iter_mut().zip(near) {
                row[LINKS] = near[LINKS];
            }
        }
    }
    for axis in rows.iter_mut().flatten().flatten() {
        axis[RESIDUAL] += comparison.more_links * axis[LINKS];
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for (row, cell) in rows.iter().zip(cells) {
        if let (Some(row), Some(cell)) = (row, cell) {
            sum += cell.weight * (row[0][RESIDUAL].powi(2) + row[1][RESIDUAL].powi(2));
            count += 1.0;
        }
    }
    let distance_px = (sum / f64::max(count, 1.0)).sqrt();
    distance_px.is_finite().then_some(Linearised {
        rows,
        fitted,
        distance_px,
    })
}

impl Comparison<'_> {
    /// Simulated minus seen pixels and their slopes, along and across the rope.
    fn rows(&self, detection: &Detection) -> Option<[Row; 2]> {
        let samples = self.nodes.frames();
        let time_s = detection.time_s - self.clock_s;
        let now = Instant::new(time_s, self.period_s, samples);
        let p = now.position(self.nodes, detection.along);
        let seen = self.view.project(&p)?;
        let mut out = [[0.0; FREE + 1]; 2];
        for pair in self.pairs {
            let to = now.position(&pair.to.nodes, detection.along);
            let from = pair
                .from
                .map_or(p, |r| now.position(&r.nodes, detection.along));
            let moved = self.view.project(&(p + (to - from)))?;
            for axis in 0..2 {
                out[axis][pair.coordinate] = (moved[axis] - seen[axis]) / pair.span;
            }
        }
        let later = Instant::new(time_s + CLOCK_STEP_S, self.period_s, samples);
        let before = Instant::new(time_s - CLOCK_STEP_S, self.period_s, samples);
        let at = |now: &Instant| {
            self.view
                .project(&now.position(self.nodes, detection.along))
        };
        let (b, a) = (at(&later)?, at(&before)?);
        for axis in 0..2 {
            // A camera clock that is ahead sees an earlier rope.
            out[axis][CLOCK] = (a[axis] - b[axis]) / (2.0 * CLOCK_STEP_S);
            out[axis][RESIDUAL] = seen[axis] - detection.pixel[axis];
        }
        for (i, view) in self.beside.iter().enumerate() {
            let moved = view.project(&p)?;
            for axis in 0..2 {
                out[axis][CAMERA + i] = (moved[axis] - seen[axis]) / CAMERA_STEP;
            }
        }
        let [c, s] = self.tangent(&now, detection.along)?;
        let mut turned = [[0.0; FREE + 1]; 2];
        for i in 0..=FREE {
            let (u, v) = (out[0][i], out[1][i]);
            turned[0][i] = c * u + s * v;
            turned[1][i] = c * v - s * u;
        }
        Some(turned)
    }

    /// Unit vector along the rope in the picture.
    fn tangent(&self, now: &Instant, along: f64) -> Option<[f64; 2]> {
        let place = |along: f64| self.view.project(&now.position(self.nodes, along));
        let a = place((along - TANGENT_SPAN).max(0.0))?;
        let b = place((along + TANGENT_SPAN).min(1.0))?;
        let (du, dv) = (b[0] - a[0], b[1] - a[1]);
        let length = du.hypot(dv);
        Some(if length > 1e-9 {
            [du / length, dv / length]
        } else {
            [0.0, 1.0]
        })
    }
}

impl Linearised {
    /// Whether the rope may have more than the nine parameters.
    pub(super) fn is_beyond(&self) -> bool {
        self.fitted > PLAIN
    }

    /// Normal equations under a noise, without the prior.
    pub(super) fn normal(&self, film: &Film<'_>, fidelity: Fidelity, noise: &Noise) -> Normal {
        let grid: &Grid = film.grid(fidelity);
        let mut rows = self.rows.clone();
        noise.whiten(grid, &mut rows, self.fitted);
        let parts: Vec<&[Option<[Row; 2]>]> =
            rows.chunks(FRAMES_OF_PART * grid.keypoints).collect();
        let sums = map_in_order(&parts, film.options.threads, |part| {
            accumulate(part, self.fitted)
        });
        let mut out = Normal {
            information: Square::zeros(),
            gradient: Point::zeros(),
            cost: 0.0,
            parts: Vec::with_capacity(sums.len()),
        };
        for (sum, cost) in sums {
            let gradient: Point = sum.fixed_view::<FREE, 1>(0, FREE).into_owned();
            out.information += sum.fixed_view::<FREE, FREE>(0, 0);
            out.gradient += gradient;
            out.parts.push(gradient);
            out.cost += cost;
        }
        out
    }
}

/// Huber's weight of a whitened detection.
pub(super) fn influence(row: &[Row; 2]) -> f64 {
    let distance = row[0][RESIDUAL].hypot(row[1][RESIDUAL]);
    (HUBER / distance.max(1e-12)).min(1.0)
}

/// Weighted sum of the outer products of rows in the columns of the first `fitted`
/// coordinates and the residual, and Huber's cost.
fn accumulate(
    rows: &[Option<[Row; 2]>],
    fitted: usize,
) -> (SMatrix<f64, { FREE + 1 }, { FREE + 1 }>, f64) {
    let mut sum = SMatrix::<f64, { FREE + 1 }, { FREE + 1 }>::zeros();
    let mut cost = 0.0;
    for row in rows.iter().flatten() {
        let distance = row[0][RESIDUAL].hypot(row[1][RESIDUAL]);
        let weight = influence(row);
        // Huber's loss is d² (2 - w) w / 2 with w the influence.
        cost += 0.5 * distance * distance * weight * (2.0 - weight);
        for axis in row {
            for column in (0..fitted).chain([RESIDUAL]) {
                let scaled = weight * axis[column];
                for line in (0..column.min(fitted)).chain([column]) {
                    sum[(line, column)] += scaled * axis[line];
                }
            }
        }
    }
    sum.fill_lower_triangle_with_upper_triangle();
    (sum, cost)
}

impl Normal {
    /// Cost with the prior.
    pub(super) fn total_cost(&self, c: &Coordinates, x: &Point) -> f64 {
        self.cost + 0.5 * c.prior_distance2(x)
    }
}
