//! The optimisation: batches in, better weights out, checkpoints on the way.

use crate::TrainingError;
use crate::batches::{Batch, Studio};
use crate::checkpoint::{Optimizer, Progress, State, path_in};
use crate::config::TrainingConfig;
use crate::draws::{Purpose, seed_for};
use crate::files::write_whole;
use crate::metrics::Metric;
use crate::network::{Outputs, PhiModel};
use crate::plots::plot_losses;
use crate::pool::Pool;
use crate::principal::PRINCIPAL;
use crate::ratios::RATIOS;
use crate::standard::Standard;
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use planner::features::WIDTHS;
use shared_types::rope::ROPE_PARAMETERS;
use std::fmt::Write as _;
use std::path::Path;

/// Weight of the ratios' squared errors, which are in deviations, beside those of the
/// parameters, which are in parts of the ranges.
const RATIO_PART: f64 = 0.1;
/// Films predicted at once.
const PREDICT_BATCH: usize = 50;

/// A training's data, folder and machine.
#[derive(Debug)]
pub struct Trainer<'a> {
    /// The configuration.
    pub config: &'a TrainingConfig,
    /// Ropes to train on.
    pub pool: &'a Pool,
    /// Ropes that only judge.
    pub held_out: &'a Pool,
    /// Where checkpoint, metrics and plots are kept.
    pub folder: &'a Path,
    /// What computes.
    pub device: Device,
    /// Threads that make batches.
    pub threads: usize,
}

/// Told after every step: steps done, learning rate, loss, and after a look at
/// held-out ropes what it showed. `false` ends the training after a checkpoint.
pub type Tell<'a> = dyn FnMut(usize, f64, f32, Option<&Metric>) -> bool + 'a;

impl Trainer<'_> {
    /// Trains to the end, from the checkpoint in the folder if there is one.
    ///
    /// # Errors
    /// A checkpoint of another configuration, files that cannot be written, or a
    /// loss that is not finite.
    pub fn run(&self, tell: &mut Tell<'_>) -> Result<State, TrainingError> {
        self.config.check()?;
        let training = &self.config.training;
        let device = self.device.clone().autodiff();
        let studio = Studio::new(self.config, self.pool)?;
        let mut state = self.begin(&studio, &device)?;
        let mut metrics = self.metrics_until(state.progress.step)?;
        let judge = Judge::new(self, &state.progress.standard)?;
        let standard = state.progress.standard.clone();
        let steps = state.progress.step..training.steps;
        studio.stream(steps, &standard, self.threads, &mut |step, batch| {
            let learning_rate = training.learning_rate_at(step);
            let loss = self.step(&mut state, batch, learning_rate, &device)?;
            let progress = &mut state.progress;
            progress.loss_sum += f64::from(loss);
            progress.losses += 1;
            let done = progress.step;
            let mut shown = false;
            if done.is_multiple_of(training.validate_every) || done == training.steps {
                let mean = progress.loss_sum / f64::from(progress.losses);
                (progress.loss_sum, progress.losses) = (0.0, 0);
                metrics.push(Metric {
                    step: done,
                    learning_rate,
                    loss: mean,
                    held_out: Some(judge.look(&state.model.valid(), &self.device)?),
                });
                shown = true;
                self.write_metrics(&metrics)?;
            }
            let go_on = tell(done, learning_rate, loss, metrics.last().filter(|_| shown));
            if !go_on || done.is_multiple_of(training.checkpoint_every) || done == training.steps {
                state.save(&path_in(self.folder))?;
            }
            Ok(go_on)
        })?;
        Ok(state)
    }

    fn begin(&self, studio: &Studio<'_>, device: &Device) -> Result<State, TrainingError> {
        let path = path_in(self.folder);
        let data_sha256 = self.pool.sha256();
        if path.exists() {
            let state = State::load(&path, device)?;
            if state.progress.config != *self.config || state.progress.data_sha256 != data_sha256 {
                return Err(TrainingError::bad_file(
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
            optimizer: Optimizer::default(),
        })
    }

    /// One step of Adam; the loss before it.
    fn step(
        &self,
        state: &mut State,
        batch: Batch,
        learning_rate: f64,
        device: &Device,
    ) -> Result<f32, TrainingError> {
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
            return Err(TrainingError::Diverged { step, loss: value });
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &state.model);
        let model = state.model.clone();
        state.model = state.optimizer.0.step(learning_rate, model, gradients);
        state.progress.step += 1;
        Ok(value)
    }

    fn metrics_path(&self) -> std::path::PathBuf {
        self.folder.join("metrics.jsonl")
    }

    /// Metrics of the training up to the checkpoint it goes on from.
    fn metrics_until(&self, step: usize) -> Result<Vec<Metric>, TrainingError> {
        let path = self.metrics_path();
        if step == 0 || !path.exists() {
            return Ok(Vec::new());
        }
        let text = std::fs::read_to_string(&path).map_err(|e| TrainingError::file(&path, e))?;
        let all: Vec<Metric> = text
            .lines()
            .map(serde_json::from_str)
            .collect::<Result<_, _>>()
            .map_err(|error| TrainingError::bad_file(&path, error.to_string()))?;
        Ok(all.into_iter().filter(|m| m.step <= step).collect())
    }

    fn write_metrics(&self, metrics: &[Metric]) -> Result<(), TrainingError> {
        let path = self.metrics_path();
        let mut text = String::new();
        for metric in metrics {
            let line = serde_json::to_string(metric)
                .map_err(|error| TrainingError::bad_file(&path, error.to_string()))?;
            // Writing to a string does not fail.
            let _ = writeln!(text, "{line}");
        }
        write_whole(&path, text.as_bytes())?;
        plot_losses(&self.folder.join("loss.svg"), metrics)
    }
}

