//! The trained network as an ONNX file that says what it is, checked against the
//! network it was made from.

use crate::batches::Batch;
use crate::checkpoint::State;
use crate::error::{Result, TrainingError};
use crate::familiar::Familiar;
use crate::graph::GraphWriter;
use crate::onnx;
use crate::trainer::{Predicted, predict};
use burn::module::Module;
use burn::tensor::Device;
use planner::phi::{
    FORMAT, METADATA_KEY, OUTPUTS, PARITY, ParameterScale, PhiMetadata, ProbeOutputs,
    TrainingRecord, difference, graph_sha256, probe,
};
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// The bytes of the ONNX file.
pub(crate) fn to_onnx(state: &State, familiar: &Familiar) -> Result<Vec<u8>> {
    let progress = &state.progress;
    let config = &progress.config;
    let features = config.features();
    let graph =
        GraphWriter::default().network(&state.model, &progress.standard, &features, familiar)?;
    let metadata = PhiMetadata {
        format: FORMAT,
        features,
        wiggle: config.data.wiggle,
        parameters: ParameterScale::of_ranges(),
        out_of_distribution_limit: familiar.limit,
        probe: probe_outputs(state)?,
        training: TrainingRecord {
            seed: config.training.seed,
            ropes: config.data.ropes,
            data_sha256: progress.data_sha256.clone(),
            steps: progress.step,
            batch: config.training.batch,
            randomisation: config.randomisation,
        },
        graph_sha256: graph_sha256(&graph),
    };
    let metadata = serde_json::to_string(&metadata)
        .map_err(|error| TrainingError::Failed(format!("metadata: {error}")))?;
    Ok(onnx::file(&graph, [METADATA_KEY, &metadata]))
}

/// The network's answer to the test input.
fn probe_outputs(state: &State) -> Result<ProbeOutputs> {
    let config = &state.progress.config;
    let mut film = Batch::default();
    // Which rope it is told to be does not matter.
    let rope = RopeParams::from_array(RANGES.map(|range| range.min));
    film.push(probe(config.features()), &rope, &state.progress.standard);
    let found = predict(&state.model.valid(), config, &film, &Device::flex())?;
    let first = found.into_iter().next();
    let Predicted {
        mean, log_variance, ..
    } = first.ok_or_else(|| TrainingError::tensors("no answer to the test input"))?;
    Ok(ProbeOutputs { mean, log_variance })
}

/// Compares a file's outputs with the network's for the same films: the largest
/// difference, or the first that is above [`PARITY`].
pub(crate) fn compare(network: &[Predicted], file: &[Predicted]) -> Result<f32> {
    let mut worst = 0.0_f32;
    for (a, b) in network.iter().zip(file) {
        for (output, a, b) in [
            (OUTPUTS[0], &a.mean, &b.mean),
            (OUTPUTS[1], &a.log_variance, &b.log_variance),
            (OUTPUTS[2], &a.embedding, &b.embedding),
        ] {
            let difference = difference(a, b);
            if difference > PARITY {
                return Err(TrainingError::Failed(format!(
                    "the written network differs from the trained one by {difference:.1e} in `{output}`, at most {PARITY:.0e} is allowed"
                )));
            }
            worst = worst.max(difference);
        }
    }
    Ok(worst)
}
