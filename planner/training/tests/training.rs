//! A tiny training from ropes to a model file.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    missing_docs,
    reason = "tests may fail loudly"
)]

use burn::module::Module;
use burn::tensor::Device;
use phi_training::batches::{Batch, Studio};
use phi_training::checkpoint::{State, path_in};
use phi_training::config::TrainingConfig;
use phi_training::export::{Familiar, to_onnx};
use phi_training::hypercube::Share;
use phi_training::pool::{Pool, Recipe};
use phi_training::trainer::{Predicted, Trainer, predict};
use std::path::Path;

fn configured() -> TrainingConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/planner/training.toml");
    TrainingConfig::load(&path).unwrap()
}

/// Everything as configured, but small.
fn tiny() -> TrainingConfig {
    let mut config = configured();
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
    state
        .model
        .clone()
        .into_record()
        .into_bytes()
        .unwrap()
        .to_vec()
}

/// Predictions for all held-out films.
fn predictions(state: &State, held_out: &Pool) -> Vec<Predicted> {
    let config = &state.progress.config;
    let studio = Studio::new(config, held_out).unwrap();
    let mut films = Batch::with_capacity(held_out.len());
    for i in 0..held_out.len() {
        let film = studio.held_out(i).unwrap();
        films.push(film, held_out.rope(i), &state.progress.standard);
    }
    predict(&state.model.valid(), config, &films, &Device::flex()).unwrap()
}

/// One test, because the tensor library's random numbers belong to the process.
#[test]
fn a_training_learns_resumes_bit_for_bit_and_is_written_as_it_is() {
    let config = tiny();
    let pools = [Share::Training, Share::HeldOut]
        .map(|share| Recipe::new(&config.data, share, 2).simulate(0).unwrap());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tiny-training");
    let _ = std::fs::remove_dir_all(&folder);
    let whole_folder = folder.join("whole");
    let mut losses = Vec::new();
    let whole = trainer(&config, &pools, &whole_folder, 1)
        .run(&mut |_, _, loss, _| {
            losses.push(loss);
            true
        })
        .unwrap();
    assert_eq!(losses.len(), 40);
    let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
    let (first, last) = (mean(&losses[..5]), mean(&losses[35..]));
    assert!(last < 0.9 * first, "{first} {last}");

    // Ended after 13 steps and gone on from the file, with other threads.
    let parts_folder = folder.join("parts");
    let paused = trainer(&config, &pools, &parts_folder, 2)
        .run(&mut |done, _, _, _| done < 13)
        .unwrap();
    assert_eq!(paused.progress.step, 13);
    drop(paused);
    let resumed = trainer(&config, &pools, &parts_folder, 3)
        .run(&mut |_, _, _, _| true)
        .unwrap();
    assert_eq!(resumed.progress, whole.progress);
    let same = predictions(&resumed, &pools[1]) == predictions(&whole, &pools[1]);
    assert!(same, "a resumed training differs from an uninterrupted one");
    let read = |folder: &Path| std::fs::read(folder.join("metrics.jsonl")).unwrap();
    assert_eq!(read(&whole_folder), read(&parts_folder));
    assert!(whole_folder.join("loss.svg").exists());
    let again = State::load(&path_in(&whole_folder), &Device::flex().autodiff()).unwrap();
    assert!(weights(&again) == weights(&whole));

    // Another configuration does not go on from this checkpoint.
    let mut other = config.clone();
    other.training.learning_rate = 2e-3;
    let refused = trainer(&other, &pools, &whole_folder, 1).run(&mut |_, _, _, _| true);
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("another configuration")
    );

    written_as_it_is(&whole, &pools[1]);
}

