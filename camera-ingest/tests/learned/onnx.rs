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

/// Where a point is seen worse than this, [`steady()`] has it a pixel of its picture too far
/// to the right.
const POORLY: f32 = 0.5;

/// Points move by `shift` a frame (pixels of its picture), whatever is seen; they are
/// seen as well as `visible` says of each frame of a chunk.
pub(crate) fn steady(size: [Axis; 2], n: Axis, shift: [f32; 2], visible: &[f32]) -> Graph {
    let t = visible.len() as u64;
    let moved: Vec<f32> = (0..visible.len())
        .flat_map(|frame| {
            let [x, y] = shift.map(|s| s * frame as f32);
            [x + f32::from(visible[frame] < POORLY), y]
        })
        .collect();
    Graph::default()
        .input(
            "frames",
            FLOAT,
            &[Axis::Is(1), Axis::Is(t), Axis::Is(3), size[0], size[1]],
        )
        .input("queries", FLOAT, &[Axis::Is(1), n, Axis::Is(3)])
        .output("tracks", FLOAT, &[Axis::Is(1), Axis::Is(t), n, Axis::Is(2)])
        .output("visibility", FLOAT, &[Axis::Is(1), Axis::Is(t), n])
        .floats("moved", &[1, t, 1, 2], &moved)
        .floats("shift", &[1, 1, 1, 2], &shift)
        .floats("visible", &[1, t, 1], visible)
        .floats("nothing", &[], &[0.0])
        .integers("axis0", &[0])
        .integers("axis1", &[1])
        .integers("axis2", &[2])
        .integers("axis3", &[3])
        .node(
            "Slice",
            &["queries", "axis0", "axis1", "axis2"],
            "when",
            &[],
        )
        .node(
            "Slice",
            &["queries", "axis1", "axis3", "axis2"],
            "where",
            &[],
        )
        .node("Unsqueeze", &["when", "axis1"], "when4", &[])
        .node("Unsqueeze", &["where", "axis1"], "where4", &[])
        .node("Mul", &["when4", "shift"], "before", &[])
        .node("Sub", &["where4", "before"], "origin", &[])
        .node("ReduceMean", &["frames"], "light", &[int("keepdims", 0)])
        .node("Mul", &["light", "nothing"], "dark", &[])
        .node("Add", &["origin", "moved"], "places", &[])
        .node("Add", &["places", "dark"], "tracks", &[])
        .node("Transpose", &["when"], "flat", &[ints("perm", &[0, 2, 1])])
        .node("Mul", &["flat", "nothing"], "zero", &[])
        .node("Add", &["visible", "zero"], "visibility", &[])
}
