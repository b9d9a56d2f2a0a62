//! A tiny training from ropes to a model file, and the network that is shipped.

#[path = "../../../hil-tests/support/missing.rs"]
mod missing;

use crate::batches::{Batch, Studio};
use crate::checkpoint::{State, path_in};
use crate::config::TrainingConfig;
use crate::export::{compare, to_onnx};
use crate::familiar::Familiar;
use crate::hypercube::Share;
use crate::pool::{Pool, Recipe};
use crate::steps::run;
use crate::trainer::{Predicted, Trainer, predict};
use burn::module::Module;
use burn::tensor::Device;
use planner::features::{FeatureDefinition, WIDTHS, WiggleFeatures};
use planner::phi::{INPUTS, OUTPUTS, PhiNet};
use planner::synthetic::Randomisation;
use planner::wiggle::WiggleConfig;
use shared_types::rope::RANGES;
use std::path::Path;

/// A configuration file of the tree.
fn shipped(file: &str) -> TrainingConfig {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    TrainingConfig::load(&configs.join(file)).unwrap()
}

/// Everything as configured, but small.
fn tiny() -> TrainingConfig {
    let mut config = shipped("planner/training.toml");
    config.data.ropes = 24;
    config.data.held_out = 6;
    config.data.keypoints = 5;
    config.network.channels = [4, 6, 8];
    config.network.pooled = 5;
    // Forty steps see nothing of films of which most is hidden or dropped.
    config.network.dropout = 0.05;
    config.training.masking.truncate(1);
    config.training.learning_rate = 5e-3;
    config.training.steps = 40;
    config.training.batch = 8;
    config.training.warmup_steps = 4;
    config.training.checkpoint_every = 1000;
    config.training.validate_every = 20;
    config.training.validation_ropes = 6;
    config
}

fn trainer<'a>(
    config: &'a TrainingConfig,
    pools: &'a [Pool; 2],
    folder: &'a Path,
    threads: usize,
) -> Trainer<'a> {
    Trainer {
        config,
        pool: &pools[0],
        held_out: &pools[1],
        folder,
        device: Device::flex(),
        threads,
    }
}

fn weights(state: &State) -> Vec<u8> {
    let record = state.model.clone().into_record();
    record.into_bytes().unwrap().to_vec()
}

/// Predictions for all held-out films.
fn predictions(state: &State, held_out: &Pool) -> Vec<Predicted> {
    let progress = &state.progress;
    let studio = Studio::new(&progress.config, held_out).unwrap();
    let films: Batch = studio
        .held_out_batch(held_out.len(), &progress.standard, || ())
        .unwrap();
    predict(
        &state.model.valid(),
        &progress.config,
        &films,
        &Device::flex(),
    )
    .unwrap()
}

