//! Where the rope lies across a predicted curve.
//!
//! Coverage is sampled along the curve's normals; a Viterbi search over all
//! nodes together finds the offsets that see most rope without jumping; a
//! centroid then gives sub-pixel places.

use super::curve::{add, normals, scale};
use super::evidence::Coverage;
use super::plane::{Point, RopePlane};
use crate::vectors::widest;

/// Distance of samples along a normal (px).
const STEP_PX: f64 = 0.5;
/// Price of a jump of one sample between neighbouring nodes.
const JUMP_PRICE: f64 = 0.02;
/// Largest jump between neighbouring nodes (samples).
const JUMP_MAX: usize = 4;
/// Price of an offset as large as the search range.
const OFFSET_PRICE: f64 = 0.15;

/// How to search.
#[derive(Debug, Clone)]
pub(super) struct Search<'a> {
    /// Search range to either side (px).
    pub(super) range_px: f64,
    /// Apparent radius of the rope (px).
    pub(super) rope_radius_px: f64,
    /// Coverage of a fully visible rope, relative to its whole width.
    pub(super) usual_coverage: f64,
    /// What looks like the rope is noticed this far to either side (px).
    pub(super) notice_px: f64,
    /// Apparent radius of the lead (px).
    pub(super) lead_radius_px: f64,
    /// Motion blur across the curve, per node (px).
    pub(super) blur_px: &'a [f64],
}

/// Result for one node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Across {
    /// Place measured on the normal.
    pub(super) point: Point,
    /// Coverage there relative to a fully visible rope, 0 to 1.
    pub(super) confidence: f64,
    /// Coverage of the best place on the same normal that is not the rope.
    pub(super) rival: f64,
}

/// Measures every node of `curve` along its normal. The first node (the clamp)
/// is known; the range opens with the distance from it.
pub(super) fn measure(
    curve: &[Point],
    plane: &RopePlane,
    coverage: &Coverage,
    search: &Search<'_>,
) -> Vec<Across> {
    let half = (search.range_px / STEP_PX).round() as usize;
    let lanes = 2 * half + 1;
    let step_m = STEP_PX / plane.px_per_m;
    let normal = normals(curve);
    let offset = |lane: f64| (lane - half as f64) * step_m;
    let spacing_px = super::curve::length(curve) / (curve.len() - 1) as f64 * plane.px_per_m;

    // Raw samples, and their sums over the rope's blurred width.
    let mut samples = vec![0.0; curve.len() * lanes];
    let mut seen = vec![0.0; curve.len() * lanes];
    for (node, (p, n)) in curve.iter().zip(&normal).enumerate() {
        let row = &mut samples[node * lanes..(node + 1) * lanes];
        for (lane, sample) in row.iter_mut().enumerate() {
            let at = add(*p, scale(*n, offset(lane as f64)));
            *sample = f64::from(coverage.at(plane.to_pixel(at)));
        }
        let reach = (search.rope_radius_px + search.blur_px[node] / 2.0) / STEP_PX;
        box_sums(row, reach, &mut seen[node * lanes..(node + 1) * lanes]);
        let full = 2.0 * search.rope_radius_px / STEP_PX * search.usual_coverage;
        for value in &mut seen[node * lanes..(node + 1) * lanes] {
            *value = (*value / full).min(1.0);
        }
    }
    let price = |node: usize, lane: usize| -> f64 {
        let away = (lane as f64 - half as f64) / half as f64;
        // Nothing can lie further off than the distance from the clamp allows.
        let room = (2.0 + 0.7 * node as f64 * spacing_px) / search.range_px;
        let outside = if away.abs() > room { 4.0 } else { 0.0 };
        1.0 - seen[node * lanes + lane] + OFFSET_PRICE * away * away + outside
    };
    let best = viterbi(curve.len(), lanes, price);
    let mut found: Vec<Across> = (0..curve.len())
        .map(|node| {
            let lane = best[node];
            let row = &samples[node * lanes..(node + 1) * lanes];
            let reach = (search.rope_radius_px + search.blur_px[node] / 2.0 + 1.0) / STEP_PX;
            let centre = row_centroid(row, row_centroid(row, lane as f64, reach), reach);
            Across {
                point: add(curve[node], scale(normal[node], offset(centre))),
                confidence: seen[node * lanes + lane],
                rival: 0.0,
            }
        })
        .collect();
    let rivals = Beside {
        places: found
            .iter()
            .map(|node| plane.to_pixel(node.point))
            .collect(),
        coverage,
        search,
    };
    for (node, across) in found.iter_mut().enumerate() {
        let row = &samples[node * lanes..(node + 1) * lanes];
        let ends = [0.0, (lanes - 1) as f64]
            .map(|lane| plane.to_pixel(add(curve[node], scale(normal[node], offset(lane)))));
        across.rival = rivals.best(node, row, ends);
    }
    found
}

