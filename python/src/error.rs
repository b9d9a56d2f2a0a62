//! What goes wrong, as Python's exceptions, in the words of the commands.

use planner::plan::PlanError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

pyo3::create_exception!(
    wag,
    InputError,
    PyValueError,
    "What was given cannot be worked with: the message names it, its limits and what to do."
);
pyo3::create_exception!(
    wag,
    FailedError,
    PyRuntimeError,
    "The work itself failed: the message says at what, and what to do."
);

/// The exception that a failure is, with the reasons behind it.
pub(crate) fn raised(is_input: bool, error: impl Into<anyhow::Error>) -> PyErr {
    let words = format!("{:#}", error.into());
    if is_input {
        InputError::new_err(words)
    } else {
        FailedError::new_err(words)
    }
}

/// Results of the libraries as those of Python.
pub(crate) trait OrRaise<T> {
    /// With what was given at fault.
    fn or_input(self) -> PyResult<T>;

    /// With the work itself at fault.
    fn or_failed(self) -> PyResult<T>;
}

impl<T, E: Into<anyhow::Error>> OrRaise<T> for Result<T, E> {
    fn or_input(self) -> PyResult<T> {
        self.map_err(|error| raised(true, error))
    }

    fn or_failed(self) -> PyResult<T> {
        self.map_err(|error| raised(false, error))
    }
}

/// Why a throw was not planned.
pub(crate) fn of_plan(error: PlanError) -> PyErr {
    raised(error.is_input(), error)
}

/// Runs long work without the interpreter's lock; its progress breaks it off at Ctrl-C, and
/// what a signal's handler raised is raised then.
///
/// # Errors
/// What the work raises, or the handler.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut(Progress) -> ControlFlow<()>) -> PyResult<T> + Send,
) -> PyResult<T> {
    let mut raised = None;
    let done = py.detach(|| {
        work(&mut |_| match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(signal) => {
                raised = Some(signal);
                ControlFlow::Break(())
            }
        })
    });
    raised.map_or(done, Err)
}
