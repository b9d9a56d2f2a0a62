//! The network's layers, with the weights of a model file.
//!
//! Three blocks of convolution (kernel 8), layer norm, GELU and average pooling by 2;
//! average pooling; a linear layer to the embedding that also sees the widths and the
//! motion's principal components; a head for the parameters and one for their variances.
//! Data are frame by frame, so that a convolution is one linear layer over the eight
//! frames around each.

use crate::features::{FeatureDefinition, WIDTHS};
use shared_types::rope::ROPE_PARAMETERS;
use std::collections::BTreeMap;

/// Frames under a convolution.
const KERNEL: usize = 8;
/// Those of them before the one it is about.
const BEFORE: usize = 3;
/// Frames averaged for the principal components.
const PRINCIPAL_FRAMES: usize = 8;
/// Added to the variance by layer norm.
const NORM_EPSILON: f32 = 1e-5;

/// The network's outputs as they are, for one observation.
#[derive(Debug, Clone, PartialEq)]
pub struct RawOutputs {
    /// Normalised parameters.
    pub mean: Vec<f32>,
    /// Logarithms of their variances.
    pub log_variance: Vec<f32>,
    /// Embedding.
    pub embedding: Vec<f32>,
    /// Mean squared deviation of the embedding from those of known ropes.
    pub out_of_distribution: f32,
}

impl RawOutputs {
    pub(super) fn is_finite(&self) -> bool {
        let all = self.mean.iter().chain(&self.log_variance);
        all.chain(&self.embedding)
            .chain([&self.out_of_distribution])
            .all(|x| x.is_finite())
    }
}

/// Weights by name.
type Weights<'a> = BTreeMap<&'a str, Vec<f32>>;

/// The network's weights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Encoder {
    channels: usize,
    motion_mean: Vec<f32>,
    motion_scale: Vec<f32>,
    principal: Linear,
    widths: Linear,
    blocks: Vec<Block>,
    /// Frames averaged after the blocks.
    pooled_frames: usize,
    embed: Linear,
    head: [Linear; 3],
    spread: [Linear; 2],
    familiar_mean: Vec<f32>,
    familiar_whiten: Linear,
}

/// Convolution and layer norm.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    convolution: Linear,
    channels_in: usize,
    norm_scale: Vec<f32>,
    norm_bias: Vec<f32>,
}

/// Weights, input by input, and what is added.
#[derive(Debug, Clone, PartialEq)]
struct Linear {
    weight: Vec<f32>,
    bias: Vec<f32>,
}

fn get(weights: &Weights<'_>, name: &str) -> Result<Vec<f32>, String> {
    let found = weights.get(name).filter(|numbers| !numbers.is_empty());
    found.cloned().ok_or_else(|| format!("no weights `{name}`"))
}

/// Mean over each `frames` frames of `channels` numbers.
fn average(x: &[f32], channels: usize, frames: usize) -> Vec<f32> {
    let mut means = Vec::with_capacity(x.len() / frames);
    for group in x.chunks_exact(channels * frames) {
        let (first, others) = group.split_at(channels);
        let mut sum: Vec<f64> = first.iter().copied().map(f64::from).collect();
        for frame in others.chunks_exact(channels) {
            add(&mut sum, 1.0, frame);
        }
        means.extend(sum.into_iter().map(|x| (x / frames as f64) as f32));
    }
    means
}

/// Sums are in double precision: thousands of summands would lose half of the allowance
/// for differences between runtimes.
#[inline(always)]
fn add(sum: &mut [f64], factor: f32, numbers: &[f32]) {
    for (sum, number) in sum.iter_mut().zip(numbers) {
        *sum += f64::from(factor) * f64::from(*number);
    }
}

fn gelu(mut x: Vec<f32>) -> Vec<f32> {
    for x in &mut x {
        *x *= 0.5 * (1.0 + libm::erff(*x * core::f32::consts::FRAC_1_SQRT_2));
    }
    x
}

fn sigmoid(mut x: Vec<f32>) -> Vec<f32> {
    for x in &mut x {
        *x = 1.0 / (1.0 + libm::expf(-*x));
    }
    x
}

