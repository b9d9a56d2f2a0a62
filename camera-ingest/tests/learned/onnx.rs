//! Small ONNX files, written field by field as `onnx.proto` numbers them.
#![allow(dead_code, reason = "not every test file uses everything")]

/// `TensorProto.DataType`.
pub(crate) const FLOAT: u64 = 1;
pub(crate) const DOUBLE: u64 = 11;

/// Length of an axis.
#[derive(Clone, Copy)]
pub(crate) enum Axis {
    Is(u64),
    Open(&'static str),
}

/// A graph being written.
#[derive(Clone, Default)]
pub(crate) struct Graph {
    nodes: Vec<u8>,
    rest: Vec<u8>,
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 0x7f {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// A field of a plain number.
fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

/// A field of bytes.
fn bytes(field: u64, content: impl AsRef<[u8]>) -> Vec<u8> {
    let content = content.as_ref();
    let head = [varint(field << 3 | 2), varint(content.len() as u64)].concat();
    [&head, content].concat()
}

/// An attribute of one whole number.
pub(crate) fn int(name: &str, value: u64) -> Vec<u8> {
    [bytes(1, name), number(3, value), number(20, 2)].concat()
}

/// An attribute of several whole numbers.
pub(crate) fn ints(name: &str, values: &[u64]) -> Vec<u8> {
    let values: Vec<u8> = values.iter().flat_map(|v| number(8, *v)).collect();
    [bytes(1, name), values, number(20, 7)].concat()
}

impl Graph {
    fn value(field: u64, name: &str, kind: u64, axes: &[Axis]) -> Vec<u8> {
        let shape: Vec<u8> = axes
            .iter()
            .flat_map(|axis| match axis {
                Axis::Is(length) => bytes(1, number(1, *length)),
                Axis::Open(name) => bytes(1, bytes(2, name)),
            })
            .collect();
        let tensor = [number(1, kind), bytes(2, shape)].concat();
        bytes(field, [bytes(1, name), bytes(2, bytes(1, tensor))].concat())
    }

    pub(crate) fn input(mut self, name: &str, kind: u64, axes: &[Axis]) -> Self {
        self.rest.extend(Self::value(11, name, kind, axes));
        self
    }

    pub(crate) fn output(mut self, name: &str, kind: u64, axes: &[Axis]) -> Self {
        self.rest.extend(Self::value(12, name, kind, axes));
        self
    }

    pub(crate) fn floats(mut self, name: &str, dims: &[u64], values: &[f32]) -> Self {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(name, dims, FLOAT, &raw);
        self
    }

    pub(crate) fn integers(mut self, name: &str, values: &[i64]) -> Self {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(name, &[values.len() as u64], 7, &raw);
        self
    }

    fn constant(&mut self, name: &str, dims: &[u64], kind: u64, raw: &[u8]) {
        let dims: Vec<u8> = dims.iter().flat_map(|d| number(1, *d)).collect();
        let tensor = [dims, number(2, kind), bytes(8, name), bytes(9, raw)].concat();
        self.rest.extend(bytes(5, tensor));
    }

    pub(crate) fn node(
        mut self,
        operator: &str,
        inputs: &[&str],
        output: &str,
        attributes: &[Vec<u8>],
    ) -> Self {
        let inputs: Vec<u8> = inputs.iter().flat_map(|name| bytes(1, name)).collect();
        let attributes: Vec<u8> = attributes.iter().flat_map(|a| bytes(5, a)).collect();
        let node = [
            inputs,
            bytes(2, output),
            bytes(3, output),
            bytes(4, operator),
            attributes,
        ];
        self.nodes.extend(bytes(1, node.concat()));
        self
    }

    /// The file.
    pub(crate) fn file(&self) -> Vec<u8> {
        let graph = [self.nodes.clone(), bytes(2, "test"), self.rest.clone()].concat();
        let operators = [bytes(1, ""), number(2, 17)].concat();
        [number(1, 8), bytes(7, graph), bytes(8, operators)].concat()
    }
}

/// Inputs and output of a segmenter of pictures `[H, W]` and `P` prompts.
pub(crate) fn segmenter([h, w]: [Axis; 2], p: Axis) -> Graph {
    Graph::default()
        .input("image", FLOAT, &[Axis::Is(1), Axis::Is(3), h, w])
        .input("points", FLOAT, &[Axis::Is(1), p, Axis::Is(2)])
        .input("labels", FLOAT, &[Axis::Is(1), p])
        .output("mask", FLOAT, &[Axis::Is(1), Axis::Is(1), h, w])
}

/// Rope is what is redder than blue; prompts count nothing.
pub(crate) fn by_colour(size: [Axis; 2]) -> Graph {
    segmenter(size, Axis::Open("P"))
        .floats("weight", &[1, 3, 1, 1], &[1.0, 0.0, -1.0])
        .floats("bias", &[1], &[-0.2])
        .floats("nothing", &[], &[0.0])
        .node(
            "Conv",
            &["image", "weight", "bias"],
            "colour",
            &[ints("kernel_shape", &[1, 1])],
        )
        .node("ReduceSum", &["points"], "p", &[int("keepdims", 0)])
        .node("ReduceSum", &["labels"], "l", &[int("keepdims", 0)])
        .node("Add", &["p", "l"], "sum", &[])
        .node("Mul", &["sum", "nothing"], "zero", &[])
        .node("Add", &["colour", "zero"], "mask", &[])
}
