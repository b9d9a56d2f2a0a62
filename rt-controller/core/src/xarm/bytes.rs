//! Checked cursors over byte slices, in the byte orders of this protocol.

use arm_model::{JOINTS, JointVector};

/// Why a frame could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EmitError {
    /// The slice given is too short for the frame.
    #[error("buffer of {given} bytes is too small for the frame; give at least {needed}")]
    BufferTooSmall {
        /// Bytes needed up to the field that did not fit.
        needed: usize,
        /// Bytes given.
        given: usize,
    },
}

/// Millimetres in a metre; the wire's lengths are in mm.
const MM_PER_M: f64 = 1e3;

/// Writes fields one after the other, never past the end of its slice.
pub(super) struct ByteWriter<'a> {
    out: &'a mut [u8],
    len: usize,
}

impl<'a> ByteWriter<'a> {
    pub(super) fn new(out: &'a mut [u8]) -> Self {
        Self { out, len: 0 }
    }

    /// Bytes written so far.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn bytes(&mut self, field: &[u8]) -> Result<(), EmitError> {
        let given = self.out.len();
        let end = self.len.saturating_add(field.len());
        self.out
            .get_mut(self.len..end)
            .ok_or(EmitError::BufferTooSmall { needed: end, given })?
            .copy_from_slice(field);
        self.len = end;
        Ok(())
    }

    /// Zeros up to the absolute offset `end`; nothing if already there.
    pub(super) fn zeros_to(&mut self, end: usize) -> Result<(), EmitError> {
        let given = self.out.len();
        let end = end.max(self.len);
        self.out
            .get_mut(self.len..end)
            .ok_or(EmitError::BufferTooSmall { needed: end, given })?
            .fill(0);
        self.len = end;
        Ok(())
    }

    pub(super) fn u8(&mut self, value: u8) -> Result<(), EmitError> {
        self.bytes(&[value])
    }

    pub(super) fn u16_be(&mut self, value: u16) -> Result<(), EmitError> {
        self.bytes(&value.to_be_bytes())
    }

    pub(super) fn u32_be(&mut self, value: u32) -> Result<(), EmitError> {
        self.bytes(&value.to_be_bytes())
    }

    pub(super) fn u64_be(&mut self, value: u64) -> Result<(), EmitError> {
        self.bytes(&value.to_be_bytes())
    }

    /// An f32 of the wire; more digits than it holds are rounded away.
    pub(super) fn f32_le(&mut self, value: f64) -> Result<(), EmitError> {
        self.bytes(&(value as f32).to_le_bytes())
    }

    pub(super) fn f32s_le(&mut self, values: &[f64]) -> Result<(), EmitError> {
        values.iter().try_for_each(|v| self.f32_le(*v))
    }

    /// A length (m), in mm on the wire.
    pub(super) fn length(&mut self, value_m: f64) -> Result<(), EmitError> {
        self.f32_le(value_m * MM_PER_M)
    }

    pub(super) fn joints(&mut self, value: &JointVector) -> Result<(), EmitError> {
        self.f32s_le(&value.0)
    }
}

/// Reads fields one after the other; `None` past the end.
pub(super) struct ByteReader<'a> {
    rest: &'a [u8],
}

impl<'a> ByteReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Starts at an absolute offset of `bytes`.
    pub(super) fn at(bytes: &'a [u8], offset: usize) -> Option<Self> {
        bytes.get(offset..).map(Self::new)
    }

    /// Bytes not read yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    pub(super) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*head)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    pub(super) fn u16_be(&mut self) -> Option<u16> {
        self.array().map(u16::from_be_bytes)
    }

    pub(super) fn u32_be(&mut self) -> Option<u32> {
        self.array().map(u32::from_be_bytes)
    }

    pub(super) fn u64_be(&mut self) -> Option<u64> {
        self.array().map(u64::from_be_bytes)
    }

    pub(super) fn f32_le(&mut self) -> Option<f64> {
        self.array().map(|b| f64::from(f32::from_le_bytes(b)))
    }

    pub(super) fn f32s_le<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f32_le()?;
        }
        Some(values)
    }

    /// A length (m) from mm on the wire.
    pub(super) fn length(&mut self) -> Option<f64> {
        self.f32_le().map(|mm| mm / MM_PER_M)
    }

    pub(super) fn joints(&mut self) -> Option<JointVector> {
        self.f32s_le::<JOINTS>().map(JointVector)
    }
}