/// What lies beside the rope found.
struct Beside<'a> {
    /// Pixels of the rope's nodes.
    places: Vec<[f64; 2]>,
    coverage: &'a Coverage,
    search: &'a Search<'a>,
}

impl Beside<'_> {
    /// Coverage of the best place across a node that is not the rope, relative to a fully
    /// visible rope. `row` are the samples between the pixels `ends`; beyond them a step
    /// is a pixel.
    fn best(&self, node: usize, row: &[f64], ends: [[f64; 2]; 2]) -> f64 {
        let search = self.search;
        let inner = search.range_px.round() as usize;
        let half = search.notice_px.round().max(search.range_px) as usize;
        let per_px = (1.0 / STEP_PX) as usize;
        let place = |lane: usize| -> [f64; 2] {
            let part = (lane as f64 - half as f64) / (2.0 * search.range_px) + 0.5;
            [0, 1].map(|k| ends[0][k] + part * (ends[1][k] - ends[0][k]))
        };
        let samples: Vec<f64> = (0..=2 * half)
            .map(|lane| {
                if lane.abs_diff(half) <= inner {
                    row[(lane + inner - half) * per_px]
                } else {
                    f64::from(self.coverage.at(place(lane)))
                }
            })
            .collect();
        let reach = search.rope_radius_px + search.blur_px[node] / 2.0;
        let mut seen = vec![0.0; samples.len()];
        box_sums(&samples, reach, &mut seen);
        let full = 2.0 * search.rope_radius_px * search.usual_coverage;
        let clear_px = 2.0 * reach + 3.0;
        let mut most: f64 = 0.0;
        for (lane, seen) in seen.iter().enumerate() {
            if *seen > most * full && self.is_beside(place(lane), clear_px) {
                most = seen / full;
            }
        }
        most.min(1.0)
    }

    /// Clear of every part of the rope and of its lead.
    fn is_beside(&self, place: [f64; 2], clear_px: f64) -> bool {
        let away = |p: &[f64; 2]| (p[0] - place[0]).powi(2) + (p[1] - place[1]).powi(2);
        let from_lead = clear_px + self.search.lead_radius_px;
        self.places.iter().all(|p| away(p) > clear_px * clear_px)
            && self
                .places
                .last()
                .is_none_or(|p| away(p) > from_lead * from_lead)
    }
}

/// Sums over `centre - reach ..= centre + reach`, ends counted in part.
fn box_sums(row: &[f64], reach: f64, out: &mut [f64]) {
    let whole = reach.floor() as usize;
    let rest = reach - reach.floor();
    for (centre, sum) in out.iter_mut().enumerate() {
        let from = centre.saturating_sub(whole);
        let to = (centre + whole + 1).min(row.len());
        *sum = row[from..to].iter().sum::<f64>();
        if let Some(before) = from.checked_sub(1)
            && centre > whole
        {
            *sum += rest * row[before];
        }
        *sum += rest * row.get(centre + whole + 1).copied().unwrap_or(0.0);
    }
}

