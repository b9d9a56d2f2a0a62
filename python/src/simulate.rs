//! Batches of simulated ropes.

use crate::error::OrRaise;
use crate::motion::Motion;
use crate::rope::ropes_of_table;
use crate::threads::THREADS_MAX;
use anyhow::{anyhow, ensure};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rope_sim::{
    Candidate, ClosestApproach, FrameTimes, NodeNumbers, Outcome, Precision, Rollout, SimOptions,
    Start, Watch, roll_out,
};
use shared_types::RopeParams;

/// Most numbers that one call may give back: 8 GB in double precision.
pub(crate) const NUMBERS_MAX: u128 = 1_000_000_000;

/// Refuses nodes that no memory holds.
fn check_size(ropes: &[RopeParams], frames: usize) -> anyhow::Result<()> {
    let nodes: u128 = ropes.iter().map(|rope| u128::from(rope.links) + 1).sum();
    let numbers = 3 * nodes * frames as u128;
    ensure!(
        numbers <= NUMBERS_MAX,
        "{frames} frames of these ropes are {numbers} numbers, at most {NUMBERS_MAX} are kept: lower `rate_hz`, or simulate fewer ropes at once"
    );
    Ok(())
}

/// What is simulated, and what is kept of it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Wanted {
    horizon_s: f64,
    step_s: f64,
    single_precision: bool,
    /// Rotation of a straight rope's first joint (rad); none for a rope that hangs still.
    straight_rad: Option<[f64; 3]>,
    /// Rate of the nodes that are kept (Hz).
    rate_hz: Option<f64>,
    segment_m: Option<[[f64; 3]; 2]>,
    height: bool,
    rest_window_s: Option<f64>,
    threads: usize,
}

impl Wanted {
    fn options(&self) -> anyhow::Result<SimOptions> {
        let precision = if self.single_precision {
            Precision::F32
        } else {
            Precision::F64
        };
        Ok(SimOptions {
            start: self
                .straight_rad
                .map_or(Start::Equilibrium, |joint0_rotvec| Start::Straight {
                    joint0_rotvec,
                }),
            frames: self.frames()?,
            watch: Watch {
                segment_m: self.segment_m,
                height: self.height,
                rest_window_s: self.rest_window_s,
                ..Watch::NOTHING
            },
            threads: self.threads.clamp(1, THREADS_MAX),
            ..SimOptions::new(self.step_s, precision, self.horizon_s)
        })
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative and bounded by the check"
    )]
    fn frames(&self) -> anyhow::Result<FrameTimes> {
        const FRAMES_MAX: f64 = 1e8;
        let Some(rate_hz) = self.rate_hz else {
            return Ok(FrameTimes::NONE);
        };
        let last = self.horizon_s * rate_hz + 1e-6;
        ensure!(
            rate_hz > 0.0 && (0.0..FRAMES_MAX).contains(&last),
            "`rate_hz` is {rate_hz}, but must be above 0 and give fewer than 1e8 frames"
        );
        Ok(FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count: last.floor() as usize + 1,
        })
    }
}

/// Simulates ropes, each with its own motion or all with the one; see `wag.simulate`.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    table: PyReadonlyArray2<'py, f64>,
    extras: Vec<Option<String>>,
    motions: Vec<Py<Motion>>,
    points_m: Option<PyReadonlyArray2<'py, f64>>,
    wanted: Wanted,
) -> PyResult<Bound<'py, PyDict>> {
    let ropes = ropes_of_table(&table, &extras)?;
    let points = points_m.map(|points| rows_of_3(&points)).transpose()?;
    let options = wanted.options().or_input()?;
    check_size(&ropes, options.frames.count).or_input()?;
    let motions: Vec<&Motion> = motions.iter().map(Py::get).collect();
    let candidates = candidates(&ropes, &motions, points.as_deref()).or_input()?;
    let asked = Watch {
        point_m: points.as_ref().map(|_| [0.0; 3]),
        ..options.watch
    };
    let rollouts = py.detach(|| roll_out(&candidates, &options)).or_input()?;
    drop(candidates);
    kept(py, &asked, rollouts)
}

/// Pairs ropes with motions and points; one of these is that of all ropes.
fn candidates<'a>(
    ropes: &'a [RopeParams],
    motions: &[&'a Motion],
    points_m: Option<&[[f64; 3]]>,
) -> anyhow::Result<Vec<Candidate<'a>>> {
    let count = ropes.len();
    let one_or_all = |what: &str, found: usize| {
        let fits = found == 1 || found == count;
        fits.then_some(())
            .ok_or_else(|| anyhow!("{count} ropes need one {what} or {count}, found {found}"))
    };
    one_or_all("motion", motions.len())?;
    if let Some(points_m) = points_m {
        one_or_all("point", points_m.len())?;
    }
    let of = |found: usize, index: usize| if found == 1 { 0 } else { index };
    let one = |(index, rope)| {
        let candidate = Candidate::new(rope, motions[of(motions.len(), index)].attach());
        match points_m {
            Some(points_m) => candidate.watching(points_m[of(points_m.len(), index)]),
            None => candidate,
        }
    };
    Ok(ropes.iter().enumerate().map(one).collect())
}

