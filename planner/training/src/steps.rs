//! The four steps as commands.

use crate::{
    DataArguments, DatasetArguments, DeviceName, EvaluateArguments, ExportArguments, TrainArguments,
};
use burn::module::Module;
use burn::tensor::Device;
use indicatif::{ProgressBar, ProgressStyle};
use phi_training::TrainingError;
use phi_training::batches::{Batch, Studio};
use phi_training::checkpoint::{State, path_in};
use phi_training::config::TrainingConfig;
use phi_training::evaluation::{Judged, evaluate as judge};
use phi_training::export::{Familiar, to_onnx};
use phi_training::hypercube::Share;
use phi_training::plots::plot_predictions;
use phi_training::pool::{Pool, Recipe};
use phi_training::trainer::{Predicted, Trainer, predict};
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use std::path::Path;

/// Films of training ropes whose embeddings the out-of-distribution score is measured against.
const FAMILIAR_FILMS: usize = 2000;

pub(crate) fn dataset(arguments: &DatasetArguments) -> Result<(), TrainingError> {
    let config = TrainingConfig::load(&arguments.data.config)?;
    config.check()?;
    let recipe = Recipe::new(&config.data, Share::Training, arguments.data.threads);
    let last = arguments.shards.map_or(recipe.shards(), |n| {
        (arguments.first + n).min(recipe.shards())
    });
    make(
        &recipe,
        arguments.first..last,
        &arguments.data,
        "training ropes",
    )?;
    let held_out = Recipe::new(&config.data, Share::HeldOut, arguments.data.threads);
    make(
        &held_out,
        0..held_out.shards(),
        &arguments.data,
        "held-out ropes",
    )
}

fn make(
    recipe: &Recipe,
    shards: core::ops::Range<usize>,
    data: &DataArguments,
    what: &'static str,
) -> Result<(), TrainingError> {
    let bar = bar(
        shards.len(),
        "{msg} {bar:30} {pos}/{len} thousand, {eta} left",
    );
    bar.set_message(what);
    recipe.make(&data.data, shards, &mut |_| bar.inc(1))?;
    bar.finish();
    Ok(())
}

/// The ropes of a share, simulated now if they are not there yet.
fn ropes(
    config: &TrainingConfig,
    data: &DataArguments,
    share: Share,
) -> Result<Pool, TrainingError> {
    let recipe = Recipe::new(&config.data, share, data.threads);
    make(&recipe, 0..recipe.shards(), data, "ropes")?;
    let pool = recipe.load(&data.data)?;
    if pool.failed() > 0 {
        eprintln!(
            "{} of {} ropes blew up in the simulator",
            pool.failed(),
            pool.len()
        );
    }
    Ok(pool)
}

fn device(name: DeviceName) -> Device {
    match name {
        DeviceName::Cpu => Device::flex(),
        #[cfg(feature = "cuda")]
        DeviceName::Cuda => Device::cuda(0),
        #[cfg(feature = "wgpu")]
        DeviceName::Wgpu => Device::wgpu(burn::tensor::DeviceKind::DefaultDevice),
    }
}

pub(crate) fn train(arguments: &TrainArguments) -> Result<(), TrainingError> {
    let config = TrainingConfig::load(&arguments.data.config)?;
    let pool = ropes(&config, &arguments.data, Share::Training)?;
    let held_out = ropes(&config, &arguments.data, Share::HeldOut)?;
    let bar = bar(
        config.training.steps,
        "{bar:30} {pos}/{len} steps, {per_sec}, {eta} left, {msg}",
    );
    let mut first = None;
    let trainer = Trainer {
        config: &config,
        pool: &pool,
        held_out: &held_out,
        folder: &arguments.out,
        device: device(arguments.device),
        threads: arguments.data.threads,
    };
    trainer.run(&mut |done, _, loss, metric| {
        bar.set_position(done as u64);
        bar.set_message(format!("loss {loss:.4}"));
        if let Some((held_out, errors)) = metric.and_then(|m| m.held_out) {
            let errors: Vec<String> = errors.iter().map(|e| format!("{e:.3}")).collect();
            let trained = metric.map_or(f64::NAN, |m| m.loss);
            eprintln!(
                "step {done}: loss {trained:.5}, held out {held_out:.5}, errors {}",
                errors.join(" ")
            );
        }
        let began = *first.get_or_insert(done);
        arguments
            .pause_after
            .is_none_or(|steps| done + 1 < began + steps)
    })?;
    bar.finish();
    Ok(())
}

