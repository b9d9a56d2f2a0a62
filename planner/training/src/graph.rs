//! The network as an ONNX graph, layer by layer.

use crate::error::Result;
use crate::familiar::Familiar;
use crate::network::{EMBEDDING, KERNEL, NORM_EPSILON, PADDING, PhiModel, numbers};
use crate::onnx::{FLOAT, Graph, INT64, float, int, ints};
use crate::principal::{POOL, PRINCIPAL};
use crate::standard::Standard;
use burn::module::Param;
use burn::nn::Linear;
use burn::tensor::Tensor;
use planner::features::{FeatureDefinition, WIDTHS};
use planner::phi::{INPUTS, OUTPUTS};
use shared_types::rope::ROPE_PARAMETERS;

/// Writes a graph node by node; outputs without a name of their own are numbered.
#[derive(Default)]
pub(crate) struct GraphWriter {
    graph: Graph,
}

impl GraphWriter {
    /// The bytes of the whole network with its weights.
    pub(crate) fn network(
        mut self,
        model: &PhiModel,
        standard: &Standard,
        features: &FeatureDefinition,
        familiar: &Familiar,
    ) -> Result<Vec<u8>> {
        let channels = features.channels();
        self.graph.input(INPUTS[0], &[features.frames, channels]);
        self.graph.input(INPUTS[1], &[WIDTHS]);
        let sizes = [ROPE_PARAMETERS, ROPE_PARAMETERS, EMBEDDING, 1];
        for (name, size) in OUTPUTS.into_iter().zip(sizes) {
            self.graph.output(name, &[size]);
        }
        let x = self.standardised_motion(standard, features);
        let mut x = self.transpose(&x);
        let principal = self.principal(&x, standard);
        for (i, block) in model.blocks.iter().enumerate() {
            let [rows, out] = block.convolution.weight.dims();
            let weight = numbers(block.convolution.weight.val())?;
            let name = format!("block{i}");
            let kernel = self.floats(
                &format!("{name}.weight"),
                &[out, rows / KERNEL, KERNEL],
                &as_kernel(&weight, rows / KERNEL, out),
            );
            let bias = self.bias(&name, block.convolution.bias.as_ref(), out)?;
            let pads = [PADDING[0] as i64, PADDING[1] as i64];
            x = self.node(
                "Conv",
                &[&x, &kernel, &bias],
                &[ints("kernel_shape", &[KERNEL as i64]), ints("pads", &pads)],
            );
            x = self.transpose(&x);
            let gamma = numbers(block.norm.gamma.val())?;
            let gamma = self.floats(&format!("{name}.norm.scale"), &[out], &gamma);
            let beta = self.bias(&format!("{name}.norm"), block.norm.beta.as_ref(), out)?;
            let epsilon = NORM_EPSILON as f32;
            x = self.node(
                "LayerNormalization",
                &[&x, &gamma, &beta],
                &[int("axis", -1), float("epsilon", epsilon)],
            );
            x = self.node("Gelu", &[&x], &[]);
            x = self.transpose(&x);
            x = self.average(&x, 2);
        }
        x = self.average(&x, features.frames / 8 / model.pooled);
        x = self.transpose(&x);
        x = self.node("Flatten", &[&x], &[int("axis", 1)]);
        let widths = self.standardised_widths(standard);
        x = self.node("Concat", &[&x, &widths, &principal], &[int("axis", 1)]);
        x = self.linear("embed", &x, &model.embed)?;
        let embedding = self.named("Gelu", &[&x], &[], OUTPUTS[2]);
        x = self.linear("head0", &embedding, &model.head[0])?;
        x = self.node("Gelu", &[&x], &[]);
        x = self.linear("head1", &x, &model.head[1])?;
        let hidden = self.node("Gelu", &[&x], &[]);
        x = self.linear("head2", &hidden, &model.head[2])?;
        self.named("Sigmoid", &[&x], &[], OUTPUTS[0]);
        x = self.linear("spread0", &hidden, &model.spread[0])?;
        x = self.node("Gelu", &[&x], &[]);
        x = self.linear("spread1", &x, &model.spread[1])?;
        self.named("Identity", &[&x], &[], OUTPUTS[1]);
        self.out_of_distribution(&embedding, familiar);
        Ok(self.graph.encode("phi-nn"))
    }

    /// (x - mean) * scale * mask, the mask being the last channel.
    fn standardised_motion(&mut self, standard: &Standard, features: &FeatureDefinition) -> String {
        let channels = features.channels();
        let mean = self.floats("motion.mean", &[features.frames, channels], &standard.mean);
        let scale = self.floats("motion.scale", &[channels], &standard.scale);
        let last = channels as i64 - 1;
        let start = self.integer("mask.start", last);
        let end = self.integer("mask.end", last + 1);
        let axis = self.integer("mask.axis", 2);
        let mask = self.node("Slice", &[INPUTS[0], &start, &end, &axis], &[]);
        let x = self.node("Sub", &[INPUTS[0], &mean], &[]);
        let x = self.node("Mul", &[&x, &scale], &[]);
        self.node("Mul", &[&x, &mask], &[])
    }