/// Rows of three numbers.
fn rows_of_3(table: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let table = table.as_array();
    let columns = table.ncols();
    if columns != 3 {
        let found = anyhow!("points need the shape (points, 3), found {:?}", table.dim());
        return Err(found).or_input();
    }
    let row = |row: numpy::ndarray::ArrayView1<'_, f64>| [row[0], row[1], row[2]];
    Ok(table.outer_iter().map(row).collect())
}

/// A closest approach that was watched.
type Measured = fn(&Rollout) -> Option<ClosestApproach>;

/// Every number of the rollouts that was asked for; nodes without a copy.
fn kept<'py>(
    py: Python<'py>,
    asked: &Watch,
    rollouts: Vec<Rollout>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let of = |what: fn(&Rollout) -> f64| rollouts.iter().map(what).collect::<Vec<_>>();
    out.set_item(
        "peak_tip_speed_m_s",
        of(|r| r.peak_tip_speed_m_s).into_pyarray(py),
    )?;
    let is = |outcome| {
        rollouts
            .iter()
            .map(|r| r.outcome == outcome)
            .collect::<Vec<_>>()
    };
    out.set_item("diverged", is(Outcome::Diverged).into_pyarray(py))?;
    out.set_item("rerun", is(Outcome::RerunAtQuarterStep).into_pyarray(py))?;
    let approaches: [(&str, bool, Measured); 2] = [
        ("point", asked.point_m.is_some(), |r| r.watched.to_point),
        ("segment", asked.segment_m.is_some(), |r| {
            r.watched.to_segment
        }),
    ];
    for (name, is_asked, approach) in approaches {
        if is_asked {
            out.set_item(name, approach_arrays(py, &rollouts, approach)?)?;
        }
    }
    if asked.height {
        let highest = of(|r| r.watched.highest_m.unwrap_or(f64::NAN));
        out.set_item("highest_m", highest.into_pyarray(py))?;
    }
    if asked.rest_window_s.is_some() {
        let spread = of(|r| r.watched.rest.map_or(f64::NAN, |r| r.tip_height_spread_m));
        let moved = of(|r| r.watched.rest.map_or(f64::NAN, |r| r.middle_movement_m));
        out.set_item("tip_height_spread_m", spread.into_pyarray(py))?;
        out.set_item("middle_movement_m", moved.into_pyarray(py))?;
    }
    let nodes = PyList::empty(py);
    for rollout in rollouts {
        let [frames, count, _] = rollout.nodes.shape();
        let shape = (frames, count, 3);
        let is_lost = rollout.outcome == Outcome::Diverged;
        match rollout.nodes.into_numbers() {
            NodeNumbers::F32(mut v) => {
                if is_lost {
                    v.fill(f32::NAN);
                }
                nodes.append(
                    Array3::from_shape_vec(shape, v)
                        .or_failed()?
                        .into_pyarray(py),
                )?;
            }
            NodeNumbers::F64(mut v) => {
                if is_lost {
                    v.fill(f64::NAN);
                }
                nodes.append(
                    Array3::from_shape_vec(shape, v)
                        .or_failed()?
                        .into_pyarray(py),
                )?;
            }
        }
    }
    out.set_item("nodes_m", nodes)?;
    Ok(out)
}

/// Closest approaches as arrays over the ropes; of one that diverged there is none.
fn approach_arrays<'py>(
    py: Python<'py>,
    rollouts: &[Rollout],
    approach: Measured,
) -> PyResult<Bound<'py, PyDict>> {
    let number = |what: fn(&ClosestApproach) -> f64| {
        let of = |r| approach(r).map_or(f64::NAN, |a| what(&a));
        rollouts
            .iter()
            .map(of)
            .collect::<Vec<f64>>()
            .into_pyarray(py)
    };
    let vector = |what: fn(&ClosestApproach) -> [f64; 3]| -> PyResult<Bound<'py, PyArray2<f64>>> {
        let of = |r| approach(r).map_or([f64::NAN; 3], |a| what(&a));
        let flat: Vec<f64> = rollouts.iter().flat_map(of).collect();
        let shape = (rollouts.len(), 3);
        let table = numpy::ndarray::Array2::from_shape_vec(shape, flat).or_failed()?;
        Ok(table.into_pyarray(py))
    };
    let out = PyDict::new(py);
    out.set_item("distance_m", number(|a| a.distance_m))?;
    out.set_item("time_s", number(|a| a.time_s))?;
    out.set_item("tip_m", vector(|a| a.tip_m)?)?;
    out.set_item("velocity_m_s", vector(|a| a.velocity_m_s)?)?;
    Ok(out)
}
