//! The native half of the Python package `wag`.
//!
//! Functions take and give numpy arrays, paths and the JSON of the project's own types; what is
//! pleasant to work with is made of them in Python (`python/wag`), where it is documented, too.
//! No algorithm is at home here: ropes are simulated by `rope-sim`, identified and thrown by
//! `planner`, tracked by `camera-ingest`. Whatever takes time runs without the interpreter's
//! lock, and what its owner may break off looks for Ctrl-C.

mod error;
mod film;
mod motion;
mod rig;
mod rope;
mod runs;
mod simulate;
mod stepwise;
mod threads;
mod throw;

/// Ropes, films, throws and runs; see the package `wag`, which is made of it.
#[pyo3::pymodule]
mod _wag {
    #[pymodule_export]
    use crate::error::{FailedError, InputError};
    #[pymodule_export]
    use crate::film::{fitted_pixels, identify, identify_run, track};
    #[pymodule_export]
    use crate::motion::{Motion, ranges_rad, spline};
    #[pymodule_export]
    use crate::rig::Rig;
    #[pymodule_export]
    use crate::rope::{parameters, random_rope, random_target, read_rope, write_rope};
    #[pymodule_export]
    use crate::runs::{read_cycles, write_text};
    #[pymodule_export]
    use crate::simulate::simulate;
    #[pymodule_export]
    use crate::stepwise::HangingRopes;
    #[pymodule_export]
    use crate::throw::{drawn_ropes, plan};

    #[pymodule_export]
    const VERSION: &str = shared_types::VERSION;
    /// Pose from which wiggles and throws begin (rad).
    #[pymodule_export]
    const START_RAD: [f64; 7] = arm_model::joint::START_POSE.0;
}
