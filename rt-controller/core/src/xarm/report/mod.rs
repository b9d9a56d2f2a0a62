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

/// The two directions of a report that has at least `$least` bytes, from its `fields`.
macro_rules! both_directions {
    ($Report:ident, $least:expr) => {
        impl $Report {
            /// Writes the report to the front of `out` and returns its length.
            pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
                let (mut report, mut wire) = (*self, ByteWriter::new(out));
                report.fields(&mut wire);
                wire.finish()
            }

            /// Reads a frame; one of a later firmware may have more bytes. RT-safe.
            pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
                let (given, needed) = (frame.len(), $least);
                if given < needed {
                    return Err(ReportTooShort { given, needed });
                }
                let mut report = Self::default();
                report.fields(&mut ByteReader::new(frame));
                Ok(report)
            }
        }
    };
}

mod periodic;
mod realtime;

pub use periodic::{
    BasicReport, FORCE_REPORT_LEN, ForceReport, NORMAL_REPORT_LEN, NormalReport, RICH_REPORT_LEN,
    RichReport,
};
pub use realtime::{REALTIME_REPORT_LEN, RealtimeReport};

use super::bytes::Fields;
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

#[cfg(test)]
mod tests;
