//! The network: a temporal convolutional encoder and a small head (paper,
//! "Network Architecture").
//!
//! Three blocks of convolution (kernel 8), layer norm, GELU, average pooling by 2
//! and dropout; adaptive pooling; a linear layer to 256 numbers, the embedding,
//! that also sees the widths and the motion's principal components; a head of 128 and 64
//! to the nine normalised parameters. A second, smaller head says how far off each is. It reads the
//! first one's last layer but does not change it. A third one, of use in training only,
//! is asked for the ratios that a film can tell.
//!
//! Data are channel-last. A convolution is one matrix product over the eight
//! shifted copies of its input side by side, which on a CPU is faster than the
//! tensor library's own.

use crate::batches::RATIOS;
use crate::config::NetworkConfig;
use crate::error::{Result, TrainingError};
use crate::principal::PRINCIPAL;
use burn::module::Module;
use burn::nn::{Dropout, DropoutConfig, LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::activation::{gelu, sigmoid};
use burn::tensor::{Device, Tensor};
use planner::features::{FeatureDefinition, WIDTHS};
use shared_types::rope::ROPE_PARAMETERS;

/// Kernel of every convolution.
pub(crate) const KERNEL: usize = 8;
/// Zero frames before and after the input of a convolution.
pub(crate) const PADDING: [usize; 2] = [3, 4];
/// Numbers of the embedding.
pub(crate) const EMBEDDING: usize = 256;
const HEAD: [usize; 2] = [128, 64];
const SPREAD: usize = 32;
/// Added to the variance by layer norm.
pub(crate) const NORM_EPSILON: f64 = 1e-5;

/// Convolution, layer norm, GELU, average pooling by 2, dropout.
#[derive(Module, Debug)]
pub(crate) struct Block {
    /// Weight `[(tap, channel in), channel out]`.
    pub(crate) convolution: Linear,
    /// Over the channels.
    pub(crate) norm: LayerNorm,
    dropout: Dropout,
}

/// The network.
#[derive(Module, Debug)]
pub(crate) struct PhiModel {
    pub(crate) blocks: Vec<Block>,
    /// To the embedding.
    pub(crate) embed: Linear,
    /// Head: embedding to 128, 64 and the parameters.
    pub(crate) head: Vec<Linear>,
    /// Head of the deviations: 64 to 32 and the logarithms of the variances.
    pub(crate) spread: Vec<Linear>,
    /// Head of the ratios.
    pub(crate) ratios: Linear,
    /// Length after adaptive pooling.
    pub(crate) pooled: usize,
}

/// What the network gives.
pub(crate) struct Outputs {
    /// Normalised parameters `[n, 9]`.
    pub(crate) mean: Tensor<2>,
    /// Logarithm of their variances `[n, 9]`.
    pub(crate) log_variance: Tensor<2>,
    /// Embedding `[n, 256]`.
    pub(crate) embedding: Tensor<2>,
    /// Logarithms of ratios `[n, 3]`.
    pub(crate) ratios: Tensor<2>,
}

impl PhiModel {
    /// A network with random weights of the device's generator.
    pub(crate) fn new(
        config: &NetworkConfig,
        features: &FeatureDefinition,
        device: &Device,
    ) -> Self {
        let mut channels_in = features.channels();
        let blocks = config
            .channels
            .iter()
            .map(|channels| {
                let block = Block {
                    convolution: LinearConfig::new(KERNEL * channels_in, *channels).init(device),
                    norm: LayerNormConfig::new(*channels)
                        .with_epsilon(NORM_EPSILON)
                        .init(device),
                    dropout: DropoutConfig::new(config.dropout).init(),
                };
                channels_in = *channels;
                block
            })
            .collect();
        let layer = |a, b| LinearConfig::new(a, b).init(device);
        Self {
            blocks,
            embed: layer(config.pooled * channels_in + WIDTHS + PRINCIPAL, EMBEDDING),
            head: vec![
                layer(EMBEDDING, HEAD[0]),
                layer(HEAD[0], HEAD[1]),
                layer(HEAD[1], ROPE_PARAMETERS),
            ],
            spread: vec![layer(HEAD[1], SPREAD), layer(SPREAD, ROPE_PARAMETERS)],
            ratios: layer(HEAD[1], RATIOS),
            pooled: config.pooled,
        }
    }

    /// Standardised motion `[n, frames, channels]`, widths `[n, 4]` and principal
    /// components `[n, 64]` to outputs.
    pub(crate) fn forward(
        &self,
        motion: Tensor<3>,
        widths: Tensor<2>,
        principal: Tensor<2>,
    ) -> Outputs {
        let mut x = motion;
        for block in &self.blocks {
            x = block.forward(x);
        }
        let [films, length, channels] = x.dims();
        let x = pool(x, length / self.pooled).reshape([films, self.pooled * channels]);
        let x = Tensor::cat(vec![x, widths, principal], 1);
        let embedding = gelu(self.embed.forward(x));
        let [first, second, third] = [&self.head[0], &self.head[1], &self.head[2]];
        let hidden = gelu(second.forward(gelu(first.forward(embedding.clone()))));
        let ratios = self.ratios.forward(hidden.clone());
        let mean = sigmoid(third.forward(hidden.clone()));
        let spread = gelu(self.spread[0].forward(hidden.detach()));
        Outputs {
            mean,
            log_variance: self.spread[1].forward(spread),
            embedding,
            ratios,
        }
    }
}

impl Block {
    fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let [films, length, channels] = x.dims();
        let device = x.device();
        let zeros = |frames| Tensor::<3>::zeros([films, frames, channels], &device);
        let padded = Tensor::cat(vec![zeros(PADDING[0]), x, zeros(PADDING[1])], 1);
        let taps = (0..KERNEL)
            .map(|tap| padded.clone().narrow(1, tap, length))
            .collect();
        let taps = Tensor::cat(taps, 2).reshape([films * length, KERNEL * channels]);
        let y = self.norm.forward(self.convolution.forward(taps));
        let [_, channels] = y.dims();
        let y = gelu(y).reshape([films, length, channels]);
        self.dropout.forward(pool(y, 2))
    }
}

/// Mean over each `width` frames.
fn pool(x: Tensor<3>, width: usize) -> Tensor<3> {
    let [films, length, channels] = x.dims();
    x.reshape([films, length / width, width, channels])
        .mean_dim(2)
        .reshape([films, length / width, channels])
}

/// A tensor's numbers, its last axis first to change.
pub(crate) fn numbers<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>> {
    let numbers = tensor.into_data().try_into_vec::<f32>();
    numbers.map_err(|error| TrainingError::tensors(format!("{error:?}")))
}
