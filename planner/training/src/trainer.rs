//! The optimisation: batches in, better weights out, checkpoints on the way.

use crate::batches::{Batch, RATIOS, Studio};
use crate::checkpoint::{Progress, State, adam, path_in};
use crate::config::TrainingConfig;
use crate::draws::{Purpose, seed_for};
use crate::error::{Result, TrainingError};
use crate::metrics::{self, Metric};
use crate::network::{Outputs, PhiModel, numbers};
use crate::plots::plot_losses;
use crate::pool::Pool;
use crate::principal::PRINCIPAL;
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use planner::features::WIDTHS;
use shared_types::rope::ROPE_PARAMETERS;
use std::path::Path;

/// Weight of the ratios' squared errors, which are in deviations, beside those of the
/// parameters, which are in parts of the ranges.
const RATIO_PART: f64 = 0.1;
/// Films predicted at once.
const PREDICT_BATCH: usize = 50;

/// A training's data, folder and machine.
pub(crate) struct Trainer<'a> {
    pub(crate) config: &'a TrainingConfig,
    /// Ropes to train on.
    pub(crate) pool: &'a Pool,
    /// Ropes that only judge.
    pub(crate) held_out: &'a Pool,
    /// Where checkpoint, metrics and plots are kept.
    pub(crate) folder: &'a Path,
    /// What computes.
    pub(crate) device: Device,
    /// Threads that make batches.
    pub(crate) threads: usize,
}

/// Told after every step: steps done, loss, and after a look at held-out ropes what it
/// showed. `false` ends the training after a checkpoint.
pub(crate) type Tell<'a> = dyn FnMut(usize, f32, Option<&Metric>) -> bool + 'a;

impl Trainer<'_> {
    /// Trains to the end, from the checkpoint in the folder if there is one.
    pub(crate) fn run(&self, tell: &mut Tell<'_>) -> Result<State> {
        self.config.check()?;
        let training = &self.config.training;
        let device = self.device.clone().autodiff();
        let studio = Studio::new(self.config, self.pool)?;
        let mut state = self.begin(&studio, &device)?;
        let metrics_path = self.folder.join("metrics.jsonl");
        let mut lines = metrics::read_until(&metrics_path, state.progress.step)?;
        let standard = state.progress.standard.clone();
        let held_out = Studio::new(self.config, self.held_out)?;
        let held_out = held_out.held_out_batch(training.validation_ropes, &standard, || ())?;
        let steps = state.progress.step..training.steps;
        studio.stream(steps, &standard, self.threads, &mut |step, batch| {
            let learning_rate = training.learning_rate_at(step);
            let loss = self.step(&mut state, batch, learning_rate, &device)?;
            let progress = &mut state.progress;
            progress.loss_sum += f64::from(loss);
            progress.losses += 1;
            let done = progress.step;
            let due = |every: usize| done.is_multiple_of(every) || done == training.steps;
            let mut shown = None;
            if due(training.validate_every) {
                let mean = progress.loss_sum / f64::from(progress.losses);
                (progress.loss_sum, progress.losses) = (0.0, 0);
                lines.push(Metric {
                    step: done,
                    learning_rate,
                    loss: mean,
                    held_out: Some(self.judge(&state.model.valid(), &held_out)?),
                });
                shown = lines.last();
                metrics::write(&metrics_path, &lines)?;
                plot_losses(&self.folder.join("loss.svg"), &lines)?;
            }
            let go_on = tell(done, loss, shown);
            if !go_on || due(training.checkpoint_every) {
                state.save(&path_in(self.folder))?;
            }
            Ok(go_on)
        })?;
        Ok(state)
    }

    fn begin(&self, studio: &Studio<'_>, device: &Device) -> Result<State> {
        let path = path_in(self.folder);
        let data_sha256 = self.pool.sha256();
        if path.exists() {
            let state = State::load(&path, device)?;
            if state.progress.config != *self.config || state.progress.data_sha256 != data_sha256 {
                return Err(TrainingError::file(
                    &path,
                    "belongs to another configuration or other data: train in another folder",
                ));
            }
            return Ok(state);
        }
        device.seed(seed_for(self.config.training.seed, Purpose::Weights));
        Ok(State {
            progress: Progress {
                step: 0,
                config: self.config.clone(),
                standard: studio.standard()?,
                data_sha256,
                loss_sum: 0.0,
                losses: 0,
            },
            model: PhiModel::new(&self.config.network, &self.config.features(), device),
            optimizer: adam(),
        })
    }

    /// One step of Adam; the loss before it.
    fn step(
        &self,
        state: &mut State,
        batch: Batch,
        learning_rate: f64,
        device: &Device,
    ) -> Result<f32> {
        let step = state.progress.step;
        // Dropout is a function of the step, so that a resumed training draws the
        // same.
        let seed = seed_for(self.config.training.seed, Purpose::Dropout);
        device.seed(seed.wrapping_add(step as u64));
        let films = batch.films;
        let targets = tensor(batch.targets, [films, ROPE_PARAMETERS], device);
        let ratios = tensor(batch.ratios, [films, RATIOS], device);
        let input = [batch.motion, batch.widths, batch.principal];
        let out = forward(&state.model, self.config, films, input, device);
        let error = out.mean.sub(targets).powi_scalar(2);
        let fit = error.clone().mean();
        // Gaussian likelihood of the errors as they are, scaled down so that the
        // two losses are of one size; the heads share no gradient.
        let spread = out.log_variance.clamp(-14.0, 4.0);
        let likelihood = (error.detach() * spread.clone().neg().exp() + spread).mean();
        let ratios = out.ratios.sub(ratios).powi_scalar(2).mean();
        let loss = fit.clone() + ratios.mul_scalar(RATIO_PART) + likelihood.mul_scalar(0.01);
        let value: f32 = fit.into_scalar();
        if !value.is_finite() {
            return Err(TrainingError::Failed(format!(
                "step {step}: the loss is {value}; use a smaller `learning_rate`"
            )));
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &state.model);
        let model = state.model.clone();
        state.model = state.optimizer.step(learning_rate, model, gradients);
        state.progress.step += 1;
        Ok(value)
    }

    /// Mean squared error over all parameters of the films, and mean absolute error of
    /// each, as fractions of the ranges.
    fn judge(&self, model: &PhiModel, films: &Batch) -> Result<(f64, [f64; ROPE_PARAMETERS])> {
        let mut squares = 0.0;
        let mut errors = [0.0; ROPE_PARAMETERS];
        let count = films.films as f64;
        let found = predict(model, self.config, films, &self.device)?;
        for (found, truth) in found.iter().zip(films.targets.chunks(ROPE_PARAMETERS)) {
            for i in 0..ROPE_PARAMETERS {
                let error = f64::from(found.mean[i] - truth[i]);
                squares += error * error / (count * ROPE_PARAMETERS as f64);
                errors[i] += error.abs() / count;
            }
        }
        Ok((squares, errors))
    }
}

