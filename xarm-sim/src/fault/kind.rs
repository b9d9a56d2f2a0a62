//! What can go wrong.

use crate::firmware::Firmware;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Which connections a fault of the wire concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PortSet {
    /// The command port.
    #[default]
    Commands,
    /// The report ports.
    Reports,
    /// Both.
    All,
}

/// Which report stream a fault concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReportPort {
    /// Port 30000.
    #[default]
    Realtime,
    /// Port 30001.
    Normal,
    /// Port 30002.
    Rich,
    /// Port 30003.
    Real,
    /// All four.
    All,
}

/// What a second commander does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ForeignRequest {
    /// Streams setpoints of its own, 1 mrad beside the arm's pose.
    #[default]
    Setpoints,
    /// Stops the arm.
    Stop,
    /// Sets mode 0.
    Mode,
}

/// A fault. Joints are numbered from 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultKind {
    /// The command port takes and gives nothing; then everything at once.
    Stall,
    /// Connections are reset.
    ConnectionReset {
        /// Which.
        #[serde(default)]
        ports: PortSet,
    },
    /// Connections open now are neither read nor answered any more; new ones
    /// are served.
    HalfOpen {
        /// Which.
        #[serde(default)]
        ports: PortSet,
    },
    /// Nothing passes on any port; afterwards all connections are reset.
    CablePull,
    /// Replies come late.
    RepliesDelayed {
        /// By this much (s).
        delay_s: f64,
    },
    /// Replies change places in pairs.
    RepliesReordered,
    /// Every reply comes twice.
    RepliesDuplicated,
    /// Replies get lost.
    RepliesLost {
        /// Part of them, 0 to 1.
        share: f64,
    },
    /// Replies that nobody asked for come before the asked ones.
    RepliesForeign,
    /// The status byte of replies shows an error that the arm does not have.
    ErrorBit,
    /// The status byte of replies shows a warning that the arm does not have.
    WarningBit,
    /// The status byte of replies says "not able to move".
    NotReadyBit,
    /// The arm sets a warning code.
    Warning {
        /// W code.
        code: u8,
    },
    /// The arm raises an error.
    RaiseError {
        /// C code.
        code: u8,
    },
    /// A joint's drive raises an error; clearing does not remove it while it
    /// lasts, without a duration only switching off and on does.
    ServoError {
        /// Joint.
        joint: u8,
        /// S code.
        code: u8,
    },
    /// An emergency stop is pressed and stays so for the duration.
    EmergencyStop {
        /// 1 button, 2 input, 3 three-state switch.
        code: u8,
    },
    /// The arm hits something: current rises, C31 if the sensitivity is not 0.
    Collision,
    /// The state changes by itself.
    StateChanged {
        /// 3, 4, 5 or 6.
        state: u8,
    },
    /// The mode changes by itself.
    ModeChanged {
        /// New mode.
        mode: u8,
    },
    /// Another client commands the arm.
    SecondCommander {
        /// What it sends.
        #[serde(default)]
        request: ForeignRequest,
        /// How often (Hz).
        rate_hz: f64,
    },
    /// The controller is switched off, and on again after the duration.
    PowerCycle,
    /// From now on new connections see another firmware.
    FirmwareChanged {
        /// Version.
        version: Firmware,
    },
    /// Reports stop while their connections stay.
    ReportStop {
        /// Which.
        #[serde(default)]
        port: ReportPort,
    },
    /// Reports repeat their last values; their time runs on.
    ReportFreeze {
        /// Which.
        #[serde(default)]
        port: ReportPort,
    },
    /// The time stamps of reports jump.
    ReportTimeJump {
        /// By this much, negative for back (s).
        by_s: f64,
    },
    /// The time stamps of reports begin at zero again.
    ReportTimeWrap,
    /// The time stamps of reports drift.
    ReportTimeDrift {
        /// By this much (µs/s).
        ppm: f64,
    },
    /// Reports end in the middle; the next one follows at once.
    ReportTruncated {
        /// Which.
        #[serde(default)]
        port: ReportPort,
        /// How many.
        frames: u32,
        /// Bytes sent of each.
        keep_bytes: u16,
    },
    /// Reports claim another length than they have.
    ReportLength {
        /// Which.
        #[serde(default)]
        port: ReportPort,
        /// How many.
        frames: u32,
        /// Length claimed (bytes).
        claim_bytes: u32,
    },
    /// A joint angle of reports is no number.
    ReportNan {
        /// Which.
        #[serde(default)]
        port: ReportPort,
        /// How many.
        frames: u32,
        /// Joint.
        joint: u8,
    },
    /// A joint angle of reports is infinite.
    ReportInfinity {
        /// Which.
        #[serde(default)]
        port: ReportPort,
        /// How many.
        frames: u32,
        /// Joint.
        joint: u8,
    },
    /// Reports consist of random bytes behind a proper length.
    ReportGarbage {
        /// Which.
        #[serde(default)]
        port: ReportPort,
        /// How many.
        frames: u32,
    },
    /// All joints follow later.
    TrackingLag {
        /// By this much (s).
        lag_s: f64,
    },
    /// A joint does not move.
    JointStuck {
        /// Joint.
        joint: u8,
    },
    /// The encoder of a joint is off.
    EncoderJump {
        /// Joint.
        joint: u8,
        /// By this much (rad).
        by_rad: f64,
    },
    /// The controller's clock runs fast or slow: stamps, report rate and
    /// setpoint cycle.
    ClockRate {
        /// By this much (µs/s); 1000 is 0.1 %.
        ppm: f64,
    },
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

