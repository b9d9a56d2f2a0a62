//! An opened ONNX graph whose inputs and outputs are those wanted.

use std::collections::BTreeMap;
use std::path::Path;

use onnx_session::OpenError;
use onnx_session::ort;
use ort::session::Session;
use ort::value::{Outlet, TensorElementType, TensorRef};
use sha2::{Digest, Sha256};
use shared_types::file_error::why;

use super::picture::Size;
use crate::track::ModelError;

/// How long an axis is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Axis {
    /// So long.
    Is(usize),
    /// Of a length that the graph fixes or leaves open; the same wherever the name is.
    Named(&'static str),
}

/// An input or output as it must be: single precision, of these axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub(super) name: &'static str,
    pub(super) axes: &'static [Axis],
}

/// Lengths that a graph fixes, by name of the axis.
type Fixed = BTreeMap<&'static str, usize>;

/// An opened graph.
pub(super) struct Graph {
    path: String,
    sha256: String,
    fixed: Fixed,
    session: Session,
}

impl core::fmt::Debug for Graph {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Graph")
            .field("path", &self.path)
            .field("sha256", &self.sha256)
            .finish_non_exhaustive()
    }
}

/// Name and values of an input, and how many there are along each axis.
pub(super) type Input<'a> = (&'static str, Vec<usize>, &'a [f32]);

