//! Batches of films: ropes of the pool through fresh noise, made ahead of the
//! training by threads of their own.

use crate::config::TrainingConfig;
use crate::draws::{Purpose, generator, order, seed_for};
use crate::error::{Result, TrainingError};
use crate::masking::MaskPhase;
use crate::pool::Pool;
use crate::standard::Standard;
use planner::features::{ViewPlane, WiggleFeatures, observe};
use planner::synthetic::{FilmNoise, FilmTiming, project, side_camera};
use planner::wiggle::wiggling_arm;
use rand::RngExt;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use shared_types::{RopeParams, StereoCamera};
use std::sync::mpsc::{Receiver, sync_channel};

/// Films that mean film, scales and principal components are measured on.
const STANDARD_FILMS: usize = 600;
/// Batches made ahead by each thread.
const AHEAD: usize = 2;
/// Number of ratios.
pub(crate) const RATIOS: usize = 3;

/// Standardised films.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    pub(crate) films: usize,
    /// Film by film, frame by frame, channel by channel.
    pub(crate) motion: Vec<f32>,
    /// Film by film.
    pub(crate) widths: Vec<f32>,
    /// Principal components, film by film.
    pub(crate) principal: Vec<f32>,
    /// Normalised parameters, film by film.
    pub(crate) targets: Vec<f32>,
    /// Logarithms of ratios, film by film.
    pub(crate) ratios: Vec<f32>,
}

/// Parameters as fractions of their ranges, order of [`RANGES`].
pub(crate) fn fractions(values: [f64; ROPE_PARAMETERS]) -> [f64; ROPE_PARAMETERS] {
    core::array::from_fn(|i| (values[i] - RANGES[i].min) / (RANGES[i].max - RANGES[i].min))
}

/// What a film tells of stiffness, damping and masses: their ratios, as the nine
/// parameters themselves share a factor that no film shows. A head that is used in
/// training only is asked for them, so that the network learns them as such.
///
/// Logarithms of bending stiffness and damping over mass per length, and of lead mass
/// over rope mass, each shifted and scaled to about mean 0 and deviation 1.
fn log_ratios(rope: &RopeParams) -> [f32; RATIOS] {
    let v = rope.to_array();
    let (link_m, mass) = (v[1] / v[0], v[5]);
    let shifted =
        |ratio: f64, (mean, deviation): (f64, f64)| ((ratio.ln() - mean) / deviation) as f32;
    [
        shifted(v[3] * link_m / mass, (-1.9, 1.0)),
        shifted(v[2] * link_m / mass, (-5.0, 1.1)),
        shifted(v[6] / mass / v[1], (0.6, 0.7)),
    ]
}

impl Batch {
    /// Adds a film of a rope.
    pub(crate) fn push(
        &mut self,
        mut features: WiggleFeatures,
        rope: &RopeParams,
        standard: &Standard,
    ) {
        standard.motion(&mut features.motion);
        self.films += 1;
        self.principal.extend(standard.principal(&features.motion));
        self.motion.append(&mut features.motion);
        self.widths.extend(standard.widths(features.widths));
        let targets = fractions(rope.to_array());
        self.targets.extend(targets.map(|fraction| fraction as f32));
        self.ratios.extend(log_ratios(rope));
    }
}

/// Films ropes of a pool.
pub(crate) struct Studio<'a> {
    config: &'a TrainingConfig,
    pool: &'a Pool,
    camera: StereoCamera,
    plane: ViewPlane,
}

impl<'a> Studio<'a> {
    pub(crate) fn new(config: &'a TrainingConfig, pool: &'a Pool) -> Result<Self> {
        let wiggle = &config.data.wiggle;
        Ok(Self {
            config,
            pool,
            camera: side_camera(),
            plane: ViewPlane::of_motion(&wiggling_arm(wiggle)?, wiggle.filmed_s)?,
        })
    }

    /// Features of rope `index` through `noise`.
    fn film(&self, index: usize, noise: &FilmNoise) -> Result<WiggleFeatures> {
        let film = self.pool.film(index);
        let film =
            film.ok_or_else(|| TrainingError::Input(format!("the pool has no rope {index}")))?;
        let definition = self.config.features();
        let timing = FilmTiming {
            frames: definition.frames,
            rate_hz: definition.rate_hz,
        };
        let seen = project(&film, &self.camera, &timing, noise);
        let (track, appearance) = (&seen.track, seen.appearance);
        Ok(observe(
            definition,
            track,
            appearance,
            &self.camera,
            &self.plane,
        )?)
    }