impl FaultKind {
    /// How long it lasts.
    pub(super) fn lasts(&self) -> Lasts {
        match self {
            Self::Stall | Self::CablePull | Self::PowerCycle => Lasts::Span,
            Self::ConnectionReset { .. }
            | Self::HalfOpen { .. }
            | Self::Warning { .. }
            | Self::RaiseError { .. }
            | Self::Collision
            | Self::StateChanged { .. }
            | Self::ModeChanged { .. }
            | Self::FirmwareChanged { .. }
            | Self::ReportTimeJump { .. }
            | Self::ReportTimeWrap
            | Self::ReportTruncated { .. }
            | Self::ReportLength { .. }
            | Self::ReportNan { .. }
            | Self::ReportInfinity { .. }
            | Self::ReportGarbage { .. } => Lasts::Moment,
            _ => Lasts::Open,
        }
    }
}

/// Numbers that a field may have: from the first to the last.
#[derive(Debug, Clone, Copy)]
pub(super) enum Range {
    Number(f64, f64),
    Whole(i64, i64),
}

impl Range {
    /// What field `field` of kind `kind` may have, if it is a number.
    pub(super) fn of(kind: &str, field: &str) -> Option<Self> {
        Some(match field {
            "delay_s" => Self::Number(0.0, 60.0),
            "share" => Self::Number(0.0, 1.0),
            "code" if kind == "emergency_stop" => Self::Whole(1, 3),
            "code" => Self::Whole(1, 255),
            "state" => Self::Whole(3, 6),
            "mode" => Self::Whole(0, 11),
            "rate_hz" => Self::Number(0.1, 1000.0),
            "by_s" => Self::Number(-1e6, 1e6),
            "ppm" => Self::Number(-1e5, 1e5),
            "frames" => Self::Whole(1, 1_000_000),
            "keep_bytes" => Self::Whole(0, 86),
            "claim_bytes" => Self::Whole(0, u32::MAX.into()),
            "lag_s" => Self::Number(0.0, 10.0),
            "joint" => Self::Whole(1, 7),
            "by_rad" => Self::Number(-10.0, 10.0),
            _ => return None,
        })
    }

    /// The value of `field`, or what is allowed there.
    pub(super) fn number(self, field: &str, found: &Value) -> Result<f64, String> {
        let whole = found.as_integer().map(|n| n as f64);
        let (value, min, max) = match self {
            Self::Number(min, max) => (found.as_float().or(whole), min, max),
            Self::Whole(min, max) => (whole, min as f64, max as f64),
        };
        value
            .filter(|v| (min..=max).contains(v))
            .ok_or_else(|| format!("`{field}` is {found}; allowed is {self}"))
    }
}

impl core::fmt::Display for Range {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Number(min, max) => write!(f, "a number from {min} to {max}"),
            Self::Whole(min, max) => write!(f, "a whole number from {min} to {max}"),
        }
    }
}

impl ReportPort {
    /// Whether it covers the port of index `port` in 30000, 30001, ...
    pub(crate) fn covers(self, port: usize) -> bool {
        self == Self::All || self as usize == port
    }
}

impl PortSet {
    /// Whether it covers the command port, or the report ports.
    pub(crate) fn covers(self, commands: bool) -> bool {
        match self {
            Self::Commands => commands,
            Self::Reports => !commands,
            Self::All => true,
        }
    }
}