/// One test, because the tensor library's random numbers belong to the process.
#[test]
fn a_training_learns_resumes_bit_for_bit_and_is_written_as_it_is() {
    let config = tiny();
    let pools = [Share::Training, Share::HeldOut]
        .map(|share| Recipe::new(&config.data, share, 2).simulate(0).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let whole_folder = folder.path().join("whole");
    let mut losses = Vec::new();
    let whole = trainer(&config, &pools, &whole_folder, 1)
        .run(&mut |_, loss, _| {
            losses.push(loss);
            true
        })
        .unwrap();
    assert_eq!(losses.len(), 40);
    let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
    let (first, last) = (mean(&losses[..5]), mean(&losses[35..]));
    assert!(last < 0.9 * first, "{first} {last}");

    // Ended after 13 steps and gone on from the file, with other threads.
    let parts_folder = folder.path().join("parts");
    let paused = trainer(&config, &pools, &parts_folder, 2)
        .run(&mut |done, _, _| done < 13)
        .unwrap();
    assert_eq!(paused.progress.step, 13);
    drop(paused);
    let resumed = trainer(&config, &pools, &parts_folder, 3)
        .run(&mut |_, _, _| true)
        .unwrap();
    assert_eq!(resumed.progress, whole.progress);
    let same = predictions(&resumed, &pools[1]) == predictions(&whole, &pools[1]);
    assert!(same, "a resumed training differs from an uninterrupted one");
    let read = |folder: &Path| std::fs::read(folder.join("metrics.jsonl")).unwrap();
    assert_eq!(read(&whole_folder), read(&parts_folder));
    assert!(whole_folder.join("loss.svg").exists());
    let again = State::load(&path_in(&whole_folder), &Device::flex().autodiff());
    assert!(weights(&again.unwrap()) == weights(&whole));
    let again = State::load_weights(&path_in(&whole_folder));
    assert!(weights(&again.unwrap()) == weights(&whole));

    // Another configuration does not go on from this checkpoint.
    let mut other = config.clone();
    other.training.learning_rate = 2e-3;
    let refused = trainer(&other, &pools, &whole_folder, 1).run(&mut |_, _, _| true);
    let refused = refused.err().unwrap().to_string();
    assert!(refused.contains("another configuration"), "{refused}");

    written_as_it_is(&whole, &pools[1]);
}

fn written_as_it_is(state: &State, held_out: &Pool) {
    let network = predictions(state, held_out);
    let familiar = Familiar::measure(&network, &network).unwrap();
    let bytes = to_onnx(state, &familiar).unwrap();
    let net = PhiNet::from_bytes("tiny", &bytes).unwrap();
    assert_eq!(net.metadata().training.steps, 40);
    let studio = Studio::new(&state.progress.config, held_out).unwrap();
    let films = (0..held_out.len()).map(|film| studio.held_out(film).unwrap());
    let films: Vec<_> = films.collect();
    let in_planner = |film: &WiggleFeatures| {
        let out = net.run(film).unwrap();
        assert!(out.out_of_distribution.is_finite());
        // A prediction is the same numbers in units, inside the ranges.
        let found = net.predict(film).unwrap();
        let length_m = 0.45 + 0.2 * f64::from(out.mean[1]);
        assert!((found.parameters[1] - length_m).abs() < 1e-9);
        // Nothing seen still gives something finite.
        let mut unseen = film.clone();
        unseen.mask(0..400);
        unseen.widths = [0.0; 4];
        assert!(net.run(&unseen).unwrap().mean.iter().all(|x| x.is_finite()));
        run(&net, film).unwrap()
    };
    let mut file: Vec<Predicted> = films.iter().map(in_planner).collect();
    let worst = compare(&network, &file).unwrap();
    println!("largest difference {worst:.1e}");
    if let Some(in_runtime) = in_runtime(&bytes, &state.progress.config.features(), &films) {
        let worst = compare(&network, &in_runtime).unwrap();
        println!("largest difference in an ONNX runtime {worst:.1e}");
    }
    file[3].mean[2] += 2e-5;
    assert!(compare(&network, &file).is_err());

    // A bit of a weight, the end, or the whole file wrong.
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    for (name, bytes, reason) in [
        ("a bit", &damaged[..], "damaged"),
        ("half", &bytes[..middle], "not an ONNX file"),
        ("text", b"no model", "not an ONNX file"),
        ("nothing", b"", "not an ONNX file"),
    ] {
        let refused = PhiNet::from_bytes("tiny", bytes).unwrap_err().to_string();
        assert!(refused.contains(reason), "{name}: {refused}");
    }
    let missing = PhiNet::load(Path::new("/no/such/model.onnx")).unwrap_err();
    assert!(missing.to_string().contains("/no/such/model.onnx"));
}

/// What an ONNX runtime makes of films; `None`, with a message, where none is named.
fn in_runtime(
    bytes: &[u8],
    features: &FeatureDefinition,
    films: &[WiggleFeatures],
) -> Option<Vec<Predicted>> {
    missing::named(onnx_session::LIBRARY, "ONNX Runtime library")?;
    let mut session = onnx_session::open(bytes).unwrap();
    let shape = [1, features.frames, features.channels()];
    let predicted = films.iter().map(|film| {
        let motion = (INPUTS[0], &shape[..], &film.motion[..]);
        let widths = (INPUTS[1], &[1, WIDTHS][..], &film.widths[..]);
        let found = onnx_session::outputs(&mut session, [motion, widths], OUTPUTS);
        let [mean, log_variance, embedding, _] = found.unwrap();
        Predicted {
            mean,
            log_variance,
            embedding,
        }
    });
    Some(predicted.collect())
}

/// The model that comes with this version.
#[test]
fn the_shipped_network_reads_ropes_it_never_saw() {
    let mut config = shipped("models/phi-nn.toml");
    let net = PhiNet::embedded().unwrap();
    let record = net.metadata().training.clone();
    assert_eq!(record.ropes, config.data.ropes);
    assert_eq!(record.steps, config.training.steps);
    assert_eq!(record.randomisation, config.randomisation);
    assert_eq!(net.metadata().features, config.features());
    // Other ropes and other noise than those it was trained and judged on.
    config.data.seed = 77;
    config.data.held_out = 48;
    let recipe = Recipe::new(&config.data, Share::HeldOut, 2);
    let pool = recipe.simulate(0).unwrap();
    let studio = Studio::new(&config, &pool).unwrap();
    let mut errors = [0.0; 9];
    for i in 0..pool.len() {
        let found = net.predict(&studio.held_out(i).unwrap()).unwrap();
        let truth = pool.rope(i).to_array();
        for (k, error) in errors.iter_mut().enumerate() {
            *error += (found.parameters[k] - truth[k]).abs() / pool.len() as f64;
        }
    }
    // A quarter above the figures of the model card for so few ropes.
    let limits = [
        2.0, 0.0075, 0.0055, 0.11, 0.0012, 0.0155, 0.0150, 0.0018, 0.23,
    ];
    for ((error, limit), range) in errors.into_iter().zip(limits).zip(RANGES) {
        assert!(error < limit, "{}: {error} above {limit}", range.label);
    }
}

#[test]
fn the_shipped_configuration_is_the_papers() {
    let config = shipped("planner/training.toml");
    config.check().unwrap();
    assert_eq!(config.randomisation, Randomisation::default());
    let wiggle = WiggleConfig::default();
    let shipped = config.data.wiggle;
    let amplitude_rad = shipped.amplitude_rad;
    assert!((amplitude_rad - wiggle.amplitude_rad).abs() < 1e-12);
    let expected = WiggleConfig {
        amplitude_rad,
        ..wiggle
    };
    assert_eq!(shipped, expected);
    let rate = |step| config.training.learning_rate_at(step);
    assert!(rate(0) < 1e-6 && (rate(1399) - 1e-3).abs() < 1e-12);
    assert!(rate(70_000) < 6e-4 && rate(139_999) < 1e-9);
}
