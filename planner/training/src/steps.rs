//! The four steps as commands.

use crate::batches::{Studio, fractions};
use crate::checkpoint::{State, path_in};
use crate::cli::{
    DataArguments, DatasetArguments, DeviceName, EvaluateArguments, ExportArguments, TrainArguments,
};
use crate::config::TrainingConfig;
use crate::error::{Result, TrainingError};
use crate::evaluation::{Judged, evaluate as judge};
use crate::export::{compare, to_onnx};
use crate::familiar::Familiar;
use crate::files::write_whole;
use crate::hypercube::Share;
use crate::plots::plot_predictions;
use crate::pool::{Pool, Recipe};
use crate::trainer::{Predicted, Trainer, predict};
use burn::module::Module;
use burn::tensor::Device;
use indicatif::{ProgressBar, ProgressStyle};
use planner::features::WiggleFeatures;
use planner::phi::{ParameterScale, PhiNet, PredictError, in_units};

/// Films of training ropes whose embeddings the out-of-distribution score is measured against.
const FAMILIAR_FILMS: usize = 2000;
/// Films with which a written file is checked.
const CHECKED: usize = 20;

pub(crate) fn dataset(arguments: &DatasetArguments) -> Result<()> {
    let data = &arguments.data;
    let config = TrainingConfig::load(&data.config)?;
    let [training, held_out] = [Share::Training, Share::HeldOut]
        .map(|share| Recipe::new(&config.data, share, data.threads));
    let (first, all) = (arguments.first, training.shards());
    let last = arguments.shards.map_or(all, |n| (first + n).min(all));
    make(&training, first..last, data, "training ropes")?;
    make(&held_out, 0..held_out.shards(), data, "held-out ropes")
}

fn make(
    recipe: &Recipe,
    shards: core::ops::Range<usize>,
    data: &DataArguments,
    what: &'static str,
) -> Result<()> {
    let template = "{msg} {bar:30} {pos}/{len} thousand, {eta} left";
    let bar = bar(shards.len(), template);
    bar.set_message(what);
    recipe.make(&data.data, shards, &mut |_| bar.inc(1))?;
    bar.finish();
    Ok(())
}

