//! The fields of a message, in the byte orders of this protocol.
//!
//! A message lists its [`Fields`] once: a [`ByteWriter`] copies them to the wire, a
//! [`ByteReader`] sets them from there. Neither leaves its slice: both go on to the
//! end and then say whether there was room, or bytes, for all of them.

use arm_model::JointVector;

/// Why a frame could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EmitError {
    /// The slice given is too short for the frame.
    #[error("buffer of {given} bytes is too small for the frame; give at least {needed}")]
    BufferTooSmall {
        /// Bytes of the frame.
        needed: usize,
        /// Bytes given.
        given: usize,
    },
}

/// Millimetres in a metre; the wire's lengths are in mm.
const MM_PER_M: f64 = 1e3;

/// One direction over the fields of a message, in the order of the wire.
pub(super) trait Fields {
    /// A field of plain bytes: written as they are, or set.
    fn array<const N: usize>(&mut self, field: &mut [u8; N]);

    /// Goes on at the absolute offset `end` if that is ahead; what lies between is
    /// written as zeros.
    fn skip_to(&mut self, end: usize);

    /// Whether an optional field of `len` bytes is there: if it is `present` when
    /// written, if as many bytes are left when read.
    fn has(&self, present: bool, len: usize) -> bool;

    fn u8(&mut self, value: &mut u8) {
        let mut bytes = [*value];
        self.array(&mut bytes);
        [*value] = bytes;
    }

    fn flag(&mut self, value: &mut bool) {
        let mut byte = u8::from(*value);
        self.u8(&mut byte);
        *value = byte != 0;
    }

    fn u16_be(&mut self, value: &mut u16) {
        let mut bytes = value.to_be_bytes();
        self.array(&mut bytes);
        *value = u16::from_be_bytes(bytes);
    }

    fn u32_be(&mut self, value: &mut u32) {
        let mut bytes = value.to_be_bytes();
        self.array(&mut bytes);
        *value = u32::from_be_bytes(bytes);
    }

    fn u64_be(&mut self, value: &mut u64) {
        let mut bytes = value.to_be_bytes();
        self.array(&mut bytes);
        *value = u64::from_be_bytes(bytes);
    }

    /// An f32 of the wire; more digits than it holds are rounded away.
    fn f32_le(&mut self, value: &mut f64) {
        let mut bytes = (*value as f32).to_le_bytes();
        self.array(&mut bytes);
        *value = f64::from(f32::from_le_bytes(bytes));
    }

    fn f32s_le(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|v| self.f32_le(v));
    }

    /// A length (m), in mm on the wire.
    fn length(&mut self, value_m: &mut f64) {
        let mut value_mm = *value_m * MM_PER_M;
        self.f32_le(&mut value_mm);
        *value_m = value_mm / MM_PER_M;
    }

    fn lengths(&mut self, values_m: &mut [f64]) {
        values_m.iter_mut().for_each(|v| self.length(v));
    }

    fn joints(&mut self, value: &mut JointVector) {
        self.f32s_le(&mut value.0);
    }
}

/// Writes fields one after the other.
pub(super) struct ByteWriter<'a> {
    out: &'a mut [u8],
    /// Bytes of the fields so far, with those that did not fit.
    len: usize,
}

impl<'a> ByteWriter<'a> {
    pub(super) fn new(out: &'a mut [u8]) -> Self {
        Self { out, len: 0 }
    }

    pub(super) fn bytes(&mut self, field: &[u8]) {
        let end = self.len.saturating_add(field.len());
        if let Some(room) = self.out.get_mut(self.len..end) {
            room.copy_from_slice(field);
        }
        self.len = end;
    }

    /// Bytes written, if all of them fitted.
    pub(super) fn finish(self) -> Result<usize, EmitError> {
        let (needed, given) = (self.len, self.out.len());
        if needed > given {
            return Err(EmitError::BufferTooSmall { needed, given });
        }
        Ok(needed)
    }
}

impl Fields for ByteWriter<'_> {
    fn array<const N: usize>(&mut self, field: &mut [u8; N]) {
        self.bytes(field);
    }

    fn skip_to(&mut self, end: usize) {
        let end = end.max(self.len);
        if let Some(gap) = self.out.get_mut(self.len..end) {
            gap.fill(0);
        }
        self.len = end;
    }

    fn has(&self, present: bool, _len: usize) -> bool {
        present
    }
}

/// Reads fields one after the other; those past the end stay as they were.
pub(super) struct ByteReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> ByteReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Whether every field was there.
    pub(super) fn found_all(&self) -> bool {
        self.at <= self.bytes.len()
    }
}

impl Fields for ByteReader<'_> {
    fn array<const N: usize>(&mut self, field: &mut [u8; N]) {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        if let Some(found) = rest.first_chunk() {
            *field = *found;
        }
        self.at = self.at.saturating_add(N);
    }

    fn skip_to(&mut self, end: usize) {
        self.at = self.at.max(end);
    }

    fn has(&self, _present: bool, len: usize) -> bool {
        self.bytes.len().saturating_sub(self.at) >= len
    }
}
