//! The trained network as an ONNX file that says what it is, checked against the
//! network it was made from.

pub use crate::familiar::Familiar;

use crate::TrainingError;
use crate::batches::Batch;
use crate::checkpoint::State;
use crate::graph::GraphWriter;
use crate::onnx::{Model, OperatorSet, StringEntry};
use crate::trainer::{Predicted, predict};
use burn::module::Module;
use burn::tensor::Device;
use planner::phi::{
    FORMAT, METADATA_KEY, OUTPUTS, PARITY, ParameterScale, PhiMetadata, ProbeOutputs,
    TrainingRecord, difference, graph_sha256, probe,
};
use prost::Message;
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// ONNX operator set: the first with GELU.
const OPSET: i64 = 20;
/// Version of the file format that goes with it.
const IR_VERSION: i64 = 9;

/// The bytes of the ONNX file.
///
/// # Errors
/// Weights that the tensor library does not hand out.
pub fn to_onnx(state: &State, familiar: &Familiar) -> Result<Vec<u8>, TrainingError> {
    let config = &state.progress.config;
    let features = config.features();
    let graph = GraphWriter::default().network(
        &state.model,
        &state.progress.standard,
        &features,
        familiar,
    )?;
    let metadata = PhiMetadata {
        format: FORMAT,
        features,
        wiggle: config.data.wiggle,
        parameters: RANGES
            .iter()
            .map(|range| ParameterScale {
                key: range.key.to_owned(),
                min: range.min,
                max: range.max,
            })
            .collect(),
        out_of_distribution_limit: familiar.limit,
        probe: probe_outputs(state)?,
        training: TrainingRecord {
            seed: config.training.seed,
            ropes: config.data.ropes,
            data_sha256: state.progress.data_sha256.clone(),
            steps: state.progress.step,
            batch: config.training.batch,
            randomisation: config.randomisation,
        },
        graph_sha256: graph_sha256(&graph.encode_to_vec()),
    };
    let value = serde_json::to_string(&metadata).map_err(|error| TrainingError::Tensors {
        reason: format!("metadata: {error}"),
    })?;
    Ok(Model {
        ir_version: IR_VERSION,
        producer_name: "phi-train".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        graph: Some(graph),
        opset_import: vec![OperatorSet {
            domain: String::new(),
            version: OPSET,
        }],
        metadata_props: vec![StringEntry {
            key: METADATA_KEY.to_owned(),
            value,
        }],
    }
    .encode_to_vec())
}

/// The network's answer to the test input.
fn probe_outputs(state: &State) -> Result<ProbeOutputs, TrainingError> {
    let config = &state.progress.config;
    let mut film = Batch::with_capacity(1);
    // Which rope it is told to be does not matter.
    let rope = RopeParams::from_array(RANGES.map(|range| range.min));
    film.push(probe(config.features()), &rope, &state.progress.standard);
    let found = predict(&state.model.valid(), config, &film, &Device::flex())?;
    let first = found.into_iter().next();
    first
        .map(|p| ProbeOutputs {
            mean: p.mean,
            log_variance: p.log_variance,
        })
        .ok_or_else(|| TrainingError::Tensors {
            reason: "no answer to the test input".to_owned(),
        })
}

/// Compares a file's outputs with the network's for standardised films.
///
/// # Errors
/// The first output that differs by more than [`PARITY`].
pub fn compare(network: &[Predicted], file: &[Predicted]) -> Result<f32, TrainingError> {
    let mut worst = 0.0_f32;
    for (a, b) in network.iter().zip(file) {
        let pairs: [(&'static str, &[f32], &[f32]); 3] = [
            (OUTPUTS[0], &a.mean, &b.mean),
            (OUTPUTS[1], &a.log_variance, &b.log_variance),
            (OUTPUTS[2], &a.embedding, &b.embedding),
        ];
        for (output, a, b) in pairs {
            let difference = difference(a, b);
            if difference > PARITY {
                return Err(TrainingError::NotTheSame {
                    output,
                    difference,
                    limit: PARITY,
                });
            }
            worst = worst.max(difference);
        }
    }
    Ok(worst)
}
