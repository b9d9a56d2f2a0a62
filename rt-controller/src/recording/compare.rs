//! Cycle and cause records field by field, bit by bit.

use shared_types::ipc::{CauseRecord, CycleRecord};

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

    fn joints(&mut self, name: &'static str, values: &arm_model::JointVector) {
        for (j, value) in values.iter().enumerate() {
            self.add(name, Some(j + 1), Number::Real(*value));
        }
    }
}

/// Every number of a cycle's record that the core decides. Left out are the
/// four the loop fills in afterwards: three timings and the count of losses.
#[must_use]
pub fn cycle_fields(record: &CycleRecord) -> Vec<Field> {
    // Named one by one, so that a new field cannot be forgotten here.
    let CycleRecord {
        version,
        mode,
        sent,
        fault,
        cycle,
        deadline_ns,
        wake_late_ns: _,
        compute_ns: _,
        send_ns: _,
        reply_ns,
        missed,
        dropped: _,
        trajectory_s,
        q_c,
        q,
        q_stamp_ns,
        speed_override,
        qd_sent,
    } = record;
    let mut fields = Fields::default();
    fields.whole("version", *version);
    fields.whole("mode", *mode);
    fields.whole("sent", *sent);
    fields.whole("fault", *fault);
    fields.whole("cycle", *cycle);
    fields.whole("deadline_ns", *deadline_ns);
    fields.whole("reply_ns", *reply_ns);
    fields.whole("missed", *missed);
    fields.real("trajectory_s", *trajectory_s);
    fields.joints("q_c", q_c);
    fields.joints("q", q);
    fields.whole("q_stamp_ns", *q_stamp_ns);
    fields.real("speed_override", *speed_override);
    fields.joints("qd_sent", qd_sent);
    fields.0
}

/// Every number of a cause.
#[must_use]
pub fn cause_fields(cause: &CauseRecord) -> Vec<Field> {
    let CauseRecord {
        version,
        code,
        arm_error,
        arm_warning,
        mode,
        path,
        stop_arm,
        operating_mode,
        second_code,
        reserved: _,
        cycle,
        stamp_ns,
        rest_cycle,
        motion_id,
        trajectory_s,
        limit,
        counts,
    } = cause;
    let mut fields = Fields::default();
    fields.whole("cause.version", *version);
    fields.whole("cause.code", *code);
    fields.whole("cause.arm_error", *arm_error);
    fields.whole("cause.arm_warning", *arm_warning);
    fields.whole("cause.mode", *mode);
    fields.whole("cause.path", *path);
    fields.whole("cause.stop_arm", *stop_arm);
    fields.whole("cause.operating_mode", *operating_mode);
    fields.whole("cause.second_code", *second_code);
    fields.whole("cause.cycle", *cycle);
    fields.whole("cause.stamp_ns", *stamp_ns);
    fields.whole("cause.rest_cycle", *rest_cycle);
    fields.whole("cause.motion_id", *motion_id);
    fields.real("cause.trajectory_s", *trajectory_s);
    fields.whole("cause.limit.joint", limit.joint);
    fields.real("cause.limit.value", limit.value);
    fields.real("cause.limit.limit", limit.limit);
    fields.whole("cause.counts.missed", counts.missed);
    fields.whole("cause.counts.duplicates", counts.duplicates);
    fields.whole("cause.counts.out_of_order", counts.out_of_order);
    fields.whole("cause.counts.skipped", counts.skipped);
    fields.whole("cause.counts.broken_reports", counts.broken_reports);
    fields.whole("cause.counts.clock_resyncs", counts.clock_resyncs);
    fields.whole("cause.counts.warnings", counts.warnings);
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
