//! What a recorded run holds.

use crate::error::OrRaise;
use arm_model::{JOINTS, JointVector};
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use run_log::{Run, files};
use shared_types::FaultCode;
use shared_types::ipc::{ControllerMode, CycleRecord, JointReport};
use std::path::PathBuf;

/// Writes a file, whole or not at all.
#[pyfunction]
pub(crate) fn write_text(path: PathBuf, text: &str) -> PyResult<()> {
    files::write_atomic(&path, text.as_bytes()).or_failed()
}

/// Control cycles and joint reports of a run as arrays, times in ns (CLOCK_MONOTONIC); see
/// `wag.Run`.
#[pyfunction]
pub(crate) fn read_cycles(
    py: Python<'_>,
    run: PathBuf,
) -> PyResult<(Bound<'_, PyDict>, Bound<'_, PyDict>)> {
    let read = || Run::open(&run)?.recording()?.cycles();
    let found = py.detach(read).or_input()?;
    let (cycles, reports) = (&found.cycles, found.reports());
    let of_cycles = PyDict::new(py);
    of_cycles.set_item("cycle", array(py, cycles, |c| c.cycle))?;
    of_cycles.set_item("deadline_ns", array(py, cycles, |c| c.deadline_ns))?;
    let mode = |c: &CycleRecord| format!("{:?}", ControllerMode::from_raw(c.mode));
    of_cycles.set_item("mode", cycles.iter().map(mode).collect::<Vec<_>>())?;
    let fault = |c: &CycleRecord| match FaultCode::from_raw(c.fault) {
        Some(fault) => format!("{fault:?}"),
        None => format!("unknown fault {}", c.fault),
    };
    of_cycles.set_item("fault", cycles.iter().map(fault).collect::<Vec<_>>())?;
    of_cycles.set_item("sent", array(py, cycles, |c| c.sent != 0))?;
    of_cycles.set_item("held_back", array(py, cycles, CycleRecord::held_back))?;
    of_cycles.set_item("wake_late_ns", array(py, cycles, |c| c.wake_late_ns))?;
    of_cycles.set_item("compute_ns", array(py, cycles, |c| c.compute_ns))?;
    of_cycles.set_item("send_ns", array(py, cycles, |c| c.send_ns))?;
    of_cycles.set_item("reply_ns", array(py, cycles, |c| c.reply_ns))?;
    of_cycles.set_item("missed", array(py, cycles, |c| c.missed))?;
    of_cycles.set_item("trajectory_s", array(py, cycles, |c| c.trajectory_s))?;
    of_cycles.set_item("q_commanded_rad", joints(py, cycles, |c| c.q_c))?;
    let of_reports = PyDict::new(py);
    of_reports.set_item("stamp_ns", array(py, &reports, |r| r.stamp_ns))?;
    of_reports.set_item("arrival_ns", array(py, &reports, |r| r.arrival_ns))?;
    of_reports.set_item("q_rad", joints(py, &reports, |r: &JointReport| r.q))?;
    of_reports.set_item("qd_rad_s", joints(py, &reports, |r: &JointReport| r.qd))?;
    of_reports.set_item(
        "q_target_rad",
        joints(py, &reports, |r: &JointReport| r.q_target),
    )?;
    Ok((of_cycles, of_reports))
}

fn array<'py, T, N: numpy::Element>(
    py: Python<'py>,
    rows: &[T],
    of: fn(&T) -> N,
) -> Bound<'py, numpy::PyArray1<N>> {
    rows.iter().map(of).collect::<Vec<N>>().into_pyarray(py)
}

fn joints<'py, T>(
    py: Python<'py>,
    rows: &[T],
    of: fn(&T) -> JointVector,
) -> Bound<'py, numpy::PyArray2<f64>> {
    let table = Array2::from_shape_fn((rows.len(), JOINTS), |(i, j)| of(&rows[i])[j]);
    table.into_pyarray(py)
}