/// What the network makes of one film.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Predicted {
    /// Normalised parameters.
    pub(crate) mean: Vec<f32>,
    /// Logarithms of their variances.
    pub(crate) log_variance: Vec<f32>,
    pub(crate) embedding: Vec<f32>,
}

/// Predictions for standardised films in their order, without dropout; `model` must be
/// [valid](Module::valid).
pub(crate) fn predict(
    model: &PhiModel,
    config: &TrainingConfig,
    films: &Batch,
    device: &Device,
) -> Result<Vec<Predicted>> {
    let mut all = Vec::with_capacity(films.films);
    for first in (0..films.films).step_by(PREDICT_BATCH) {
        let count = PREDICT_BATCH.min(films.films - first);
        let input = [&films.motion, &films.widths, &films.principal].map(|numbers| {
            let each = numbers.len() / films.films;
            numbers[first * each..(first + count) * each].to_vec()
        });
        let out = forward(model, config, count, input, device);
        let rows = |t: Tensor<2>| -> Result<Vec<Vec<f32>>> {
            let [_, width] = t.dims();
            Ok(numbers(t)?.chunks(width).map(<[f32]>::to_vec).collect())
        };
        let outputs = rows(out.mean)?.into_iter().zip(rows(out.log_variance)?);
        let outputs = outputs.zip(rows(out.embedding)?);
        all.extend(outputs.map(|((mean, log_variance), embedding)| Predicted {
            mean,
            log_variance,
            embedding,
        }));
    }
    Ok(all)
}

fn forward(
    model: &PhiModel,
    config: &TrainingConfig,
    films: usize,
    [motion, widths, principal]: [Vec<f32>; 3],
    device: &Device,
) -> Outputs {
    let features = config.features();
    let shape = [films, features.frames, features.channels()];
    model.forward(
        tensor(motion, shape, device),
        tensor(widths, [films, WIDTHS], device),
        tensor(principal, [films, PRINCIPAL], device),
    )
}

fn tensor<const D: usize>(numbers: Vec<f32>, shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(numbers, shape), device)
}
