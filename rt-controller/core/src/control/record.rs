//! Inputs as plain data and back: what a recorded cycle is stepped again with.
//!
//! [`record_input`] loses nothing that [`ControlState::step`] looks at, so the
//! restored input leads to the same output, bit for bit.
//!
//! [`ControlState::step`]: super::ControlState::step

use super::exchange::{ArmCodes, ControlCommand, CycleInput, LinkInput};
use super::motion::Motion;
use crate::xarm::Status;
use alloc::boxed::Box;
use shared_types::ipc::{
    ArmCodesRecord, CommandKind, CommandRecord, InputRecord, LinkRecord, PAYLOAD_VERSION,
};
use shared_types::{Arming, OperatingMode};

const REPLIED: u8 = 1;
const LOST: u8 = 2;

/// Why a recorded input cannot be stepped again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// A cycle of another layout.
    #[error("cycle {0} was recorded in layout {1}, this program reads {PAYLOAD_VERSION}")]
    Version(u64, u32),
    /// A number that stands for no command.
    #[error(
        "cycle {cycle} holds the unknown command {kind} (operating mode {operating_mode}); the record is damaged"
    )]
    Command {
        /// Cycle.
        cycle: u64,
        /// Kind found.
        kind: u8,
        /// Operating mode found.
        operating_mode: u8,
    },
    /// The motion of this number and fingerprint was not stored.
    #[error("motion {id} (fingerprint {hash:016x}) of cycle {cycle} was not recorded")]
    Motion {
        /// Cycle.
        cycle: u64,
        /// Number of the motion.
        id: u64,
        /// Its fingerprint.
        hash: u64,
    },
}

/// The inputs of cycle number `cycle`, as plain data. RT-safe.
#[must_use]
pub fn record_input(input: &CycleInput, cycle: u64) -> InputRecord {
    InputRecord {
        version: PAYLOAD_VERSION,
        missed: input.missed,
        cycle,
        deadline_ns: input.deadline_ns,
        broken_reports: input.broken_reports,
        late_ns: input.late_ns,
        command: input
            .command
            .as_ref()
            .map_or_else(CommandRecord::default, record_command),
        operator: input.operator,
        guardian: input.guardian,
        link: record_link(&input.link),
        codes: input
            .codes
            .map_or_else(ArmCodesRecord::default, record_codes),
        reports: input.reports,
    }
}

fn record_command(command: &ControlCommand) -> CommandRecord {
    let of = |kind: CommandKind| CommandRecord {
        kind: kind as u8,
        ..CommandRecord::default()
    };
    match command {
        ControlCommand::Engage { hold } => CommandRecord {
            hold: *hold,
            ..of(CommandKind::Engage)
        },
        ControlCommand::Run { id, motion } => CommandRecord {
            motion_id: *id,
            motion_hash: motion.fingerprint(),
            ..of(CommandKind::Run)
        },
        ControlCommand::Stop => of(CommandKind::Stop),
        ControlCommand::Arm(arming) => CommandRecord {
            operating_mode: arming.operating_mode as u8,
            area_clear: u8::from(arming.area_clear),
            expires_ns: arming.expires_ns,
            ..of(CommandKind::Arm)
        },
        ControlCommand::Disarm => of(CommandKind::Disarm),
    }
}

const fn record_link(link: &LinkInput) -> LinkRecord {
    let (status, replied) = match link.status {
        Some(Status(bits)) => (bits, REPLIED),
        None => (0, 0),
    };
    LinkRecord {
        unanswered_ns: link.unanswered_ns,
        reply_ns: link.reply_ns,
        unanswered: link.unanswered,
        duplicates: link.duplicates,
        out_of_order: link.out_of_order,
        foreign: link.foreign,
        skipped: link.skipped,
        status,
        flags: replied | if link.lost { LOST } else { 0 },
    }
}

fn record_codes(codes: ArmCodes) -> ArmCodesRecord {
    ArmCodesRecord {
        present: 1,
        error: codes.error,
        warning: codes.warning,
        state: codes.state,
        mode: codes.mode,
        reserved: [0; 3],
        arrival_ns: codes.arrival_ns,
    }
}

/// The input of a recorded cycle; `motion_of` finds stored motions by number
/// and fingerprint.
pub fn restore_input(
    record: &InputRecord,
    motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
) -> Result<CycleInput, RestoreError> {
    if record.version != PAYLOAD_VERSION {
        return Err(RestoreError::Version(record.cycle, record.version));
    }
    let link = &record.link;
    Ok(CycleInput {
        deadline_ns: record.deadline_ns,
        missed: record.missed,
        late_ns: record.late_ns,
        command: restore_command(record, motion_of)?,
        operator: record.operator,
        guardian: record.guardian,
        link: LinkInput {
            status: (link.flags & REPLIED != 0).then_some(Status(link.status)),
            reply_ns: link.reply_ns,
            unanswered_ns: link.unanswered_ns,
            unanswered: link.unanswered,
            duplicates: link.duplicates,
            out_of_order: link.out_of_order,
            foreign: link.foreign,
            skipped: link.skipped,
            lost: link.flags & LOST != 0,
        },
        codes: (record.codes.present != 0).then_some(ArmCodes {
            error: record.codes.error,
            warning: record.codes.warning,
            state: record.codes.state,
            mode: record.codes.mode,
            arrival_ns: record.codes.arrival_ns,
        }),
        reports: record.reports,
        broken_reports: record.broken_reports,
    })
}

fn restore_command(
    record: &InputRecord,
    motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
) -> Result<Option<ControlCommand>, RestoreError> {
    let command = &record.command;
    let unknown = RestoreError::Command {
        cycle: record.cycle,
        kind: command.kind,
        operating_mode: command.operating_mode,
    };
    Ok(Some(
        match CommandKind::from_raw(command.kind).ok_or(unknown)? {
            CommandKind::None => return Ok(None),
            CommandKind::Engage => ControlCommand::Engage { hold: command.hold },
            CommandKind::Run => {
                let (id, hash) = (command.motion_id, command.motion_hash);
                let cycle = record.cycle;
                let missing = RestoreError::Motion { cycle, id, hash };
                let motion = motion_of(id, hash).ok_or(missing)?;
                ControlCommand::Run { id, motion }
            }
            CommandKind::Stop => ControlCommand::Stop,
            CommandKind::Arm => ControlCommand::Arm(Arming {
                operating_mode: OperatingMode::from_raw(command.operating_mode).ok_or(unknown)?,
                expires_ns: command.expires_ns,
                area_clear: command.area_clear != 0,
            }),
            CommandKind::Disarm => ControlCommand::Disarm,
        },
    ))
}
