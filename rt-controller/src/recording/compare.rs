//! Cycle and cause records field by field, bit by bit.

use shared_types::ipc::{CauseRecord, CycleRecord, LimitBroken, RunCounts};

/// One number of a record.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    name: &'static str,
    /// Joint, 1-based, of a number that each joint has.
    joint: Option<usize>,
    number: Number,
}

#[derive(Debug, Clone, Copy)]
enum Number {
    Whole(u64),
    Real(f64),
}

impl Number {
    /// Bits, not values: NaN equals itself, and the two zeros differ.
    const fn bits(self) -> u64 {
        match self {
            Self::Whole(value) => value,
            Self::Real(value) => value.to_bits(),
        }
    }

    fn show(self) -> String {
        match self {
            Self::Whole(value) => value.to_string(),
            Self::Real(value) => format!("{value:?}"),
        }
    }
}

/// Two values that should be the same.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Unequal {
    /// Name of the field.
    pub field: String,
    /// Value in the recording.
    pub recorded: String,
    /// Value now.
    pub replayed: String,
    /// Bytes that differ, of this and all later fields.
    pub bytes: u32,
}

/// The first field in which two rows of fields differ, and how many bytes do.
#[must_use]
pub fn first_unequal(recorded: &[Field], replayed: &[Field]) -> Option<Unequal> {
    let mut first: Option<Unequal> = None;
    for (a, b) in recorded.iter().zip(replayed) {
        let different = a.number.bits() ^ b.number.bits();
        let bytes = different.to_le_bytes().map(|d| u32::from(d != 0));
        let bytes: u32 = bytes.iter().sum();
        if bytes > 0 {
            first
                .get_or_insert_with(|| Unequal {
                    field: a
                        .joint
                        .map_or(a.name.to_owned(), |j| format!("{}[{j}]", a.name)),
                    recorded: a.number.show(),
                    replayed: b.number.show(),
                    bytes: 0,
                })
                .bytes += bytes;
        }
    }
    first
}

/// Collects fields.
#[derive(Debug, Default)]
struct Fields(Vec<Field>);

impl Fields {
    fn add(&mut self, name: &'static str, joint: Option<usize>, number: Number) {
        self.0.push(Field {
            name,
            joint,
            number,
        });
    }

    fn whole(&mut self, name: &'static str, value: impl Into<u64>) {
        self.add(name, None, Number::Whole(value.into()));
    }

    fn real(&mut self, name: &'static str, value: f64) {
        self.add(name, None, Number::Real(value));
    }

    fn joints(&mut self, name: &'static str, values: arm_model::JointVector) {
        for (j, value) in values.iter().enumerate() {
            self.add(name, Some(j + 1), Number::Real(*value));
        }
    }
}

/// Adds every field of a record that is not left out. Each one is named, so that a new
/// field cannot be forgotten here.
macro_rules! add_fields {
    ($fields:ident, $prefix:literal, $record:expr, $Record:ident { $($name:ident: $kind:ident),+ } but { $($out:ident),* }) => {
        let $Record { $($name,)+ $($out: _),* } = $record;
        $($fields.$kind(concat!($prefix, stringify!($name)), *$name);)+
    };
}

/// Every number of a cycle's record that the core decides. Left out are the
/// four the loop fills in afterwards: three timings and the count of losses.
#[must_use]
pub fn cycle_fields(record: &CycleRecord) -> Vec<Field> {
    let mut fields = Fields::default();
    add_fields!(fields, "", record, CycleRecord {
        version: whole, mode: whole, sent: whole, fault: whole, cycle: whole, deadline_ns: whole,
        reply_ns: whole, missed: whole, trajectory_s: real, q_c: joints, q: joints,
        q_stamp_ns: whole, speed_override: real, qd_sent: joints
    } but { wake_late_ns, compute_ns, send_ns, dropped });
    fields.0
}

/// Every number of a cause.
#[must_use]
pub fn cause_fields(cause: &CauseRecord) -> Vec<Field> {
    let mut fields = Fields::default();
    add_fields!(fields, "cause.", cause, CauseRecord {
        version: whole, code: whole, arm_error: whole, arm_warning: whole, mode: whole,
        path: whole, stop_arm: whole, operating_mode: whole, second_code: whole, cycle: whole,
        stamp_ns: whole, rest_cycle: whole, motion_id: whole, trajectory_s: real
    } but { reserved, limit, counts });
    add_fields!(fields, "cause.limit.", &cause.limit, LimitBroken {
        joint: whole, value: real, limit: real
    } but { reserved });
    add_fields!(fields, "cause.counts.", &cause.counts, RunCounts {
        missed: whole, duplicates: whole, out_of_order: whole, skipped: whole,
        broken_reports: whole, clock_resyncs: whole, warnings: whole
    } but { reserved });
    fields.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_field_and_all_bytes_are_named() {
        let a = CycleRecord {
            missed: 1,
            ..CycleRecord::default()
        };
        let unequal = |b: &CycleRecord| first_unequal(&cycle_fields(&a), &cycle_fields(b));
        let mut b = a;
        b.compute_ns = 5;
        assert_eq!(unequal(&b), None, "timings are not the core's");
        b.missed = 0x0102_0304;
        b.q_c.0[2] = -0.0;
        let found = unequal(&b).unwrap();
        assert_eq!((found.field.as_str(), found.bytes), ("missed", 5));
        b.missed = 1;
        let found = unequal(&b).unwrap();
        assert_eq!(found.field, "q_c[3]");
        assert_eq!(
            (found.recorded.as_str(), found.replayed.as_str()),
            ("0.0", "-0.0")
        );
    }

    #[test]
    fn every_byte_of_a_record_is_compared() {
        assert_eq!(cycle_fields(&CycleRecord::default()).len(), 11 + 21);
        assert_eq!(cause_fields(&CauseRecord::default()).len(), 24);
    }
}
