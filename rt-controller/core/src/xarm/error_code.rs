//! Controller error codes ("C codes") with names and remedies.

use core::fmt;

/// Error code of the controller as register 15 and the reports give it; 0 is
/// none. Every error stops the arm, drops the buffer, leads to state 4 and
/// mode 0. To recover: remove the cause, then clear error, motion enable, set
/// mode, set state ready.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ErrorCode(pub u8);

/// What went wrong and what to do, by code (vendor manual, error tables).
const TABLE: &[(u8, &str, &str)] = &[
    (1, "emergency stop button on the control box", RELEASE),
    (2, "emergency stop input", RELEASE),
    (3, "three-state switch stop", RELEASE),
    (10, "servo error", POWER),
    (11, "servo of joint 1", POWER),
    (12, "servo of joint 2", POWER),
    (13, "servo of joint 3", POWER),
    (14, "servo of joint 4", POWER),
    (15, "servo of joint 5", POWER),
    (16, "servo of joint 6", POWER),
    (17, "servo of joint 7", POWER),
    (18, "force-torque sensor communication", CABLE),
    (19, "end module communication", CABLE),
    (21, "kinematics", "plan a motion away from singular poses"),
    (
        22,
        "self collision",
        "plan a motion in which links keep their distance",
    ),
    (
        23,
        "joint angle limit",
        "keep the setpoints inside the joint ranges",
    ),
    (
        24,
        "speed limit of the command",
        "slow the motion down, or start the stream at the present pose",
    ),
    (25, "planning", "change the target or the speed of the move"),
    (26, "real-time system", POWER),
    (27, "command reply error", CABLE),
    (28, "end module communication", CABLE),
    (29, "other error", "look at the controller's own log"),
    (30, "feedback speed over limit", "slow the motion down"),
    (
        31,
        "collision or abnormal motor current",
        "clear the workspace; check the configured load",
    ),
    (33, "controller GPIO", CABLE),
    (
        35,
        "safety boundary",
        "plan inside the boundary, or move it",
    ),
    (
        36,
        "too many delayed commands",
        "send fewer commands; check the network",
    ),
    (
        37,
        "abnormal motion in hand guiding",
        "check the configured load",
    ),
    (38, "abnormal joint angle", POWER),
    (39, "power board link", POWER),
    (
        40,
        "no inverse kinematics solution",
        "change the target pose",
    ),
    (
        44,
        "serial number and firmware do not match",
        "update the firmware",
    ),
    (50, "force-torque sensor", CABLE),
    (51, "force-torque sensor", CABLE),
    (52, "force-torque sensor", CABLE),
    (53, "force-torque sensor", CABLE),
    (
        60,
        "linear speed limit of the tool in servo mode",
        "slow the throw down, or raise the speed limit factor of the arm",
    ),
    (110, "base board link", CABLE),
    (111, "external RS485 link", CABLE),
];
const RELEASE: &str = "release the stop, then recover";
const POWER: &str = "recover; if it stays, power the control box off and on";
const CABLE: &str = "check the cable and the device, then recover";

impl ErrorCode {
    /// No error.
    pub const NONE: Self = Self(0);
    /// C22: self collision.
    pub const SELF_COLLISION: Self = Self(22);
    /// C23: joint angle limit.
    pub const JOINT_LIMIT: Self = Self(23);
    /// C24: speed limit of the command.
    pub const SPEED_LIMIT: Self = Self(24);
    /// C31: collision or abnormal motor current.
    pub const COLLISION: Self = Self(31);
    /// C60: linear speed limit of the tool in servo mode.
    pub const TCP_SPEED_LIMIT: Self = Self(60);

    /// Whether there is no error.
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    /// What the code means.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.entry().map_or("unknown error", |(_, name, _)| *name)
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.entry().map_or(
            "look the code up in the vendor's manual",
            |(_, _, remedy)| *remedy,
        )
    }

    fn entry(self) -> Option<&'static (u8, &'static str, &'static str)> {
        TABLE.iter().find(|(code, _, _)| *code == self.0)
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_none() {
            f.write_str("no error")
        } else {
            write!(f, "C{}: {}; {}", self.0, self.name(), self.remedy())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_say_what_and_what_to_do() {
        let text = ErrorCode::TCP_SPEED_LIMIT.to_string();
        assert!(text.starts_with("C60: linear speed") && text.contains("factor"));
        assert_eq!(ErrorCode(0).to_string(), "no error");
        assert!(ErrorCode(99).to_string().contains("unknown"));
    }

    #[test]
    fn no_code_is_listed_twice() {
        assert!(TABLE.windows(2).all(|w| w[0].0 < w[1].0));
    }
}
