//! What each kind of fault may be given: the one table that the parser, its
//! error messages and the tests go by.

/// Values a field may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Values {
    /// A number between two bounds, both included.
    Number(f64, f64),
    /// A whole number between two bounds, both included.
    Whole(i64, i64),
    /// One of some words.
    Word(&'static [&'static str]),
    /// A firmware version.
    Version,
}

/// A field of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) values: Values,
    pub(super) required: bool,
}

/// How long a fault lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lasts {
    /// Something that happens; a duration makes no sense.
    Moment,
    /// For a duration that must be given.
    Span,
    /// For a duration, or for ever when none is given.
    Open,
}

/// A kind of fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    pub(super) lasts: Lasts,
    pub(super) fields: &'static [Field],
}

const fn needed(name: &'static str, values: Values) -> Field {
    Field {
        name,
        values,
        required: true,
    }
}

const fn kind(name: &'static str, lasts: Lasts, fields: &'static [Field]) -> Kind {
    Kind {
        name,
        lasts,
        fields,
    }
}

const PORTS: Field = Field {
    name: "ports",
    values: Values::Word(&["commands", "reports", "all"]),
    required: false,
};
const PORT: Field = Field {
    name: "port",
    values: Values::Word(&["realtime", "normal", "rich", "real", "all"]),
    required: false,
};
const WISH: Field = Field {
    name: "wish",
    values: Values::Word(&["setpoints", "stop", "mode"]),
    required: false,
};
const JOINT: Field = needed("joint", Values::Whole(1, 7));
const FRAMES: Field = needed("frames", Values::Whole(1, 1_000_000));
const PPM: Field = needed("ppm", Values::Number(-1e5, 1e5));
const ANY_CODE: Field = needed("code", Values::Whole(1, 255));

use Lasts::{Moment, Open, Span};

/// Every kind of fault, in the order of [`super::FaultKind`].
pub(super) const KINDS: &[Kind] = &[
    kind("stall", Span, &[]),
    kind("connection_reset", Moment, &[PORTS]),
    kind("half_open", Moment, &[PORTS]),
    kind("cable_pull", Span, &[]),
    kind(
        "replies_delayed",
        Open,
        &[needed("delay_s", Values::Number(0.0, 60.0))],
    ),
    kind("replies_reordered", Open, &[]),
    kind("replies_duplicated", Open, &[]),
    kind(
        "replies_lost",
        Open,
        &[needed("share", Values::Number(0.0, 1.0))],
    ),
    kind("replies_foreign", Open, &[]),
    kind("error_bit", Open, &[]),
    kind("warning_bit", Open, &[]),
    kind("not_ready_bit", Open, &[]),
    kind("warning", Moment, &[ANY_CODE]),
    kind("raise_error", Moment, &[ANY_CODE]),
    kind("servo_error", Open, &[JOINT, ANY_CODE]),
    kind(
        "emergency_stop",
        Open,
        &[needed("code", Values::Whole(1, 3))],
    ),
    kind("collision", Moment, &[]),
    kind(
        "state_changed",
        Moment,
        &[needed("state", Values::Whole(3, 6))],
    ),
    kind(
        "mode_changed",
        Moment,
        &[needed("mode", Values::Whole(0, 11))],
    ),
    kind(
        "second_commander",
        Open,
        &[WISH, needed("rate_hz", Values::Number(0.1, 1000.0))],
    ),
    kind("power_cycle", Span, &[]),
    kind(
        "firmware_changed",
        Moment,
        &[needed("version", Values::Version)],
    ),
    kind("report_stop", Open, &[PORT]),
    kind("report_freeze", Open, &[PORT]),
    kind(
        "report_time_jump",
        Moment,
        &[needed("by_s", Values::Number(-1e6, 1e6))],
    ),
    kind("report_time_wrap", Moment, &[]),
    kind("report_time_drift", Open, &[PPM]),
    kind(
        "report_torn",
        Moment,
        &[PORT, FRAMES, needed("keep_bytes", Values::Whole(0, 86))],
    ),
    kind(
        "report_length",
        Moment,
        &[
            PORT,
            FRAMES,
            needed("claim_bytes", Values::Whole(0, u32::MAX as i64)),
        ],
    ),
    kind("report_nan", Moment, &[PORT, FRAMES, JOINT]),
    kind("report_infinity", Moment, &[PORT, FRAMES, JOINT]),
    kind("report_garbage", Moment, &[PORT, FRAMES]),
    kind(
        "tracking_lag",
        Open,
        &[needed("lag_s", Values::Number(0.0, 10.0))],
    ),
    kind("joint_stuck", Open, &[JOINT]),
    kind(
        "encoder_jump",
        Open,
        &[JOINT, needed("by_rad", Values::Number(-10.0, 10.0))],
    ),
    kind("clock_rate", Open, &[PPM]),
];

impl core::fmt::Display for Values {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Number(min, max) => write!(f, "a number from {min} to {max}"),
            Self::Whole(min, max) => write!(f, "a whole number from {min} to {max}"),
            Self::Word(words) => write!(f, "one of {}", quoted(words)),
            Self::Version => f.write_str("a version like \"2.7.1\""),
        }
    }
}

/// Words in quotation marks, with commas.
pub(super) fn quoted(words: &[&str]) -> String {
    let quoted: Vec<_> = words.iter().map(|word| format!("\"{word}\"")).collect();
    quoted.join(", ")
}
