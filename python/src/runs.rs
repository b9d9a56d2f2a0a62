//! What a recorded run holds.

use crate::error::OrRaise;
use arm_model::JOINTS;
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use run_log::{Column, Run, files};
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
    let of_cycles = dictionary(py, found.cycle_columns())?;
    Ok((of_cycles, dictionary(py, found.report_columns())?))
}

/// Columns as arrays, words as a list.
fn dictionary<'py, const N: usize>(
    py: Python<'py>,
    columns: [(&str, Column); N],
) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    for (name, column) in columns {
        match column {
            Column::Flags(flags) => arrays.set_item(name, flags.into_pyarray(py)),
            Column::U32(counts) => arrays.set_item(name, counts.into_pyarray(py)),
            Column::U64(counts) => arrays.set_item(name, counts.into_pyarray(py)),
            Column::F64(numbers) => arrays.set_item(name, numbers.into_pyarray(py)),
            Column::Joints(rows) => {
                let table = Array2::from_shape_fn((rows.len(), JOINTS), |(i, j)| rows[i][j]);
                arrays.set_item(name, table.into_pyarray(py))
            }
            Column::Texts(texts) => arrays.set_item(name, texts),
        }?;
    }
    Ok(arrays)
}