/// The ropes of a share, simulated now if they are not there yet.
fn ropes(config: &TrainingConfig, data: &DataArguments, share: Share) -> Result<Pool> {
    let recipe = Recipe::new(&config.data, share, data.threads);
    make(&recipe, 0..recipe.shards(), data, "ropes")?;
    let pool = recipe.load(&data.data)?;
    let (failed, all) = (pool.failed(), pool.len());
    if failed > 0 {
        eprintln!("{failed} of {all} ropes blew up in the simulator");
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

pub(crate) fn train(arguments: &TrainArguments) -> Result<()> {
    let config = TrainingConfig::load(&arguments.data.config)?;
    let pool = ropes(&config, &arguments.data, Share::Training)?;
    let held_out = ropes(&config, &arguments.data, Share::HeldOut)?;
    let template = "{bar:30} {pos}/{len} steps, {per_sec}, {eta} left, {msg}";
    let bar = bar(config.training.steps, template);
    let mut first = None;
    let trainer = Trainer {
        config: &config,
        pool: &pool,
        held_out: &held_out,
        folder: &arguments.out,
        device: device(arguments.device),
        threads: arguments.data.threads,
    };
    trainer.run(&mut |done, loss, metric| {
        bar.set_position(done as u64);
        bar.set_message(format!("loss {loss:.4}"));
        if let Some(metric) = metric
            && let Some((held_out, errors)) = metric.held_out
        {
            let errors = errors.map(|e| format!("{e:.3}")).join(" ");
            eprintln!(
                "step {done}: loss {:.5}, held out {held_out:.5}, errors {errors}",
                metric.loss
            );
        }
        let began = *first.get_or_insert(done);
        let pause = arguments.pause_after;
        pause.is_none_or(|steps| done + 1 < began + steps)
    })?;
    bar.finish();
    Ok(())
}

/// Predictions for the first films of a studio, which show `count` ropes.
fn look(state: &State, studio: &Studio<'_>, count: usize) -> Result<Vec<Predicted>> {
    let progress = &state.progress;
    let bar = bar(count, "films {bar:30} {pos}/{len}, {eta} left");
    let films = studio.held_out_batch(count, &progress.standard, || bar.inc(1))?;
    bar.finish_and_clear();
    predict(
        &state.model.valid(),
        &progress.config,
        &films,
        &Device::flex(),
    )
}

pub(crate) fn evaluate(arguments: &EvaluateArguments) -> Result<()> {
    let config = TrainingConfig::load(&arguments.data.config)?;
    let pool = ropes(&config, &arguments.data, Share::HeldOut)?;
    let count = arguments.ropes.unwrap_or(pool.len()).min(pool.len());
    let studio = Studio::new(&config, &pool)?;
    let found: Vec<_> = if let Some(model) = &arguments.model {
        let net = PhiNet::load(model)?;
        let in_units = |i| {
            let found = net.predict(&studio.held_out(i)?).map_err(refused)?;
            Ok((found.parameters, found.std_dev))
        };
        (0..count).map(in_units).collect::<Result<_>>()?
    } else {
        let state = State::load_weights(&path_in(&arguments.run))?;
        let looked = look(&state, &studio, count)?;
        let scales = ParameterScale::of_ranges();
        let in_units = |p: &Predicted| in_units(&scales, &p.mean, &p.log_variance);
        looked.iter().map(in_units).collect()
    };
    let with_truth = |(i, (found, std_dev))| Judged {
        truth: *pool.rope(i),
        found,
        std_dev,
    };
    let judged: Vec<Judged> = found.into_iter().enumerate().map(with_truth).collect();
    let evaluation = judge(&judged);
    if arguments.json {
        let text = serde_json::to_string(&evaluation)
            .map_err(|error| TrainingError::Failed(format!("standard output: {error}")))?;
        println!("{text}");
    } else {
        println!("{}", evaluation.table());
    }
    let pairs = |j: &Judged| (fractions(j.truth.to_array()), fractions(j.found));
    let pairs: Vec<_> = judged.iter().map(pairs).collect();
    plot_predictions(&arguments.run.join("predictions.svg"), &pairs)
}

pub(crate) fn export(arguments: &ExportArguments) -> Result<()> {
    let state = State::load_weights(&path_in(&arguments.run))?;
    let config = &state.progress.config;
    let training = ropes(config, &arguments.data, Share::Training)?;
    let held_out = ropes(config, &arguments.data, Share::HeldOut)?;
    let count = training.len().min(FAMILIAR_FILMS);
    let known = look(&state, &Studio::new(config, &training)?, count)?;
    let studio = Studio::new(config, &held_out)?;
    let others = look(&state, &studio, held_out.len())?;
    let bytes = to_onnx(&state, &Familiar::measure(&known, &others)?)?;
    let checked = others.len().min(CHECKED);
    let net = PhiNet::from_bytes("just written", &bytes)?;
    let file = |i| run(&net, &studio.held_out(i)?);
    let file: Vec<Predicted> = (0..checked).map(file).collect::<Result<_>>()?;
    compare(&others, &file)?;
    write_whole(&arguments.out, &bytes)?;
    println!(
        "{}: {} bytes after {} steps, checked against the trained network on {checked} films",
        arguments.out.display(),
        bytes.len(),
        state.progress.step,
    );
    Ok(())
}

/// What a model file makes of a film.
pub(crate) fn run(net: &PhiNet, film: &WiggleFeatures) -> Result<Predicted> {
    let out = net.run(film).map_err(refused)?;
    Ok(Predicted {
        mean: out.mean,
        log_variance: out.log_variance,
        embedding: out.embedding,
    })
}

fn refused(error: PredictError) -> TrainingError {
    TrainingError::Failed(error.to_string())
}

fn bar(length: usize, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style)
}
