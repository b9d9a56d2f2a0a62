//! The version text of an arm, and what follows from it: report layouts, wire
//! modes, joint ranges.
//!
//! `<axes>,<type>,<arm>,<box>,v<major>.<minor>.<rev>`, for example
//! `7,7,XS1305,AC1304,v2.7.1`.

use super::report::REALTIME_REPORT_LEN;
use arm_model::{JointVector, Limits};
use core::fmt;
use core::ops::RangeInclusive;

/// Serial number of the simulated arm (register 2). No arm of the vendor has it, and an
/// address proves nothing: a tunnel makes a real arm answer on this machine.
pub const SIMULATED_SERIAL_NUMBER: &str = "SIMULATED00000";

/// Number of a firmware release.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Firmware {
    /// Generation; report layouts are known for 2 only.
    pub major: u16,
    /// Release.
    pub minor: u16,
    /// Revision.
    pub revision: u16,
}

impl Firmware {
    /// Port 30000, the only report with measured velocity and a time stamp.
    pub const REALTIME_REPORT: Self = Self::new(2, 1, 0);
    /// The linear speed limit of servo mode becomes C60 with a settable factor.
    pub const SPEED_FACTOR: Self = Self::new(2, 3, 0);
    /// Rich report of 574 bytes.
    pub const RICH_574: Self = Self::new(2, 4, 0);
    /// Rich report of 587 bytes, real-time report of 804.
    pub const RICH_587: Self = Self::new(2, 8, 2);

    /// From its three numbers.
    #[must_use]
    pub const fn new(major: u16, minor: u16, revision: u16) -> Self {
        Self {
            major,
            minor,
            revision,
        }
    }

    /// Sizes that a report of port 30000 may have (bytes).
    #[must_use]
    pub fn realtime_sizes(self) -> RangeInclusive<usize> {
        if self < Self::RICH_587 {
            REALTIME_REPORT_LEN..=REALTIME_REPORT_LEN
        } else {
            // Fields were appended, none moved.
            REALTIME_REPORT_LEN..=super::report::MAX_REPORT_LEN
        }
    }

    /// Sizes that a report of port 30002 may have (bytes).
    #[must_use]
    pub fn rich_sizes(self) -> RangeInclusive<usize> {
        if self < Self::RICH_574 {
            245..=573
        } else if self < Self::RICH_587 {
            574..=574
        } else {
            587..=1024
        }
    }

    /// Parses `v2.7.1`; whatever follows the digits is left out.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let mut numbers = text
            .trim()
            .trim_start_matches(['v', 'V'])
            .splitn(3, '.')
            .map(|part| {
                let digits = part.find(|c: char| !c.is_ascii_digit());
                part.get(..digits.unwrap_or(part.len()))?.parse().ok()
            });
        Some(Self {
            major: numbers.next()??,
            minor: numbers.next()??,
            revision: numbers.next()??,
        })
    }
}

impl fmt::Display for Firmware {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "v{}.{}.{}", self.major, self.minor, self.revision)
    }
}

/// What the version text says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmVersion {
    /// Number of axes.
    pub axes: u8,
    /// Type of the arm; 7 is an xArm 7.
    pub kind: u8,
    /// Hardware number of the arm (1305 in `XS1305`), if the text has one.
    pub hardware: Option<u16>,
    /// Firmware of the control box.
    pub firmware: Firmware,
}

/// Why an arm is refused by its version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum VersionError {
    /// Text of another form.
    #[error("its version text has an unknown form; is this an xArm?")]
    Text,
    /// Another arm, by its type and number of axes.
    #[error("it is a type {0} arm with {1} axes; this controller drives the xArm 7 (type 7)")]
    OtherArm(u8, u8),
    /// Reports with measured speeds are missing.
    #[error(
        "its firmware {0} is too old: {needed} or newer is needed for the 250 Hz report; update it with the vendor's tool",
        needed = Firmware::REALTIME_REPORT
    )]
    TooOld(Firmware),
    /// A generation whose report layouts are not known.
    #[error(
        "its firmware {0} is newer than the report layouts known here (generation 2); install a version 2 firmware or a newer controller"
    )]
    UnknownLayout(Firmware),
}

