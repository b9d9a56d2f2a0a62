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

use super::bytes::{ByteReader, ByteWriter, EmitError};
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

/// The byte that holds state (low nibble) and mode (high nibble).
fn emit_state(out: &mut ByteWriter<'_>, state: ArmState, mode: Mode) -> Result<(), EmitError> {
    out.u8((state.code() & 0x0F) | (mode.code() << 4))
}

fn parse_state(bytes: &mut ByteReader<'_>) -> Option<(ArmState, Mode)> {
    let byte = bytes.u8()?;
    Some((ArmState::from_code(byte & 0x0F), Mode::from_code(byte >> 4)))
}

/// Reads a frame of at least `needed` bytes.
fn parse<'a, T>(
    frame: &'a [u8],
    needed: usize,
    read: impl FnOnce(&'a [u8]) -> Option<T>,
) -> Result<T, ReportTooShort> {
    let given = frame.len();
    (given >= needed)
        .then(|| read(frame))
        .flatten()
        .ok_or(ReportTooShort { given, needed })
}

#[cfg(test)]
mod tests;
