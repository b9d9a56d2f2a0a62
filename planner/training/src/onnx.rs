//! The part of the ONNX file format that Φ-NN needs, written field by field as the
//! published `onnx.proto` numbers them; `planner::phi` reads it.

/// `TensorProto.DataType`.
pub(crate) const FLOAT: u64 = 1;
pub(crate) const INT64: u64 = 7;

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

/// A field of bytes: text, another message, or numbers one after the other.
fn bytes(field: u64, content: impl AsRef<[u8]>) -> Vec<u8> {
    let content = content.as_ref();
    let head = [varint(field << 3 | 2), varint(content.len() as u64)].concat();
    [&head, content].concat()
}

fn texts(field: u64, texts: &[&str]) -> Vec<u8> {
    texts.iter().flat_map(|text| bytes(field, text)).collect()
}

fn numbers(field: u64, numbers: &[i64]) -> Vec<u8> {
    let all: Vec<u8> = numbers.iter().flat_map(|n| varint(*n as u64)).collect();
    bytes(field, all)
}

/// An attribute of a node: `float`, `int` or `ints`.
pub(crate) fn float(name: &str, value: f32) -> Vec<u8> {
    let value = [&varint(2 << 3 | 5)[..], &value.to_le_bytes()].concat();
    [bytes(1, name), value, number(20, 1)].concat()
}

pub(crate) fn int(name: &str, value: i64) -> Vec<u8> {
    [bytes(1, name), number(3, value as u64), number(20, 2)].concat()
}

pub(crate) fn ints(name: &str, values: &[i64]) -> Vec<u8> {
    [bytes(1, name), numbers(8, values), number(20, 7)].concat()
}

/// A graph, part by part; each part is a list of fields.
#[derive(Default)]
pub(crate) struct Graph {
    nodes: Vec<Vec<u8>>,
    constants: Vec<u8>,
    inputs: Vec<u8>,
    outputs: Vec<u8>,
}

impl Graph {
    /// Number of nodes so far.
    pub(crate) fn nodes(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn node(&mut self, op: &str, inputs: &[&str], output: &str, attributes: &[Vec<u8>]) {
        let name = format!("{op}_{}", self.nodes.len());
        let attributes: Vec<u8> = attributes.iter().flat_map(|a| bytes(5, a)).collect();
        let (inputs, outputs) = (texts(1, inputs), texts(2, &[output]));
        let node = [inputs, outputs, bytes(3, name), bytes(4, op), attributes];
        self.nodes.push(node.concat());
    }

    pub(crate) fn constant(&mut self, name: &str, kind: u64, dims: &[usize], raw: &[u8]) {
        let dims: Vec<i64> = dims.iter().map(|d| *d as i64).collect();
        let name = bytes(8, name);
        let tensor = [numbers(1, &dims), number(2, kind), name, bytes(9, raw)].concat();
        self.constants.extend(bytes(5, tensor));
    }

    pub(crate) fn input(&mut self, name: &str, sizes: &[usize]) {
        self.inputs.extend(bytes(11, value(name, sizes)));
    }

    pub(crate) fn output(&mut self, name: &str, sizes: &[usize]) {
        self.outputs.extend(bytes(12, value(name, sizes)));
    }

    /// The graph's own bytes.
    pub(crate) fn encode(&self, name: &str) -> Vec<u8> {
        let mut all: Vec<u8> = self.nodes.iter().flat_map(|n| bytes(1, n)).collect();
        all.extend(bytes(2, name));
        [&all[..], &self.constants, &self.inputs, &self.outputs].concat()
    }
}

/// A float tensor with any number of films.
fn value(name: &str, sizes: &[usize]) -> Vec<u8> {
    let mut shape = bytes(1, bytes(2, "n"));
    for size in sizes {
        shape.extend(bytes(1, number(1, *size as u64)));
    }
    let tensor = bytes(1, [number(1, FLOAT), bytes(2, shape)].concat());
    [bytes(1, name), bytes(2, tensor)].concat()
}

/// A model file of a graph, with one entry of metadata.
pub(crate) fn file(graph: &[u8], [key, value]: [&str; 2]) -> Vec<u8> {
    /// Version of the file format that goes with the operators.
    const IR_VERSION: u64 = 9;
    /// ONNX operator set: the first with GELU.
    const OPSET: u64 = 20;
    let entry = [bytes(1, key), bytes(2, value)].concat();
    [
        number(1, IR_VERSION),
        bytes(2, "phi-train"),
        bytes(3, env!("CARGO_PKG_VERSION")),
        bytes(7, graph),
        bytes(8, number(2, OPSET)),
        bytes(14, entry),
    ]
    .concat()
}
