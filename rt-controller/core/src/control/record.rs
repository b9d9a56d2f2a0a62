//! Inputs as plain data and back: what a recorded cycle is stepped again with.
//!
//! [`record_input`] loses nothing that [`ControlState::step`] looks at, so the
//! restored input leads to the same output, bit for bit.
//!
//! [`ControlState::step`]: super::ControlState::step

use super::exchange::{ArmCodes, CycleInput, LinkInput, Order};
use super::motion::Motion;
use crate::xarm::Status;
use alloc::boxed::Box;
use shared_types::ipc::{
    ArmCodesRecord, InputRecord, LinkRecord, OrderKind, OrderRecord, PAYLOAD_VERSION,
};
use shared_types::{Arming, MotionTier};

const REPLIED: u8 = 1;
const LOST: u8 = 2;

/// Why a recorded input cannot be stepped again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Another layout.
    #[error("cycle {cycle} was recorded in layout {found}, this program reads {PAYLOAD_VERSION}")]
    Version {
        /// Cycle.
        cycle: u64,
        /// Layout found.
        found: u32,
    },
    /// A number that stands for no order.
    #[error("cycle {cycle} holds the unknown order {kind} (tier {tier}); the record is damaged")]
    Order {
        /// Cycle.
        cycle: u64,
        /// Kind found.
        kind: u8,
        /// Tier found.
        tier: u8,
    },
    /// The motion was not stored.
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

/// What cycle number `cycle` was told, as plain data. RT-safe.
#[must_use]
pub fn record_input(input: &CycleInput, cycle: u64) -> InputRecord {
    InputRecord {
        version: PAYLOAD_VERSION,
        missed: input.missed,
        cycle,
        deadline_ns: input.deadline_ns,
        broken_reports: input.broken_reports,
        late_ns: input.late_ns,
        order: input
            .order
            .as_ref()
            .map_or_else(OrderRecord::default, record_order),
        operator: input.operator,
        guardian: input.guardian,
        link: record_link(&input.link),
        codes: input
            .codes
            .map_or_else(ArmCodesRecord::default, record_codes),
        reports: input.reports,
    }
}

fn record_order(order: &Order) -> OrderRecord {
    let of = |kind: OrderKind| OrderRecord {
        kind: kind as u8,
        ..OrderRecord::default()
    };
    match order {
        Order::Adopt { hold } => OrderRecord {
            hold: *hold,
            ..of(OrderKind::Adopt)
        },
        Order::Run { id, motion } => OrderRecord {
            motion_id: *id,
            motion_hash: motion.fingerprint(),
            ..of(OrderKind::Run)
        },
        Order::Stop => of(OrderKind::Stop),
        Order::Arm(arming) => OrderRecord {
            tier: arming.tier as u8,
            area_clear: u8::from(arming.area_clear),
            expires_ns: arming.expires_ns,
            ..of(OrderKind::Arm)
        },
        Order::Disarm => of(OrderKind::Disarm),
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
///
/// # Errors
/// [`RestoreError`].
pub fn restore_input(
    record: &InputRecord,
    motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
) -> Result<CycleInput, RestoreError> {
    if record.version != PAYLOAD_VERSION {
        return Err(RestoreError::Version {
            cycle: record.cycle,
            found: record.version,
        });
    }
    let link = &record.link;
    Ok(CycleInput {
        deadline_ns: record.deadline_ns,
        missed: record.missed,
        late_ns: record.late_ns,
        order: restore_order(record, motion_of)?,
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

fn restore_order(
    record: &InputRecord,
    motion_of: impl FnOnce(u64, u64) -> Option<Box<Motion>>,
) -> Result<Option<Order>, RestoreError> {
    let order = &record.order;
    let unknown = RestoreError::Order {
        cycle: record.cycle,
        kind: order.kind,
        tier: order.tier,
    };
    Ok(Some(
        match OrderKind::from_raw(order.kind).ok_or(unknown)? {
            OrderKind::None => return Ok(None),
            OrderKind::Adopt => Order::Adopt { hold: order.hold },
            OrderKind::Run => {
                let (id, hash) = (order.motion_id, order.motion_hash);
                let motion = motion_of(id, hash).ok_or(RestoreError::Motion {
                    cycle: record.cycle,
                    id,
                    hash,
                })?;
                Order::Run { id, motion }
            }
            OrderKind::Stop => Order::Stop,
            OrderKind::Arm => Order::Arm(Arming {
                tier: MotionTier::from_raw(order.tier).ok_or(unknown)?,
                expires_ns: order.expires_ns,
                area_clear: order.area_clear != 0,
            }),
            OrderKind::Disarm => Order::Disarm,
        },
    ))
}