impl Linear {
    fn read(weights: &Weights<'_>, name: &str) -> Result<Self, String> {
        let bias = get(weights, &format!("{name}.bias"))?;
        let weight = get(weights, &format!("{name}.weight"))?;
        Ok(Self { weight, bias })
    }

    /// A matrix without a bias.
    fn matrix(weight: Vec<f32>, outputs: usize) -> Self {
        let bias = vec![0.0; outputs];
        Self { weight, bias }
    }

    fn inputs(&self) -> usize {
        self.weight.len() / self.bias.len()
    }

    fn apply(&self, x: &[f32]) -> Vec<f32> {
        self.apply_from(0, x)
    }

    /// The outputs where the inputs before `first` and after `x` are zero.
    fn apply_from(&self, first: usize, x: &[f32]) -> Vec<f32> {
        let mut y: Vec<f64> = self.bias.iter().copied().map(f64::from).collect();
        let rows = self.weight.chunks_exact(self.bias.len()).skip(first);
        // Wide registers where the machine has them: the same sums in the same order.
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (x, row) in x.iter().zip(rows) {
                    add(&mut y, *x, row);
                }
            },
        );
        y.into_iter().map(|y| y as f32).collect()
    }
}

impl Block {
    fn read(weights: &Weights<'_>, name: &str) -> Result<Self, String> {
        let mut convolution = Linear::read(weights, name)?;
        let channels_in = convolution.inputs() / KERNEL;
        // ONNX has output, channel, tap.
        let (kernel, out) = (convolution.weight, convolution.bias.len());
        let place = |tap, channel, out| (out * channels_in + channel) * KERNEL + tap;
        convolution.weight = (0..KERNEL)
            .flat_map(|tap| (0..channels_in).map(move |channel| (tap, channel)))
            .flat_map(|(tap, channel)| (0..out).map(move |out| place(tap, channel, out)))
            .map(|i| kernel[i])
            .collect();
        Ok(Self {
            convolution,
            channels_in,
            norm_scale: get(weights, &format!("{name}.norm.scale"))?,
            norm_bias: get(weights, &format!("{name}.norm.bias"))?,
        })
    }

    fn apply(&self, x: &[f32]) -> Vec<f32> {
        let channels = self.channels_in;
        let mut y = Vec::new();
        for frame in 0..x.len() / channels {
            let missing = BEFORE.saturating_sub(frame);
            let start = (frame + missing - BEFORE) * channels;
            let end = (start + (KERNEL - missing) * channels).min(x.len());
            let convolved = self
                .convolution
                .apply_from(missing * channels, &x[start..end]);
            y.extend(self.normalised(convolved));
        }
        average(&gelu(y), self.convolution.bias.len(), 2)
    }

    fn normalised(&self, mut x: Vec<f32>) -> Vec<f32> {
        let count = x.len() as f32;
        let mean = x.iter().sum::<f32>() / count;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / count;
        let deviation = (variance + NORM_EPSILON).sqrt();
        let affine = self.norm_scale.iter().zip(&self.norm_bias);
        for (x, (scale, bias)) in x.iter_mut().zip(affine) {
            *x = (*x - mean) / deviation * scale + bias;
        }
        x
    }
}

