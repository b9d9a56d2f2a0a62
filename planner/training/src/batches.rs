//! Batches of films: ropes of the pool through fresh noise, made ahead of the
//! training by threads of their own.

use crate::TrainingError;
use crate::config::TrainingConfig;
use crate::draws::{Purpose, generator, order, seed_for};
use crate::masking::MaskPhase;
use crate::pool::Pool;
use crate::principal::PRINCIPAL;
use crate::ratios::{RATIOS, log_ratios};
use crate::standard::Standard;
use arm_model::Limits;
use arm_model::Pole;
use planner::features::{FeatureDefinition, ViewPlane, WIDTHS, WiggleFeatures, observe};
use planner::synthetic::{FilmNoise, FilmTiming, project, side_camera};
use planner::wiggle::wiggle;
use rand::RngExt;
use rope_sim::PlannedArm;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use shared_types::{RopeParams, StereoCamera};
use std::sync::mpsc::{Receiver, sync_channel};

/// Films that mean film, scales and principal components are measured on.
const STANDARD_FILMS: usize = 600;
/// Batches made ahead by each thread.
const AHEAD: usize = 2;

/// Films of one step, standardised.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Films.
    pub films: usize,
    /// Film by film, frame by frame, channel by channel.
    pub motion: Vec<f32>,
    /// Film by film.
    pub widths: Vec<f32>,
    /// Principal components, film by film.
    pub principal: Vec<f32>,
    /// Normalised parameters, film by film.
    pub targets: Vec<f32>,
    /// Logarithms of ratios, film by film.
    pub ratios: Vec<f32>,
}

/// Parameters as parts of their ranges, order of [`RANGES`].
#[must_use]
pub fn normalised(rope: &RopeParams) -> [f32; ROPE_PARAMETERS] {
    let values = rope.to_array();
    core::array::from_fn(|i| {
        let range = RANGES[i];
        ((values[i] - range.min) / (range.max - range.min)) as f32
    })
}

/// Films ropes of a pool.
#[derive(Debug)]
pub struct Studio<'a> {
    config: &'a TrainingConfig,
    pool: &'a Pool,
    camera: StereoCamera,
    plane: ViewPlane,
    definition: FeatureDefinition,
}

impl<'a> Studio<'a> {
    /// A studio for the ropes of `pool`.
    ///
    /// # Errors
    /// A wiggle that cannot be made or seen.
    pub fn new(config: &'a TrainingConfig, pool: &'a Pool) -> Result<Self, TrainingError> {
        let arm = PlannedArm::new(
            wiggle(&config.data.wiggle, &Limits::default())?,
            Pole::default(),
        );
        Ok(Self {
            config,
            pool,
            camera: side_camera(),
            plane: ViewPlane::of_motion(&arm, config.data.wiggle.filmed_s)?,
            definition: config.features(),
        })
    }

    /// Features of rope `index` through `noise`.
    ///
    /// # Errors
    /// No such rope, or a film of which nothing is seen.
    pub fn film(&self, index: usize, noise: &FilmNoise) -> Result<WiggleFeatures, TrainingError> {
        let film = self.pool.film(index).ok_or_else(|| TrainingError::Value {
            key: "rope index",
            value: index.to_string(),
            expected: "below the number of ropes",
        })?;
        let timing = FilmTiming {
            frames: self.definition.frames,
            rate_hz: self.definition.rate_hz,
        };
        let seen = project(&film, &self.camera, &timing, noise);
        Ok(observe(
            self.definition,
            &seen.track,
            seen.appearance,
            &self.camera,
            &self.plane,
        )?)
    }

    /// Film `index` of the held-out set, always with the same noise.
    ///
    /// # Errors
    /// As [`Studio::film`].
    pub fn held_out(&self, index: usize) -> Result<WiggleFeatures, TrainingError> {
        let seed = seed_for(self.config.data.seed, Purpose::HeldOutNoise);
        self.film(index, &self.config.randomisation.draw(seed, index as u64))
    }

    /// Mean, scale and principal components, from films of the first ropes.
    ///
    /// # Errors
    /// As [`Studio::film`].
    pub fn standard(&self) -> Result<Standard, TrainingError> {
        let seed = seed_for(self.config.training.seed, Purpose::Noise);
        let count = self.pool.len().min(STANDARD_FILMS);
        let films: Vec<WiggleFeatures> = (0..count)
            // Noise that no step of the training has.
            .map(|i| {
                self.film(
                    i,
                    &self.config.randomisation.draw(seed, u64::MAX - i as u64),
                )
            })
            .collect::<Result<_, _>>()?;
        let clean: Vec<WiggleFeatures> = (0..count)
            .map(|i| self.film(i, &FilmNoise::default()))
            .collect::<Result<_, _>>()?;
        Ok(Standard::measure(&films, &clean))
    }

    /// The batch of a training step.
    ///
    /// # Errors
    /// As [`Studio::film`].
    pub fn batch(&self, step: usize, standard: &Standard) -> Result<Batch, TrainingError> {
        let training = &self.config.training;
        let noise_seed = seed_for(training.seed, Purpose::Noise);
        let part = step as f64 / training.steps as f64;
        let phase = MaskPhase::at(&training.masking, part);
        let mut batch = Batch::with_capacity(training.batch);
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
            for width in 0..2 {
                if rng.random::<f64>() < training.width_missing_part {
                    features.widths[2 * width..2 * width + 2].fill(0.0);
                }
            }
            batch.push(features, self.pool.rope(index), standard);
        }
        Ok(batch)
    }

    /// Makes the batches of `steps` in their order on `threads` threads while
    /// `consume` uses them; ends early when it says so.
    ///
    /// # Errors
    /// What a batch or `consume` refuses.
    pub fn stream(
        &self,
        steps: core::ops::Range<usize>,
        standard: &Standard,
        threads: usize,
        consume: &mut dyn FnMut(usize, Batch) -> Result<bool, TrainingError>,
    ) -> Result<(), TrainingError> {
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

impl Batch {
    /// An empty batch.
    #[must_use]
    pub fn with_capacity(films: usize) -> Self {
        Self {
            films: 0,
            motion: Vec::new(),
            widths: Vec::with_capacity(films * WIDTHS),
            principal: Vec::with_capacity(films * PRINCIPAL),
            targets: Vec::with_capacity(films * ROPE_PARAMETERS),
            ratios: Vec::with_capacity(films * RATIOS),
        }
    }

    /// Adds a film of a rope.
    pub fn push(&mut self, mut features: WiggleFeatures, rope: &RopeParams, standard: &Standard) {
        standard.motion(&mut features.motion);
        self.films += 1;
        self.principal.extend(standard.principal(&features.motion));
        self.motion.append(&mut features.motion);
        self.widths.extend(standard.widths(features.widths));
        self.targets.extend(normalised(rope));
        self.ratios.extend(log_ratios(rope));
    }
}