fn written_as_it_is(state: &State, held_out: &Pool) {
    use phi_training::export::compare;
    use planner::features::WIDTHS;
    use planner::phi::{INPUTS, ModelError, OUTPUTS, PhiNet};

    let network = predictions(state, held_out);
    let familiar = Familiar::measure(&network, &network).unwrap();
    let bytes = to_onnx(state, &familiar).unwrap();
    let net = PhiNet::from_bytes("tiny", &bytes).unwrap();
    assert_eq!(net.metadata().training.steps, 40);
    let studio = Studio::new(&state.progress.config, held_out).unwrap();
    let file: Vec<Predicted> = (0..held_out.len())
        .map(|film| {
            let mut features = studio.held_out(film).unwrap();
            let out = net.run(&features).unwrap();
            assert!(out.out_of_distribution.is_finite());
            // A prediction is the same numbers in units, inside the ranges.
            let found = net.predict(&features).unwrap();
            let length_m = 0.45 + 0.2 * f64::from(out.mean[1]);
            assert!((found.parameters[1] - length_m).abs() < 1e-9);
            // Nothing seen still gives something finite.
            features.mask(0..400);
            features.widths = [0.0; 4];
            assert!(
                net.run(&features)
                    .unwrap()
                    .mean
                    .iter()
                    .all(|x| x.is_finite())
            );
            Predicted {
                film,
                mean: out.mean,
                log_variance: out.log_variance,
                embedding: out.embedding,
            }
        })
        .collect();
    let worst = compare(&network, &file).unwrap();
    println!("largest difference {worst:.1e}");
    let mut session = onnx_session::open(&bytes).unwrap();
    let features = state.progress.config.features();
    let shape = [1, features.frames, features.channels()];
    let in_runtime: Vec<Predicted> = (0..held_out.len())
        .map(|film| {
            let seen = studio.held_out(film).unwrap();
            let [mean, log_variance, embedding, _] = onnx_session::outputs(
                &mut session,
                [
                    (INPUTS[0], &shape[..], &seen.motion[..]),
                    (INPUTS[1], &[1, WIDTHS][..], &seen.widths[..]),
                ],
                OUTPUTS,
            )
            .unwrap();
            Predicted {
                film,
                mean,
                log_variance,
                embedding,
            }
        })
        .collect();
    let worst = compare(&network, &in_runtime).unwrap();
    println!("largest difference in an ONNX runtime {worst:.1e}");
    let mut wrong = file;
    wrong[3].mean[2] += 2e-5;
    assert!(compare(&network, &wrong).is_err());

    // A bit of a weight, the end, or the whole file wrong.
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    let refuse = |bytes: &[u8]| PhiNet::from_bytes("tiny", bytes).unwrap_err();
    assert!(matches!(refuse(&damaged), ModelError::Damaged { .. }));
    assert!(matches!(
        refuse(&bytes[..middle]),
        ModelError::NotOnnx { .. }
    ));
    assert!(matches!(refuse(b"no model"), ModelError::NotOnnx { .. }));
    assert!(matches!(refuse(b""), ModelError::NotOnnx { .. }));
    let missing = PhiNet::load(Path::new("/no/such/model.onnx")).unwrap_err();
    assert!(missing.to_string().contains("/no/such/model.onnx"));
}

/// The model that comes with this version.
#[test]
fn the_shipped_network_reads_ropes_it_never_saw() {
    use planner::phi::PhiNet;
    use shared_types::rope::RANGES;

    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/models/phi-nn.toml");
    let mut config = TrainingConfig::load(&path).unwrap();
    let net = PhiNet::embedded().unwrap();
    let record = net.metadata().training.clone();
    assert_eq!(record.ropes, config.data.ropes);
    assert_eq!(record.steps, config.training.steps);
    assert_eq!(record.randomisation, config.randomisation);
    assert_eq!(net.metadata().features, config.features());
    // Other ropes and other noise than those it was trained and judged on.
    config.data.seed = 77;
    config.data.held_out = 48;
    let pool = Recipe::new(&config.data, Share::HeldOut, 2)
        .simulate(0)
        .unwrap();
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
    for (k, limit) in limits.into_iter().enumerate() {
        assert!(
            errors[k] < limit,
            "{}: {} above {limit}",
            RANGES[k].label,
            errors[k]
        );
    }
}

#[test]
fn the_shipped_configuration_is_the_papers() {
    let config = configured();
    config.check().unwrap();
    assert_eq!(
        config.randomisation,
        planner::synthetic::Randomisation::default()
    );
    let wiggle = planner::wiggle::WiggleConfig::default();
    let shipped = config.data.wiggle;
    assert!((shipped.amplitude_rad - wiggle.amplitude_rad).abs() < 1e-12);
    assert_eq!(
        shipped,
        planner::wiggle::WiggleConfig {
            amplitude_rad: shipped.amplitude_rad,
            ..wiggle
        }
    );
    let rate = |step| config.training.learning_rate_at(step);
    assert!(rate(0) < 1e-6 && (rate(1399) - 1e-3).abs() < 1e-12);
    assert!(rate(70_000) < 6e-4 && rate(139_999) < 1e-9);
}