/// Joint 2 and joint 4 of arms numbered 1305 and up end earlier (rad).
const NARROW_JOINT_2: (f64, f64) = (-2.042_035, 2.024_581);
const NARROW_JOINT_4: (f64, f64) = (-0.104_720, 3.926_990);

impl ArmVersion {
    /// Parses a version text.
    ///
    /// # Errors
    /// [`VersionError::Text`].
    pub fn parse(text: &str) -> Result<Self, VersionError> {
        Self::read(text).ok_or(VersionError::Text)
    }

    fn read(text: &str) -> Option<Self> {
        let mut parts = text.trim().split(',');
        let axes = parts.next()?.trim().parse().ok()?;
        let kind = parts.next()?.trim().parse().ok()?;
        let hardware = parts.next()?.get(2..6).and_then(|n| n.parse().ok());
        let _control_box = parts.next()?;
        Some(Self {
            axes,
            kind,
            hardware,
            firmware: Firmware::parse(parts.next()?)?,
        })
    }

    /// Refuses an arm whose reports this controller cannot read.
    pub fn check(&self) -> Result<(), VersionError> {
        let firmware = self.firmware;
        if (self.axes, self.kind) != (7, 7) {
            return Err(VersionError::OtherArm(self.kind, self.axes));
        }
        if firmware < Firmware::REALTIME_REPORT {
            return Err(VersionError::TooOld(firmware));
        }
        if firmware.major > 2 {
            return Err(VersionError::UnknownLayout(firmware));
        }
        Ok(())
    }

    /// Whether joints 2 and 4 have the narrower range of newer arms.
    #[must_use]
    pub fn has_narrow_ranges(&self) -> bool {
        self.hardware.is_some_and(|n| (1305..8500).contains(&n))
    }

    /// Joint (0-based) and value (rad) where `limits` allow more than this arm
    /// has, if they do.
    #[must_use]
    pub fn wider_than_the_arm(&self, limits: &Limits) -> Option<(usize, f64)> {
        if !self.has_narrow_ranges() {
            return None;
        }
        let (low, high): (&JointVector, &JointVector) =
            (&limits.position_min_rad, &limits.position_max_rad);
        [(1, NARROW_JOINT_2), (3, NARROW_JOINT_4)]
            .into_iter()
            .find_map(|(joint, (from, to))| {
                let lowest = low.iter().nth(joint).filter(|v| **v < from - ROUNDING_RAD);
                let highest = high.iter().nth(joint).filter(|v| **v > to + ROUNDING_RAD);
                lowest.or(highest).map(|v| (joint, *v))
            })
    }
}

/// Ranges are written with six digits (rad).
const ROUNDING_RAD: f64 = 2e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vendors_example_is_understood() {
        let version = ArmVersion::parse("7,7,XS1305,AC1304,v2.7.1").unwrap();
        assert_eq!(version.hardware, Some(1305));
        assert_eq!(version.firmware, Firmware::new(2, 7, 1));
        assert!(version.has_narrow_ranges());
        assert_eq!(version.check(), Ok(()));
        assert_eq!(version.firmware.rich_sizes(), 574..=574);
        let older = ArmVersion::parse("7,7,XS1300,AC1300,v2.6.107\0\0").unwrap();
        assert!(!older.has_narrow_ranges());
    }

    #[test]
    fn other_arms_and_unknown_layouts_are_refused_in_words() {
        let refusal = |text: &str| {
            let checked = ArmVersion::parse(text).and_then(|v| v.check());
            checked.unwrap_err().to_string()
        };
        assert!(refusal("hello").contains("unknown form"));
        assert!(refusal("6,6,XI1305,AC1304,v2.7.1").contains("6 axes"));
        assert!(refusal("7,7,XS1300,AC1300,v1.12.9").contains("v2.1.0 or newer"));
        assert!(refusal("7,7,XS1400,AC1400,v3.0.0").contains("newer than"));
    }

    #[test]
    fn appended_fields_are_tolerated_from_the_release_that_appended_them() {
        let realtime = |minor, revision| Firmware::new(2, minor, revision).realtime_sizes();
        assert_eq!(realtime(7, 1), 784..=784);
        assert!(realtime(8, 2).contains(&804));
        assert!(Firmware::new(2, 8, 2).rich_sizes().contains(&587));
        assert!(!Firmware::new(2, 3, 0).rich_sizes().contains(&574));
    }
}