    /// Film `index` of the held-out set, always with the same noise.
    pub(crate) fn held_out(&self, index: usize) -> Result<WiggleFeatures> {
        let seed = seed_for(self.config.data.seed, Purpose::HeldOutNoise);
        self.film(index, &self.config.randomisation.draw(seed, index as u64))
    }

    /// The first `count` films of the held-out set; `made` is called after each.
    pub(crate) fn held_out_batch(
        &self,
        count: usize,
        standard: &Standard,
        made: impl Fn(),
    ) -> Result<Batch> {
        let mut films = Batch::default();
        for i in 0..count {
            films.push(self.held_out(i)?, self.pool.rope(i), standard);
            made();
        }
        Ok(films)
    }

    /// Mean, scale and principal components, from films of the first ropes.
    pub(crate) fn standard(&self) -> Result<Standard> {
        let seed = seed_for(self.config.training.seed, Purpose::Noise);
        // Noise that no step of the training has.
        let noise = |i: usize| self.config.randomisation.draw(seed, u64::MAX - i as u64);
        let films = |noise: &dyn Fn(usize) -> FilmNoise| -> Result<Vec<WiggleFeatures>> {
            let count = self.pool.len().min(STANDARD_FILMS);
            (0..count).map(|i| self.film(i, &noise(i))).collect()
        };
        let clean = |_| FilmNoise::default();
        Ok(Standard::measure(&films(&noise)?, &films(&clean)?))
    }

    /// The batch of a training step.
    pub(crate) fn batch(&self, step: usize, standard: &Standard) -> Result<Batch> {
        let training = &self.config.training;
        let noise_seed = seed_for(training.seed, Purpose::Noise);
        let part = step as f64 / training.steps as f64;
        let phase = MaskPhase::at(&training.masking, part);
        let mut batch = Batch::default();
        // Each pass over the pool has an order of its own.
        let mut epoch = (usize::MAX, Vec::new());
        for i in 0..training.batch {
            let place = step * training.batch + i;
            let (epoch_number, within) = (place / self.pool.len(), place % self.pool.len());
            if epoch.0 != epoch_number {
                let mut rng = generator(training.seed, Purpose::Order, epoch_number as u64);
                epoch = (epoch_number, order(&mut rng, self.pool.len()));
            }
            let index = epoch.1[within] as usize;
            let noise = self.config.randomisation.draw(noise_seed, place as u64);
            let mut features = self.film(index, &noise)?;
            let mut rng = generator(training.seed, Purpose::Masks, place as u64);
            if let Some(phase) = phase {
                phase.apply(&mut features, &mut rng);
            }
            for width in features.widths.chunks_mut(2) {
                if rng.random::<f64>() < training.width_missing_fraction {
                    width.fill(0.0);
                }
            }
            batch.push(features, self.pool.rope(index), standard);
        }
        Ok(batch)
    }

    /// Makes the batches of `steps` in their order on `threads` threads while
    /// `consume` uses them; ends early when it says so.
    pub(crate) fn stream(
        &self,
        steps: core::ops::Range<usize>,
        standard: &Standard,
        threads: usize,
        consume: &mut dyn FnMut(usize, Batch) -> Result<bool>,
    ) -> Result<()> {
        let threads = threads.max(1);
        std::thread::scope(|scope| {
            let makers: Vec<Receiver<_>> = (0..threads)
                .map(|worker| {
                    let (sender, receiver) = sync_channel(AHEAD);
                    let steps = steps.clone().skip(worker).step_by(threads);
                    scope.spawn(move || {
                        for step in steps {
                            // Nobody listens any more: the training has ended.
                            if sender.send(self.batch(step, standard)).is_err() {
                                break;
                            }
                        }
                    });
                    receiver
                })
                .collect();
            for (maker, step) in makers.iter().cycle().zip(steps) {
                // A maker ends early only by a panic, which the scope passes on.
                let Ok(batch) = maker.recv() else { break };
                if !consume(step, batch?)? {
                    break;
                }
            }
            Ok(())
        })
    }
}
