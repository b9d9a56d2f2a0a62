//! Registers of the command port.

/// Declares the registers once: number, name and meaning.
macro_rules! registers {
    ($($code:literal $name:ident $doc:literal),+ $(,)?) => {
        /// A register the controller knows.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Register {
            $(#[doc = $doc] $name = $code,)+
        }

        impl Register {
            /// Every known register, in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// From the number on the wire, `None` for an unknown one.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code {
                    $($code => Some(Self::$name),)+
                    _ => None,
                }
            }

            /// What the register is for.
            #[must_use]
            pub const fn purpose(self) -> &'static str {
                match self {
                    $(Self::$name => $doc,)+
                }
            }
        }
    };
}

registers! {
    0x01 Version "version text",
    0x02 SerialNumbers "serial numbers of arm and control box",
    0x04 ReloadDynamics "reload dynamics",
    0x05 ReportedEffort "whether reports hold torque (0) or current (1)",
    0x0A SystemControl "system control",
    0x0B MotionEnable "motion enable; system reset",
    0x0C SetState "set state",
    0x0D GetState "get state",
    0x0E Buffered "commands in buffer",
    0x0F Fault "error and warning code",
    0x10 CleanError "clear error; system reset",
    0x11 CleanWarning "clear warning",
    0x12 Brake "brake; system reset",
    0x13 SetMode "set mode; system reset",
    0x15 MoveLine "Cartesian line",
    0x17 MoveJoint "move joint",
    0x18 MoveJointBlended "move joint, blended",
    0x19 MoveHome "go to zero",
    0x1D ServoJoint "servo_j: streamed joint setpoint",
    0x1E ServoCartesian "streamed Cartesian setpoint",
    0x1F TcpJerk "TCP jerk",
    0x20 TcpAcceleration "TCP maximum acceleration",
    0x21 JointJerk "joint jerk",
    0x22 JointAcceleration "joint maximum acceleration",
    0x23 TcpOffset "TCP offset; system reset",
    0x24 TcpLoad "TCP load",
    0x25 CollisionSensitivity "collision sensitivity; system reset",
    0x26 TeachSensitivity "teach sensitivity; system reset",
    0x27 ClearConfiguration "clear configuration",
    0x28 SaveConfiguration "save configuration",
    0x29 TcpPose "TCP pose",
    0x2A JointPosition "joint position",
    0x2B InverseKinematics "inverse kinematics",
    0x2C ForwardKinematics "forward kinematics",
    0x2D JointLimitTest "joint limit test",
    0x2E TcpLimitTest "TCP limit test",
    0x2F ReducedTcpSpeed "reduced mode: TCP speed",
    0x30 ReducedJointSpeed "reduced mode: joint speed",
    0x31 GetReducedMode "reduced mode, get",
    0x32 SetReducedMode "reduced mode, set",
    0x33 GravityDirection "gravity direction",
    0x34 SafetyBoundary "safety boundary",
    0x35 ReducedState "reduced mode, all",
    0x37 JointTorque "joint torque estimate",
    0x3A ReducedJointRange "reduced joint range",
    0x3B Fence "fence on",
    0x3C CollisionRebound "collision rebound",
    0x42 ApproximateMotion "approximate motion near singularities",
    0x43 DhTable "Denavit-Hartenberg table",
    0x46 ReportEffort "report torque or current",
    0x4D SelfCollisionCheck "self collision check",
    0x4E ToolModel "collision model of the tool",
    0x4F SimulationMode "simulation mode",
    0x51 JointVelocity "joint velocity, mode 4",
    0x52 CartesianVelocity "Cartesian velocity, mode 5",
    0x83 DigitalInputs "digital inputs of the control box",
    0x8C PowerBoardVersion "power board version",
    0x8D HardwareTypes "hardware types",
    0xE8 SetParameter "common parameter, set",
    0xE9 GetParameter "common parameter, get",
    0xEA CommonInfo "common info, last error details",
    0xFD FeedbackCheck "feedback check",
    0xFE FeedbackMask "feedback mask",
}

impl Register {
    /// The number on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_survive_the_round_trip_and_are_the_vendors() {
        for register in Register::ALL {
            assert_eq!(Register::from_code(register.code()), Some(*register));
        }
        let decimal = [
            (Register::ServoJoint, 29),
            (Register::JointPosition, 42),
            (Register::JointVelocity, 81),
            (Register::DigitalInputs, 131),
            (Register::SetParameter, 232),
            (Register::FeedbackMask, 254),
        ];
        for (register, code) in decimal {
            assert_eq!(register.code(), code);
        }
        assert_eq!(Register::from_code(0xEE), None);
    }
}