fn row_centroid(row: &[f64], centre: f64, reach: f64) -> f64 {
    let (mut sum, mut moment) = (0.0, 0.0);
    let from = (centre - reach - 1.0).max(0.0) as usize;
    let to = (centre + reach + 2.0).max(0.0) as usize;
    for (lane, value) in row.iter().enumerate().take(to).skip(from) {
        let inside = reach + 0.5 - (lane as f64 - centre).abs();
        if inside > 0.0 {
            let w = value * inside.min(1.0);
            sum += w;
            moment += w * lane as f64;
        }
    }
    if sum > 1e-6 { moment / sum } else { centre }
}

/// Cheapest lane per node under a quadratic price on jumps.
fn viterbi(nodes: usize, lanes: usize, price: impl Fn(usize, usize) -> f64) -> Vec<usize> {
    let prices: Vec<f64> = (0..nodes * lanes)
        .map(|i| price(i / lanes, i % lanes))
        .collect();
    // No way comes from beyond the first or the last lane.
    let mut cost = vec![f64::INFINITY; lanes + 2 * JUMP_MAX];
    cost[JUMP_MAX..JUMP_MAX + lanes].copy_from_slice(&prices[..lanes]);
    let mut from = vec![0_usize; nodes * lanes];
    let mut least = vec![0.0; lanes];
    widest(
        #[inline(always)]
        || {
            let rows = prices
                .chunks_exact(lanes)
                .zip(from.chunks_exact_mut(lanes))
                .skip(1);
            for (price, jump) in rows {
                cheapest(&cost, &mut least, jump);
                for ((cost, least), price) in cost[JUMP_MAX..].iter_mut().zip(&least).zip(price) {
                    *cost = least + price;
                }
            }
        },
    );
    let cost = &cost[JUMP_MAX..];
    let mut lane = (0..lanes)
        .min_by(|&a, &b| cost[a].total_cmp(&cost[b]))
        .unwrap_or(lanes / 2);
    let mut best = vec![lane; nodes];
    for node in (1..nodes).rev() {
        lane = lane + from[node * lanes + lane] - JUMP_MAX;
        best[node - 1] = lane;
    }
    best
}

/// Least cost of coming to every lane, and from how many lanes on, less [`JUMP_MAX`]. Jump
/// by jump, so that many lanes are worked on at once.
#[inline(always)]
fn cheapest(cost: &[f64], least: &mut [f64], jump: &mut [usize]) {
    least.fill(f64::INFINITY);
    jump.fill(JUMP_MAX);
    for offset in 0..=2 * JUMP_MAX {
        let far = offset as f64 - JUMP_MAX as f64;
        let extra = JUMP_PRICE * far * far;
        let ways = least.iter_mut().zip(jump.iter_mut()).zip(&cost[offset..]);
        for ((least, jump), before) in ways {
            let total = before + extra;
            let better = total < *least;
            *least = if better { total } else { *least };
            *jump = if better { offset } else { *jump };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viterbi_prefers_the_connected_track() {
        // Lane 2 is good everywhere but at node 3, where lane 9 is a decoy.
        let price = |node: usize, lane: usize| {
            f64::from(u8::from(
                !(lane == 2 && node != 3 || lane == 9 && node == 3),
            ))
        };
        assert_eq!(viterbi(7, 11, price), [2; 7]);
    }

    #[test]
    fn box_sums_count_ends_in_part() {
        let mut out = [0.0; 5];
        box_sums(&[1.0, 1.0, 1.0, 1.0, 1.0], 1.5, &mut out);
        assert_eq!(out, [2.5, 3.5, 4.0, 3.5, 2.5]);
        assert!((row_centroid(&[0.0, 1.0, 1.0, 0.0, 0.0], 1.5, 1.5) - 1.5).abs() < 1e-12);
    }
}