    /// Principal components of standardised motion, transposed.
    fn principal(&mut self, x: &str, standard: &Standard) -> String {
        let matrix = &standard.principal.matrix;
        let dims = [matrix.len() / PRINCIPAL, PRINCIPAL];
        let matrix = self.floats("principal", &dims, matrix);
        let x = self.average(x, POOL);
        let x = self.transpose(&x);
        let x = self.node("Flatten", &[&x], &[int("axis", 1)]);
        self.node("MatMul", &[&x, &matrix], &[])
    }

    /// A width that was not seen is 0 with mark 0, so that one matrix does it.
    fn standardised_widths(&mut self, standard: &Standard) -> String {
        let mut matrix = [0.0; WIDTHS * WIDTHS];
        for i in 0..2 {
            let scale = standard.width_scale[i];
            matrix[2 * i * WIDTHS + 2 * i] = scale;
            matrix[(2 * i + 1) * WIDTHS + 2 * i] = -standard.width_mean[i] * scale;
            matrix[(2 * i + 1) * WIDTHS + 2 * i + 1] = 1.0;
        }
        let matrix = self.floats("widths.matrix", &[WIDTHS, WIDTHS], &matrix);
        self.node("MatMul", &[INPUTS[1], &matrix], &[])
    }

    /// Mean square of the whitened embedding.
    fn out_of_distribution(&mut self, embedding: &str, familiar: &Familiar) {
        let mean = self.floats("familiar.mean", &[EMBEDDING], &familiar.mean);
        let whiten = self.floats("familiar.whiten", &[EMBEDDING, EMBEDDING], &familiar.whiten);
        let share = vec![1.0 / EMBEDDING as f32; EMBEDDING];
        let share = self.floats("familiar.share", &[EMBEDDING, 1], &share);
        let x = self.node("Sub", &[embedding, &mean], &[]);
        let x = self.node("MatMul", &[&x, &whiten], &[]);
        let x = self.node("Mul", &[&x, &x], &[]);
        self.named("MatMul", &[&x, &share], &[], OUTPUTS[3]);
    }

    fn linear(&mut self, name: &str, x: &str, layer: &Linear) -> Result<String> {
        let dims = layer.weight.dims();
        let weight = numbers(layer.weight.val())?;
        let weight = self.floats(&format!("{name}.weight"), &dims, &weight);
        let bias = self.bias(name, layer.bias.as_ref(), dims[1])?;
        Ok(self.node("Gemm", &[x, &weight, &bias], &[]))
    }

    /// A layer's bias, zeros if it has none.
    fn bias(&mut self, name: &str, bias: Option<&Param<Tensor<1>>>, out: usize) -> Result<String> {
        let bias = bias.map_or_else(|| Ok(vec![0.0; out]), |b| numbers(b.val()))?;
        Ok(self.floats(&format!("{name}.bias"), &[out], &bias))
    }

    fn transpose(&mut self, x: &str) -> String {
        self.node("Transpose", &[x], &[ints("perm", &[0, 2, 1])])
    }

    fn average(&mut self, x: &str, width: usize) -> String {
        let width = [width as i64];
        self.node(
            "AveragePool",
            &[x],
            &[ints("kernel_shape", &width), ints("strides", &width)],
        )
    }

    fn node(&mut self, op: &str, inputs: &[&str], attributes: &[Vec<u8>]) -> String {
        let output = format!("x{}", self.graph.nodes());
        self.named(op, inputs, attributes, &output)
    }

    fn named(&mut self, op: &str, inputs: &[&str], attributes: &[Vec<u8>], output: &str) -> String {
        self.graph.node(op, inputs, output, attributes);
        output.to_owned()
    }

    fn floats(&mut self, name: &str, dims: &[usize], numbers: &[f32]) -> String {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.graph.constant(name, FLOAT, dims, &bytes);
        name.to_owned()
    }

    fn integer(&mut self, name: &str, number: i64) -> String {
        self.graph
            .constant(name, INT64, &[1], &number.to_le_bytes());
        name.to_owned()
    }
}

/// Weight `[(tap, in), out]` as ONNX has it: `[out, in, tap]`.
fn as_kernel(weight: &[f32], channels_in: usize, channels_out: usize) -> Vec<f32> {
    let mut kernel = Vec::with_capacity(weight.len());
    for out in 0..channels_out {
        for channel in 0..channels_in {
            for tap in 0..KERNEL {
                kernel.push(weight[(tap * channels_in + channel) * channels_out + out]);
            }
        }
    }
    kernel
}
