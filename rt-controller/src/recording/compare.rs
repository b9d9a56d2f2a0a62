//! Cycle and cause records field by field, bit by bit.

use shared_types::ipc::{CauseRecord, CycleRecord};

/// Longest cycle record in postcard (bytes).
const RECORD_MAX: usize = 512;

/// One number of a record: its name, its bits, how to show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name, as in the record.
    pub name: String,
    /// Its bits, zero-extended.
    pub bits: u64,
    /// For people.
    pub shown: String,
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
        let bytes = (a.bits ^ b.bits)
            .to_le_bytes()
            .into_iter()
            .filter(|d| *d != 0)
            .count();
        if bytes == 0 {
            continue;
        }
        let bytes = u32::try_from(bytes).unwrap_or(u32::MAX);
        first
            .get_or_insert_with(|| Unequal {
                field: a.name.clone(),
                recorded: a.shown.clone(),
                replayed: b.shown.clone(),
                bytes: 0,
            })
            .bytes += bytes;
    }
    first
}

/// Collects fields.
#[derive(Debug, Default)]
struct Fields(Vec<Field>);

impl Fields {
    fn whole(&mut self, name: &str, value: impl Into<u64>) {
        let bits = value.into();
        self.0.push(Field {
            name: name.to_owned(),
            bits,
            shown: bits.to_string(),
        });
    }

    fn real(&mut self, name: &str, value: f64) {
        self.0.push(Field {
            name: name.to_owned(),
            bits: value.to_bits(),
            shown: format!("{value:?}"),
        });
    }

    fn joints(&mut self, name: &str, values: &arm_model::JointVector) {
        for (j, value) in values.iter().enumerate() {
            self.real(&format!("{name}[{}]", j + 1), *value);
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

/// Whether two cycle records agree in all that the core decides.
#[must_use]
pub fn cycles_agree(a: &CycleRecord, b: &CycleRecord) -> bool {
    let plain = |r: &CycleRecord| CycleRecord {
        wake_late_ns: 0,
        compute_ns: 0,
        send_ns: 0,
        dropped: 0,
        ..*r
    };
    let (mut x, mut y) = ([0; RECORD_MAX], [0; RECORD_MAX]);
    // Bits, not values: NaN equals itself here, and the two zeros differ.
    match (
        postcard::to_slice(&plain(a), &mut x),
        postcard::to_slice(&plain(b), &mut y),
    ) {
        (Ok(x), Ok(y)) => x == y,
        (Ok(_) | Err(_), _) => false,
    }
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
        let mut b = a;
        assert!(cycles_agree(&a, &b));
        assert_eq!(first_unequal(&cycle_fields(&a), &cycle_fields(&b)), None);
        b.compute_ns = 5;
        assert!(cycles_agree(&a, &b), "timings are not the core's");
        b.missed = 0x0102_0304;
        b.q_c.0[2] = -0.0;
        assert!(!cycles_agree(&a, &b));
        let found = first_unequal(&cycle_fields(&a), &cycle_fields(&b)).unwrap();
        assert_eq!((found.field.as_str(), found.bytes), ("missed", 5));
        b.missed = 1;
        let found = first_unequal(&cycle_fields(&a), &cycle_fields(&b)).unwrap();
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
