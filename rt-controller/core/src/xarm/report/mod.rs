//! Frames that the controller pushes on its report ports.
//!
//! | port | type | rate (Hz) | size (bytes) |
//! |---|---|---|---|
//! | 30000 | [`RealtimeReport`] | 250 | 784 to 804 |
//! | 30001 | [`NormalReport`] | 5 | 145 |
//! | 30002 | [`RichReport`] | 5 | 574 or 587 |
//! | 30003 | [`ForceReport`] | 100 | 135 (87 without force-torque firmware) |
//!
//! Only fields that this system uses have names; the others are written as
//! zero and skipped when read. Values are f32 on the wire, little-endian;
//! sizes and integers big-endian.

mod periodic;
mod realtime;

pub use periodic::{
    BasicReport, FORCE_REPORT_LEN, ForceReport, NORMAL_REPORT_LEN, NormalReport, RICH_REPORT_LEN,
    RichReport,
};
pub use realtime::{REALTIME_REPORT_LEN, RealtimeReport};

use super::bytes::{ByteReader, ByteWriter, EmitError, Fields};
use super::status::{ArmState, Mode};

/// Longest report frame.
pub const MAX_REPORT_LEN: usize = 804;

/// A report is shorter than its kind needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("report of {given} bytes, needed are {needed}; is this the right report port?")]
pub struct ReportTooShort {
    /// Bytes found.
    pub given: usize,
    /// Bytes the kind has at least.
    pub needed: usize,
}

/// The size of the frame, which it begins with; not looked at when read.
fn size_field(wire: &mut impl Fields, size: usize) {
    wire.u32_be(&mut u32::try_from(size).unwrap_or(u32::MAX));
}

/// The byte that holds state (low nibble) and mode (high nibble).
fn state_field(wire: &mut impl Fields, state: &mut ArmState, mode: &mut Mode) {
    let mut byte = (state.code() & 0x0F) | (mode.code() << 4);
    wire.u8(&mut byte);
    (*state, *mode) = (ArmState::from_code(byte & 0x0F), Mode::from_code(byte >> 4));
}

/// Writes the `fields` of a report to the front of `out`; returns their length.
fn emit<T: Clone>(
    report: &T,
    out: &mut [u8],
    fields: impl FnOnce(&mut T, &mut ByteWriter<'_>),
) -> Result<usize, EmitError> {
    let mut writer = ByteWriter::new(out);
    fields(&mut report.clone(), &mut writer);
    writer.finish()
}

/// Reads the `fields` of a report from a frame of at least `needed` bytes.
fn parse<T: Default>(
    frame: &[u8],
    needed: usize,
    fields: impl FnOnce(&mut T, &mut ByteReader<'_>),
) -> Result<T, ReportTooShort> {
    let given = frame.len();
    if given < needed {
        return Err(ReportTooShort { given, needed });
    }
    let mut report = T::default();
    fields(&mut report, &mut ByteReader::new(frame));
    Ok(report)
}

#[cfg(test)]
mod tests;
