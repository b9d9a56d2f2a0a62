//! Opens ONNX graphs in the ONNX Runtime library that `ORT_DYLIB_PATH` names.
//!
//! What a graph means is its users' business.

use std::sync::OnceLock;

pub use ort;
use ort::environment::Environment;
use ort::session::builder::GraphOptimizationLevel;
use ort::session::{Session, SessionInputValue};
use ort::value::TensorRef;

/// Why a graph is not opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// There is no runtime.
    #[error("{0}")]
    NoRuntime(String),
    /// The runtime does not take the graph.
    #[error("{0}")]
    Refused(String),
}

/// The variable that names the library.
pub const LIBRARY: &str = "ORT_DYLIB_PATH";

/// The runtime of this process, or why there is none.
fn runtime() -> Result<Environment, OpenError> {
    static RUNTIME: OnceLock<Result<Environment, String>> = OnceLock::new();
    RUNTIME
        .get_or_init(|| {
            let path = std::env::var_os(LIBRARY).ok_or(
                "no ONNX Runtime: set ORT_DYLIB_PATH to its library (libonnxruntime.so, 1.24 or \
                 newer; the Python package `onnxruntime` has one in `onnxruntime/capi`)",
            )?;
            let named = |error: &dyn core::fmt::Display| {
                format!("{LIBRARY}={}: {error}", path.to_string_lossy())
            };
            let builder = ort::init_from(&path).map_err(|e| named(&e))?;
            builder.build().map_err(|e| named(&e))
        })
        .clone()
        .map_err(OpenError::NoRuntime)
}

/// Opens a graph from the bytes of its file.
///
/// # Errors
/// No runtime, or one that does not take these bytes.
pub fn open(bytes: &[u8]) -> Result<Session, OpenError> {
    let refused = |reason: String| OpenError::Refused(reason);
    let environment = runtime()?;
    Session::builder(&environment)
        .map_err(|e| refused(e.to_string()))?
        .with_optimization_level(GraphOptimizationLevel::Level3)
        .map_err(|e| refused(e.to_string()))?
        .commit_from_memory(bytes)
        .map_err(|e| refused(e.to_string()))
}

/// A tensor's name, shape and numbers.
pub type Input<'a> = (&'a str, &'a [usize], &'a [f32]);

/// The numbers of the outputs with these names.
pub fn outputs<const I: usize, const O: usize>(
    session: &mut Session,
    inputs: [Input<'_>; I],
    names: [&str; O],
) -> ort::Result<[Vec<f32>; O]> {
    let mut tensors = Vec::new();
    for (name, shape, numbers) in inputs {
        let tensor = TensorRef::from_array_view((shape.to_vec(), numbers))?;
        tensors.push((name, SessionInputValue::from(tensor)));
    }
    let found = session.run(tensors)?;
    let mut outputs = [const { Vec::new() }; O];
    for (output, name) in outputs.iter_mut().zip(names) {
        let value = found
            .get(name)
            .ok_or_else(|| ort::Error::new(format!("no output `{name}`")))?;
        *output = value.try_extract_tensor::<f32>()?.1.to_vec();
    }
    Ok(outputs)
}
