//! What is read of an ONNX file: its graph's bytes, the weights in them, its metadata.
//!
//! An ONNX file is one Protocol Buffers message; each field is a number that says
//! what follows, and the field's bytes.

use std::collections::BTreeMap;

/// Field of the graph in an ONNX model.
const GRAPH: u64 = 7;
/// Field of one entry of the metadata.
const METADATA: u64 = 14;

/// Field of one tensor of weights (`initializer`) in a graph.
const INITIALIZER: u64 = 5;
/// Field of a tensor's name.
const NAME: u64 = 8;
/// Field of a tensor's numbers, little-endian.
const RAW_DATA: u64 = 9;

/// What was found in a file.
#[derive(Debug, Default)]
pub(super) struct Parts<'a> {
    /// The graph's bytes, with all weights.
    pub(super) graph: Option<&'a [u8]>,
    /// Key and value of each entry of the metadata.
    pub(super) metadata: Vec<(&'a str, &'a str)>,
}

/// A file that is not made of such fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NotFields;

/// Finds the parts of a model file.
pub(super) fn parts(bytes: &[u8]) -> Result<Parts<'_>, NotFields> {
    let mut parts = Parts::default();
    for field in fields(bytes)? {
        match field {
            (GRAPH, content) => parts.graph = Some(content),
            (METADATA, content) => {
                let entry = fields(content)?;
                let text = |number| {
                    let found = entry.iter().find(|(n, _)| *n == number);
                    found.and_then(|(_, text)| core::str::from_utf8(text).ok())
                };
                parts
                    .metadata
                    .push((text(1).ok_or(NotFields)?, text(2).ok_or(NotFields)?));
            }
            _ => {}
        }
    }
    Ok(parts)
}

/// A graph's weights by name: the numbers of each tensor, its last axis first to change.
pub(super) fn weights(graph: &[u8]) -> Result<BTreeMap<&str, Vec<f32>>, NotFields> {
    let mut weights = BTreeMap::new();
    for (_, tensor) in fields(graph)?
        .into_iter()
        .filter(|(n, _)| *n == INITIALIZER)
    {
        let tensor = fields(tensor)?;
        let content = |number| {
            let found = tensor.iter().find(|(n, _)| *n == number);
            found.map(|(_, content)| *content).ok_or(NotFields)
        };
        let name = core::str::from_utf8(content(NAME)?).ok().ok_or(NotFields)?;
        let (numbers, _) = content(RAW_DATA)?.as_chunks();
        weights.insert(
            name,
            numbers.iter().map(|x| f32::from_le_bytes(*x)).collect(),
        );
    }
    Ok(weights)
}

/// Number and content of each field of a message that has a length; fields of
/// plain numbers are skipped.
fn fields(mut bytes: &[u8]) -> Result<Vec<(u64, &[u8])>, NotFields> {
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let (tag, rest) = varint(bytes)?;
        let skipped = match tag & 7 {
            0 => varint(rest)?.1,
            1 => rest.get(8..).ok_or(NotFields)?,
            2 => {
                let (length, rest) = varint(rest)?;
                let length = usize::try_from(length).ok().ok_or(NotFields)?;
                let (content, rest) = rest.split_at_checked(length).ok_or(NotFields)?;
                found.push((tag >> 3, content));
                rest
            }
            5 => rest.get(4..).ok_or(NotFields)?,
            _ => return Err(NotFields),
        };
        bytes = skipped;
    }
    Ok(found)
}

/// A number of seven bits per byte, the lowest first, and what follows it.
fn varint(bytes: &[u8]) -> Result<(u64, &[u8]), NotFields> {
    let mut number = 0;
    for (i, byte) in bytes.iter().take(10).enumerate() {
        number |= u64::from(byte & 0x7f)
            .checked_shl(7 * i as u32)
            .unwrap_or(0);
        if byte & 0x80 == 0 {
            return Ok((number, &bytes[i + 1..]));
        }
    }
    Err(NotFields)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Version 9, graph `abc`, metadata `k` = `v`.
    const SMALL: &[u8] = &[
        0x08, 9, 0x3a, 3, b'a', b'b', b'c', 0x72, 6, 0x0a, 1, b'k', 0x12, 1, b'v',
    ];

    #[test]
    fn graph_and_metadata_are_found() {
        let parts = parts(SMALL).unwrap();
        assert_eq!(parts.graph, Some(&b"abc"[..]));
        assert_eq!(parts.metadata, [("k", "v")]);
    }

    #[test]
    fn weights_are_found_by_name() {
        let graph = [0x2a, 9, 0x42, 1, b'w', 0x4a, 4, 0, 0, 0x80, 0x3f];
        assert_eq!(weights(&graph).unwrap()["w"], [1.0]);
        assert!(weights(&graph[..8]).is_err());
    }

    #[test]
    fn anything_cut_or_changed_is_refused_or_read_without_panic() {
        for end in 0..SMALL.len() {
            let _ = parts(&SMALL[..end]);
            for bit in 0..8 {
                let mut changed = SMALL.to_vec();
                changed[end] ^= 1 << bit;
                let _ = parts(&changed);
            }
        }
        assert!(parts(&SMALL[..6]).is_err());
        assert!(parts(b"no model").is_err());
        assert!(parts(&[0xff; 20]).is_err());
    }
}