/// Held-out films, made once.
struct Judge<'a> {
    config: &'a TrainingConfig,
    films: Batch,
}

impl<'a> Judge<'a> {
    fn new(trainer: &Trainer<'a>, standard: &Standard) -> Result<Self, TrainingError> {
        let studio = Studio::new(trainer.config, trainer.held_out)?;
        let count = trainer.config.training.validation_ropes;
        let mut films = Batch::with_capacity(count);
        for i in 0..count {
            films.push(studio.held_out(i)?, trainer.held_out.rope(i), standard);
        }
        Ok(Self {
            config: trainer.config,
            films,
        })
    }

    fn look(
        &self,
        model: &PhiModel,
        device: &Device,
    ) -> Result<(f64, [f64; ROPE_PARAMETERS]), TrainingError> {
        let mut squares = 0.0;
        let mut errors = [0.0; ROPE_PARAMETERS];
        let count = self.films.films as f64;
        for prediction in predict(model, self.config, &self.films, device)? {
            let truth = &self.films.targets[prediction.film * ROPE_PARAMETERS..];
            for i in 0..ROPE_PARAMETERS {
                let error = f64::from(prediction.mean[i] - truth[i]);
                squares += error * error / (count * ROPE_PARAMETERS as f64);
                errors[i] += error.abs() / count;
            }
        }
        Ok((squares, errors))
    }
}

/// What the network makes of one film.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Index of the film in its batch.
    pub film: usize,
    /// Normalised parameters.
    pub mean: Vec<f32>,
    /// Logarithms of their variances.
    pub log_variance: Vec<f32>,
    /// Embedding.
    pub embedding: Vec<f32>,
}

/// Predictions for standardised films, without dropout; `model` must be
/// [valid](Module::valid).
///
/// # Errors
/// What the tensor library refuses.
pub fn predict(
    model: &PhiModel,
    config: &TrainingConfig,
    films: &Batch,
    device: &Device,
) -> Result<Vec<Predicted>, TrainingError> {
    let features = config.features();
    let each = features.frames * features.channels();
    let mut all = Vec::with_capacity(films.films);
    for first in (0..films.films).step_by(PREDICT_BATCH) {
        let count = PREDICT_BATCH.min(films.films - first);
        let part = |numbers: &[f32], each| numbers[first * each..(first + count) * each].to_vec();
        let input = [
            part(&films.motion, each),
            part(&films.widths, WIDTHS),
            part(&films.principal, PRINCIPAL),
        ];
        let out = forward(model, config, count, input, device);
        let rows = |t: Tensor<2>| -> Result<Vec<Vec<f32>>, TrainingError> {
            let [_, width] = t.dims();
            let numbers = t.into_data().try_into_vec::<f32>();
            let numbers = numbers.map_err(|error| TrainingError::Tensors {
                reason: format!("{error:?}"),
            })?;
            Ok(numbers.chunks(width).map(<[f32]>::to_vec).collect())
        };
        let outputs = rows(out.mean)?
            .into_iter()
            .zip(rows(out.log_variance)?)
            .zip(rows(out.embedding)?);
        all.extend(
            outputs
                .enumerate()
                .map(|(i, ((mean, log_variance), embedding))| Predicted {
                    film: first + i,
                    mean,
                    log_variance,
                    embedding,
                }),
        );
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