impl Graph {
    /// Opens a file and compares its inputs and outputs with those wanted.
    pub(super) fn load(
        path: &Path,
        inputs: &[Wanted],
        outputs: &[Wanted],
    ) -> Result<Self, ModelError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path)
            .map_err(|reason| ModelError::Unfit(format!("model {name}: {}", why(&reason))))?;
        let session = onnx_session::open(&bytes).map_err(|error| match error {
            OpenError::NoRuntime(reason) => ModelError::Runtime {
                path: name.clone(),
                reason,
            },
            OpenError::Refused(reason) => ModelError::Unfit(format!(
                "model {name}: the network runtime does not take it: {reason}; is it an ONNX file?"
            )),
        })?;
        let mut fixed = Fixed::new();
        compare(&name, "input", session.inputs(), inputs, &mut fixed)?;
        compare(&name, "output", session.outputs(), outputs, &mut fixed)?;
        let sha256 = Sha256::digest(&bytes)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Ok(Self {
            path: name,
            sha256,
            fixed,
            session,
        })
    }

    /// The length of an axis, if the graph fixes it.
    pub(super) fn fixed(&self, axis: &str) -> Option<usize> {
        self.fixed.get(axis).copied()
    }

    /// Size of the pictures it looks at, for frames of a size.
    pub(super) fn size(&self, frame: Size) -> Size {
        let of = |axis, k: usize| self.fixed(axis).unwrap_or(frame[k]);
        [of("W", 0), of("H", 1)]
    }

    /// Hash of the file.
    pub(super) fn sha256(&self) -> &str {
        &self.sha256
    }

    /// That an input or output is not as it must be.
    pub(super) fn unfit(&self, kind: &str, name: &str, found: &str, wanted: &str) -> ModelError {
        unfit(&self.path, kind, name, found, wanted)
    }

    /// Runs the graph; the values of each output, which must have the given shape.
    pub(super) fn run<const OUTPUTS: usize>(
        &mut self,
        inputs: &[Input<'_>],
        outputs: [(&'static str, Vec<usize>); OUTPUTS],
    ) -> Result<[Vec<f32>; OUTPUTS], ModelError> {
        let path = self.path.clone();
        let failed = |e: ort::Error| ModelError::Runtime {
            path: path.clone(),
            reason: e.to_string(),
        };
        let mut given: Vec<(&str, ort::session::SessionInputValue<'_>)> = Vec::new();
        for (name, shape, values) in inputs {
            let tensor = TensorRef::from_array_view((shape.clone(), *values)).map_err(failed)?;
            given.push((name, tensor.into()));
        }
        let found = self.session.run(given).map_err(failed)?;
        let mut values = [const { Vec::new() }; OUTPUTS];
        for ((name, wanted), values) in outputs.into_iter().zip(&mut values) {
            let value = found.get(name).ok_or_else(|| ModelError::Runtime {
                path: path.clone(),
                reason: format!("it gave no `{name}`"),
            })?;
            let (shape, numbers) = value.try_extract_tensor::<f32>().map_err(failed)?;
            let same = shape.len() == wanted.len()
                && shape
                    .iter()
                    .zip(&wanted)
                    .all(|(a, b)| usize::try_from(*a) == Ok(*b));
            if !same {
                let [found, wanted] = [format!("float32 {shape:?}"), format!("float32 {wanted:?}")];
                return Err(unfit(&path, "output", name, &found, &wanted));
            }
            if numbers.iter().any(|x| !x.is_finite()) {
                return Err(ModelError::Unfit(format!(
                    "model {path}: its answer `{name}` has numbers that are not finite"
                )));
            }
            *values = numbers.to_vec();
        }
        Ok(values)
    }
}

/// That an input or output of a file is not as it must be.
fn unfit(path: &str, kind: &str, name: &str, found: &str, wanted: &str) -> ModelError {
    ModelError::Unfit(format!(
        "model {path}: {kind} `{name}` is {found}, it must be {wanted}"
    ))
}

/// Compares names, types and shapes; takes note of the lengths that are fixed.
fn compare(
    path: &str,
    kind: &str,
    found: &[Outlet],
    wanted: &[Wanted],
    fixed: &mut Fixed,
) -> Result<(), ModelError> {
    let quoted = |names: Vec<&str>| {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        names.join(", ")
    };
    let known = |outlet: &Outlet| wanted.iter().any(|w| w.name == outlet.name());
    if found.len() != wanted.len() || !found.iter().all(known) {
        let found = quoted(found.iter().map(Outlet::name).collect());
        let wanted = quoted(wanted.iter().map(|w| w.name).collect());
        return Err(ModelError::Unfit(format!(
            "model {path}: its {kind}s are {found}, they must be {wanted}"
        )));
    }
    for wanted in wanted {
        let outlets = found.iter().filter(|outlet| outlet.name() == wanted.name);
        for outlet in outlets {
            if !fits(outlet, wanted, fixed) {
                let (found, form) = (form(outlet), wanted.form(fixed));
                return Err(unfit(path, kind, wanted.name, &found, &form));
            }
        }
    }
    Ok(())
}

fn fits(outlet: &Outlet, wanted: &Wanted, fixed: &mut Fixed) -> bool {
    let dtype = outlet.dtype();
    let Some(shape) = dtype.tensor_shape() else {
        return false;
    };
    if dtype.tensor_type() != Some(TensorElementType::Float32) || shape.len() != wanted.axes.len() {
        return false;
    }
    shape.iter().zip(wanted.axes).all(|(length, axis)| {
        // Open lengths are -1.
        let Ok(length) = usize::try_from(*length) else {
            return true;
        };
        match axis {
            Axis::Is(wanted) => length == *wanted,
            Axis::Named(name) => length > 0 && *fixed.entry(name).or_insert(length) == length,
        }
    })
}

/// Type and shape of an input or output in words.
fn form(outlet: &Outlet) -> String {
    let dtype = outlet.dtype();
    let (Some(ty), Some(shape)) = (dtype.tensor_type(), dtype.tensor_shape()) else {
        return "no tensor".to_owned();
    };
    let lengths: Vec<String> = shape
        .iter()
        .map(|length| match length {
            0.. => length.to_string(),
            _ => "?".to_owned(),
        })
        .collect();
    format!(
        "{} [{}]",
        format!("{ty:?}").to_lowercase(),
        lengths.join(", ")
    )
}

impl Wanted {
    /// Type and shape in words, with the lengths that are fixed elsewhere.
    fn form(&self, fixed: &Fixed) -> String {
        let lengths: Vec<String> = self
            .axes
            .iter()
            .map(|axis| match axis {
                Axis::Is(length) => length.to_string(),
                Axis::Named(name) => fixed
                    .get(name)
                    .map_or_else(|| (*name).to_owned(), |length| format!("{name} = {length}")),
            })
            .collect();
        format!("float32 [{}]", lengths.join(", "))
    }
}
