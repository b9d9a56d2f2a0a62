//! How cost grows with the links of a rope and with the candidates of a batch.

use super::Extent;
use super::workload::{LINKS, Workload, released, throw_options, timed};
use crate::report::Column;
use rope_sim::{Candidate, Outcome, Precision, Rollout, Scene, SimulateError};
use serde::Serialize;
use shared_types::RopeParams;

const LINK_COUNTS: [u32; 6] = [5, 10, 22, 50, 100, 200];
const CANDIDATE_COUNTS: [usize; 7] = [1, 4, 16, 64, 256, 1024, 4096];
/// Lane groups per link count.
const GROUPS: usize = 8;
const HORIZON_S: f64 = 0.25;

/// Cost at one link count, one thread.
#[derive(Debug, Serialize)]
pub struct LinkRow {
    links: u32,
    us_per_rollout: f64,
    ns_per_rope_step: f64,
    ns_per_link_step: f64,
    /// Rollouts repeated at a quarter of the step; their time is in the figures.
    repeated: usize,
}

pub const LINKS_TABLE: [Column<LinkRow>; 5] = [
    ("links", |row| row.links.to_string()),
    ("per rollout (µs)", |row| {
        format!("{:.1}", row.us_per_rollout)
    }),
    ("per rope-step (ns)", |row| {
        format!("{:.0}", row.ns_per_rope_step)
    }),
    ("per link-step (ns)", |row| {
        format!("{:.2}", row.ns_per_link_step)
    }),
    ("repeated", |row| row.repeated.to_string()),
];

/// Cost over links with the straight line through it.
#[derive(Debug, Serialize)]
pub struct LinkScaling {
    pub rows: Vec<LinkRow>,
    /// Slope of the line through ns per rope-step (ns per link-step).
    pub slope_ns_per_link_step: f64,
    /// Its value without links (ns per rope-step).
    pub intercept_ns: f64,
    /// Share of the variance it explains.
    pub r_squared: f64,
}

/// Cost of one batch size, one thread.
#[derive(Debug, Serialize)]
pub struct CandidateRow {
    candidates: usize,
    ms_per_batch: f64,
    us_per_rollout: f64,
    ns_per_rope_step: f64,
}

pub const CANDIDATES_TABLE: [Column<CandidateRow>; 4] = [
    ("candidates", |row| row.candidates.to_string()),
    ("per batch (ms)", |row| format!("{:.2}", row.ms_per_batch)),
    ("per rollout (µs)", |row| {
        format!("{:.1}", row.us_per_rollout)
    }),
    ("per rope-step (ns)", |row| {
        format!("{:.0}", row.ns_per_rope_step)
    }),
];

/// Ropes that hang from a standing frame and swing, cut into more and more links. A
/// finer cut of the same rope has stiffer joints, so that it bends alike.
pub fn over_links(workload: &Workload, extent: Extent) -> Result<LinkScaling, SimulateError> {
    let kernel = Precision::F32.fastest_kernel();
    let count = kernel.lanes() * extent.share(GROUPS);
    let options = released([0.2, 0.4, 0.1], throw_options(HORIZON_S, 1));
    let mut rows = Vec::new();
    for links in LINK_COUNTS {
        let ropes: Vec<RopeParams> = workload.ropes[..count]
            .iter()
            .map(|rope| cut_into(rope, links))
            .collect();
        let candidates: Vec<Candidate> = ropes
            .iter()
            .map(|rope| Candidate::new(rope, &workload.still))
            .collect();
        let timed = timed(extent.repeats, &Scene::EMPTY, kernel, &candidates, &options)?;
        let repeated = |r: &&Rollout| r.outcome != Outcome::Clean;
        rows.push(LinkRow {
            links,
            us_per_rollout: 1e6 * timed.spent.cpu_s / count as f64,
            ns_per_rope_step: timed.ns_per_rope_step,
            ns_per_link_step: timed.ns_per_rope_step / f64::from(links),
            repeated: timed.rollouts.iter().filter(repeated).count(),
        });
    }
    let points: Vec<[f64; 2]> = rows
        .iter()
        .map(|row| [f64::from(row.links), row.ns_per_rope_step])
        .collect();
    let [slope_ns_per_link_step, intercept_ns, r_squared] = line_through(&points);
    Ok(LinkScaling {
        rows,
        slope_ns_per_link_step,
        intercept_ns,
        r_squared,
    })
}

/// The same rope in other pieces: joint stiffness and damping times link length stay.
fn cut_into(rope: &RopeParams, links: u32) -> RopeParams {
    let finer = f64::from(links) / f64::from(LINKS);
    RopeParams {
        links,
        joint_stiffness_nm_per_rad: rope.joint_stiffness_nm_per_rad * finer,
        joint_damping_nms_per_rad: rope.joint_damping_nms_per_rad * finer,
        ..*rope
    }
}

/// Batches of throws, each candidate on an arm spline of its own.
pub fn over_candidates(
    workload: &Workload,
    extent: Extent,
) -> Result<Vec<CandidateRow>, SimulateError> {
    let kernel = Precision::F32.fastest_kernel();
    let options = throw_options(HORIZON_S, 1);
    CANDIDATE_COUNTS
        .into_iter()
        .filter(|count| *count * extent.divisor <= 4096)
        .map(|count| {
            let candidates = workload.throwing(count);
            let timed = timed(extent.repeats, &Scene::EMPTY, kernel, &candidates, &options)?;
            Ok(CandidateRow {
                candidates: count,
                ms_per_batch: 1e3 * timed.spent.cpu_s,
                us_per_rollout: 1e6 * timed.spent.cpu_s / count as f64,
                ns_per_rope_step: timed.ns_per_rope_step,
            })
        })
        .collect()
}

/// Least-squares line through points (x, y): slope, intercept, R².
fn line_through(points: &[[f64; 2]]) -> [f64; 3] {
    let n = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / n;
    let (x0, y0) = (mean(0), mean(1));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|p| f(p[0] - x0, p[1] - y0)).sum()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    [slope, y0 - slope * x0, xy * xy / (xx * yy)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_a_parabola_is_not_one() {
        let on_a_line = [[1.0, 5.0], [2.0, 7.0], [4.0, 11.0]];
        let [slope, intercept, r_squared] = line_through(&on_a_line);
        assert!((slope - 2.0).abs() < 1e-12 && (intercept - 3.0).abs() < 1e-12);
        assert!((r_squared - 1.0).abs() < 1e-12);
        let curved = [[0.0, 0.0], [1.0, 1.0], [2.0, 4.0], [3.0, 9.0]];
        assert!(line_through(&curved)[2] < 0.95);
    }

    #[test]
    fn a_finer_cut_keeps_the_rope() {
        let rope = RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 1.0]);
        let fine = cut_into(&rope, 44);
        assert!((fine.bending_stiffness_nm2() / rope.bending_stiffness_nm2() - 1.0).abs() < 1e-12);
    }
}
