//! Controller error codes ("C codes") with names and remedies.

use core::fmt;

/// Error code of the controller as register 15 and the reports give it; 0 is
/// none. Every error stops the arm, drops the buffer, leads to state 4 and
/// mode 0. To recover: remove the cause, then clear error, motion enable, set
/// mode, set state ready.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ErrorCode(pub u8);

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

    /// What the code means (vendor manual, error tables).
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            1 => "emergency stop button on the control box",
            2 => "emergency stop input",
            3 => "three-state switch stop",
            10 => "servo error",
            11 => "servo of joint 1",
            12 => "servo of joint 2",
            13 => "servo of joint 3",
            14 => "servo of joint 4",
            15 => "servo of joint 5",
            16 => "servo of joint 6",
            17 => "servo of joint 7",
            18 => "force-torque sensor communication",
            19 | 28 => "end module communication",
            21 => "kinematics",
            22 => "self collision",
            23 => "joint angle limit",
            24 => "speed limit of the command",
            25 => "planning",
            26 => "real-time system",
            27 => "command reply error",
            29 => "other error",
            30 => "feedback speed over limit",
            31 => "collision or abnormal motor current",
            33 => "controller GPIO",
            35 => "safety boundary",
            36 => "too many delayed commands",
            37 => "abnormal motion in hand guiding",
            38 => "abnormal joint angle",
            39 => "power board link",
            40 => "no inverse kinematics solution",
            44 => "serial number and firmware do not match",
            50..=53 => "force-torque sensor",
            60 => "linear speed limit of the tool in servo mode",
            110 => "base board link",
            111 => "external RS485 link",
            _ => "unknown error",
        }
    }

    /// What to do about it.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        match self.0 {
            1..=3 => "release the stop, then recover",
            10..=17 | 26 | 38 | 39 => "recover; if it stays, power the control box off and on",
            18 | 19 | 27 | 28 | 33 | 50..=53 | 110 | 111 => {
                "check the cable and the device, then recover"
            }
            21 => "plan a motion away from singular poses",
            22 => "plan a motion in which links keep their distance",
            23 => "keep the setpoints inside the joint ranges",
            24 => "slow the motion down, or start the stream at the present pose",
            25 => "change the target or the speed of the move",
            29 => "look at the controller's own log",
            30 => "slow the motion down",
            31 => "clear the workspace; check the configured load",
            35 => "plan inside the boundary, or move it",
            36 => "send fewer commands; check the network",
            37 => "check the configured load",
            40 => "change the target pose",
            44 => "update the firmware",
            60 => "slow the throw down, or raise the speed limit factor of the arm",
            _ => "look the code up in the vendor's manual",
        }
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
    fn what_has_a_name_has_a_remedy() {
        let [name, remedy] = [ErrorCode(0).name(), ErrorCode(0).remedy()];
        for code in (0..=u8::MAX).map(ErrorCode) {
            assert_eq!(code.name() == name, code.remedy() == remedy, "{code}");
        }
    }
}