/// Predictions for films of the first ropes of a share.
fn look(
    state: &State,
    studio: &Studio<'_>,
    pool: &Pool,
    count: usize,
) -> Result<Vec<Predicted>, TrainingError> {
    let bar = bar(count, "films {bar:30} {pos}/{len}, {eta} left");
    let mut films = Batch::with_capacity(count);
    for i in 0..count {
        films.push(studio.held_out(i)?, pool.rope(i), &state.progress.standard);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let device = Device::flex();
    predict(
        &state.model.valid(),
        &state.progress.config,
        &films,
        &device,
    )
}

pub(crate) fn evaluate(arguments: &EvaluateArguments) -> Result<(), TrainingError> {
    let config = TrainingConfig::load(&arguments.data.config)?;
    let pool = ropes(&config, &arguments.data, Share::HeldOut)?;
    let count = arguments.ropes.unwrap_or(pool.len()).min(pool.len());
    let studio = Studio::new(&config, &pool)?;
    let judged = if let Some(model) = &arguments.model {
        from_file::judge(model, &studio, &pool, count)?
    } else {
        let state = State::load(&path_in(&arguments.run), &Device::flex().autodiff())?;
        let looked = look(&state, &studio, &pool, count)?;
        let in_units = |p: &Predicted| Judged {
            truth: *pool.rope(p.film),
            found: from_parts(&p.mean),
            std_dev: core::array::from_fn(|i| {
                let deviation = (f64::from(p.log_variance[i]) / 2.0).exp();
                deviation.clamp(1e-4, 1.0) * (RANGES[i].max - RANGES[i].min)
            }),
        };
        looked.iter().map(in_units).collect()
    };
    let evaluation = judge(&judged);
    if arguments.json {
        let text = serde_json::to_string(&evaluation).map_err(|error| TrainingError::BadFile {
            path: "standard output".into(),
            reason: error.to_string(),
        })?;
        println!("{text}");
    } else {
        println!("{}", evaluation.table());
    }
    let part = |i: usize, x: f64| (x - RANGES[i].min) / (RANGES[i].max - RANGES[i].min);
    let pairs: Vec<_> = judged
        .iter()
        .map(|j| {
            let truth = j.truth.to_array();
            let parts = |v: [f64; ROPE_PARAMETERS]| core::array::from_fn(|i| part(i, v[i]));
            (parts(truth), parts(j.found))
        })
        .collect();
    plot_predictions(&arguments.run.join("predictions.svg"), &pairs)
}

fn from_parts(parts: &[f32]) -> [f64; ROPE_PARAMETERS] {
    core::array::from_fn(|i| {
        let range = RANGES[i];
        range.min + f64::from(parts[i]) * (range.max - range.min)
    })
}

pub(crate) fn export(arguments: &ExportArguments) -> Result<(), TrainingError> {
    let state = State::load(&path_in(&arguments.run), &Device::flex().autodiff())?;
    let config = state.progress.config.clone();
    let training = ropes(&config, &arguments.data, Share::Training)?;
    let held_out = ropes(&config, &arguments.data, Share::HeldOut)?;
    let known = look(
        &state,
        &Studio::new(&config, &training)?,
        &training,
        training.len().min(FAMILIAR_FILMS),
    )?;
    let studio = Studio::new(&config, &held_out)?;
    let others = look(&state, &studio, &held_out, held_out.len())?;
    let familiar = Familiar::measure(&known, &others)?;
    let bytes = to_onnx(&state, &familiar)?;
    from_file::check(&bytes, &studio, &others)?;
    write(&arguments.out, &bytes)?;
    println!(
        "{}: {} bytes after {} steps, checked against the trained network on {} films",
        arguments.out.display(),
        bytes.len(),
        state.progress.step,
        others.len().min(from_file::CHECKED)
    );
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), TrainingError> {
    let failed = |source| TrainingError::File {
        path: path.to_owned(),
        source,
    };
    let beside = path.with_extension("part");
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(&beside, bytes).map_err(failed)?;
    std::fs::rename(&beside, path).map_err(failed)
}

fn bar(length: usize, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style)
}

/// Model files as the planner reads them.
mod from_file {
    use super::{Judged, Pool, Predicted, Studio, TrainingError};
    use phi_training::export::compare;
    use planner::phi::PhiNet;
    use std::path::Path;

    /// Films with which a written file is checked.
    pub(super) const CHECKED: usize = 20;

    pub(super) fn judge(
        model: &Path,
        studio: &Studio<'_>,
        pool: &Pool,
        count: usize,
    ) -> Result<Vec<Judged>, TrainingError> {
        let net = PhiNet::load(model)?;
        (0..count)
            .map(|i| {
                let found = net.predict(&studio.held_out(i)?).map_err(refused)?;
                Ok(Judged {
                    truth: *pool.rope(i),
                    found: found.parameters,
                    std_dev: found.std_dev,
                })
            })
            .collect()
    }

    pub(super) fn check(
        bytes: &[u8],
        studio: &Studio<'_>,
        network: &[Predicted],
    ) -> Result<(), TrainingError> {
        let net = PhiNet::from_bytes("just written", bytes)?;
        let file = (0..network.len().min(CHECKED))
            .map(|film| {
                let out = net.run(&studio.held_out(film)?).map_err(refused)?;
                Ok(Predicted {
                    film,
                    mean: out.mean,
                    log_variance: out.log_variance,
                    embedding: out.embedding,
                })
            })
            .collect::<Result<Vec<_>, TrainingError>>()?;
        compare(network, &file).map(drop)
    }

    fn refused(error: planner::phi::PredictError) -> TrainingError {
        TrainingError::Tensors {
            reason: error.to_string(),
        }
    }
}