impl Encoder {
    /// The weights of a network for these features; in words what does not fit.
    pub(super) fn read(
        weights: &Weights<'_>,
        features: &FeatureDefinition,
    ) -> Result<Self, String> {
        let (frames, channels) = (features.frames, features.channels());
        let linear = |name: &str| Linear::read(weights, name);
        let mut blocks = Vec::new();
        while weights.contains_key(format!("block{}.weight", blocks.len()).as_str()) {
            blocks.push(Block::read(weights, &format!("block{}", blocks.len()))?);
        }
        let embed = linear("embed")?;
        let pooled_channels = blocks
            .last()
            .map_or(channels, |block| block.convolution.bias.len());
        let principal = get(weights, "principal")?;
        let components = principal.len() / (frames / PRINCIPAL_FRAMES * channels).max(1);
        let pooled = embed.inputs().saturating_sub(WIDTHS + components) / pooled_channels;
        let embedding = embed.bias.len();
        let read = Self {
            channels,
            motion_mean: get(weights, "motion.mean")?,
            motion_scale: get(weights, "motion.scale")?,
            principal: Linear::matrix(principal, components),
            widths: Linear::matrix(get(weights, "widths.matrix")?, WIDTHS),
            pooled_frames: (frames >> blocks.len()) / pooled.max(1),
            blocks,
            embed,
            head: [linear("head0")?, linear("head1")?, linear("head2")?],
            spread: [linear("spread0")?, linear("spread1")?],
            familiar_mean: get(weights, "familiar.mean")?,
            familiar_whiten: Linear::matrix(get(weights, "familiar.whiten")?, embedding),
        };
        if read.fits(frames) {
            Ok(read)
        } else {
            Err("its weights are not of this network's shape".to_owned())
        }
    }

    /// Whether each layer takes what the one before it gives.
    fn fits(&self, frames: usize) -> bool {
        let embedding = self.embed.bias.len();
        let [first, second, third] = &self.head;
        let [spread, variance] = &self.spread;
        let mut channels = self.channels;
        let blocks = self.blocks.iter().all(|block| {
            let layer = &block.convolution;
            let taken = core::mem::replace(&mut channels, layer.bias.len());
            layer.weight.len() == KERNEL * taken * channels
                && [&block.norm_scale, &block.norm_bias].map(Vec::len) == [channels; 2]
        });
        let layer = |layer: &Linear, inputs: usize| layer.weight.len() == inputs * layer.bias.len();
        blocks
            && self.pooled_frames > 0
            && self.motion_mean.len() == frames * self.channels
            && self.motion_scale.len() == self.channels
            && layer(&self.principal, frames / PRINCIPAL_FRAMES * self.channels)
            && layer(&self.widths, WIDTHS)
            && layer(&self.embed, self.embed.inputs())
            && layer(first, embedding)
            && layer(second, first.bias.len())
            && layer(third, second.bias.len())
            && layer(spread, second.bias.len())
            && layer(variance, spread.bias.len())
            && [third, variance].map(|l| l.bias.len()) == [ROPE_PARAMETERS; 2]
            && self.familiar_mean.len() == embedding
            && layer(&self.familiar_whiten, embedding)
    }

    /// All outputs for one film's motion (frame by frame, metres and radians) and widths.
    pub(super) fn outputs(&self, motion: &[f32], widths: &[f32]) -> RawOutputs {
        let mut x = Vec::with_capacity(motion.len());
        let frames = motion.chunks_exact(self.channels);
        for (frame, mean) in frames.zip(self.motion_mean.chunks_exact(self.channels)) {
            // The last channel says whether the frame was seen.
            let seen = frame[self.channels - 1];
            let standardised = frame.iter().zip(mean).zip(&self.motion_scale);
            x.extend(standardised.map(|((x, mean), scale)| (x - mean) * scale * seen));
        }
        let principal = average(&x, self.channels, PRINCIPAL_FRAMES);
        let mut channels = self.channels;
        for block in &self.blocks {
            x = block.apply(&x);
            channels = block.convolution.bias.len();
        }
        x = average(&x, channels, self.pooled_frames);
        x.extend(self.widths.apply(widths));
        x.extend(self.principal.apply(&principal));
        let embedding = gelu(self.embed.apply(&x));
        let [first, second, third] = &self.head;
        let hidden = gelu(second.apply(&gelu(first.apply(&embedding))));
        let deviation: Vec<f32> = embedding
            .iter()
            .zip(&self.familiar_mean)
            .map(|(x, mean)| x - mean)
            .collect();
        let whitened = self.familiar_whiten.apply(&deviation);
        let squares: f32 = whitened.iter().map(|x| x * x).sum();
        RawOutputs {
            mean: sigmoid(third.apply(&hidden)),
            log_variance: self.spread[1].apply(&gelu(self.spread[0].apply(&hidden))),
            out_of_distribution: squares / embedding.len() as f32,
            embedding,
        }
    }
}
