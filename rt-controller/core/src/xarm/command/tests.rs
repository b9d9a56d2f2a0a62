use super::*;
use crate::xarm::frame::{MAX_FRAME_LEN, Protocol, Reply, Request, emit_command};
use crate::xarm::reply::{ReplyData, ReplyError};
use crate::xarm::status::Status;
use crate::xarm::stream::FrameReader;
use proptest::prelude::*;

proptest! {
    /// Requests of every register and replies to them; small bytes make choices that
    /// exist.
    #[test]
    fn what_is_typed_is_emitted_and_parsed_back(
        bytes in prop::collection::vec(prop_oneof![0_u8..9, any::<u8>()], 0..160),
        transaction in any::<u16>(),
    ) {
        let protocol = Protocol::PrivateHeartbeat;
        let mut out = [0; MAX_FRAME_LEN];
        for register in Register::ALL.iter().map(|register| register.code()) {
            let Ok(command) = Command::parse(register, &bytes) else {
                continue;
            };
            let n = emit_command(&mut out, transaction, protocol, &command).unwrap();
            let mut reader = FrameReader::new();
            reader.feed(&out[..n]);
            let request = reader.next_frame().unwrap().unwrap().as_request().unwrap();
            prop_assert_eq!((request.transaction, request.protocol), (transaction, protocol));
            prop_assert_eq!(Command::parse(request.register, request.parameters), Ok(command));
            prop_assert!(reader.next_frame().unwrap().is_none());
            let (status, data) = (Status(0), &bytes[..]);
            let reply = Reply { transaction, protocol, register, status, data };
            let Ok(data) = ReplyData::parse(&command, &reply) else {
                continue;
            };
            let request = Request { transaction, protocol, register, parameters: &[] };
            let n = data.emit(&mut out, &request, status).unwrap();
            reader.feed(&out[..n]);
            let reply = reader.next_frame().unwrap().unwrap().as_reply().unwrap();
            prop_assert_eq!(reply.transaction, transaction);
            // `{:?}` tells NaN from numbers and is exact for these.
            let (back, sent) = (ReplyData::parse(&command, &reply), Ok::<_, ReplyError>(data));
            prop_assert_eq!(format!("{back:?}"), format!("{sent:?}"));
        }
    }
}

/// The SDK's servo_j is ten floats: seven angles, then 0.349, 8.727, 0, little-endian. Its
/// modes come with one byte or two.
#[test]
fn requests_are_understood_or_refused_for_what_is_wrong_with_them() {
    let floats = [0.5_f32, -0.25, 0.0, 1.0, 0.0, 0.0, 2.0, 0.349, 8.727, 0.0];
    let servo_j = floats.map(f32::to_le_bytes).concat();
    let mut not_finite = servo_j.clone();
    not_finite[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let target = JointVector([0.5, -0.25, 0.0, 1.0, 0.0, 0.0, 2.0]);
    let (register, given) = (Register::ServoJoint, 27);
    let untyped = CommandError::Untyped(Register::GravityDirection);
    let mode_2 = Ok(Command::SetMode(Mode::Other(2)));
    for (code, parameters, expected) in [
        (29, &servo_j[..], Ok(Command::ServoJoint(target))),
        (
            29,
            &servo_j[..given],
            Err(CommandError::TooShort { register, given }),
        ),
        (29, &not_finite[..], Err(CommandError::BadValue(register))),
        (19, &[2][..], mode_2),
        (19, &[2, 1][..], mode_2),
        (0xEE, &[][..], Err(CommandError::UnknownRegister(0xEE))),
        (0x33, &[0; 12][..], Err(untyped)),
        (
            12,
            &[9][..],
            Err(CommandError::BadValue(Register::SetState)),
        ),
    ] {
        assert_eq!(Command::parse(code, parameters), expected, "{parameters:?}");
    }
}

/// What the vendor's SDK encodes for these arguments (`sdk-requests/make.py` prints it).
const SDK_REQUESTS: &str = include_str!("../../../sdk-requests/requests.txt");

/// Numbers that an f32 holds exactly.
const ANGLES: [f32; 7] = [0.5, -0.25, 0.75, 1.0, -1.5, 2.0, -3.0];

/// The requests of `sdk-requests/make.py`, in its order.
fn requests() -> Vec<(&'static str, Command)> {
    let q = JointVector(ANGLES.map(f64::from));
    let (speed_rad_s, acceleration_rad_s2) = (0.5, 2.0);
    let move_joint = |checked| Command::MoveJoint {
        target: q,
        speed_rad_s,
        acceleration_rad_s2,
        checked,
    };
    let velocity = |synchronised, duration_s| Command::JointVelocity {
        velocity: q,
        synchronised,
        duration_s,
    };
    let enable = |joint, enable| Command::MotionEnable { joint, enable };
    vec![
        ("version", Command::Version),
        ("serial_numbers", Command::SerialNumbers),
        ("motion_enable", enable(Command::ALL_JOINTS, true)),
        ("motion_disable", enable(3, false)),
        ("state_ready", Command::SetState(StateRequest::Ready)),
        ("state_pause", Command::SetState(StateRequest::Pause)),
        ("state_stop", Command::SetState(StateRequest::Stop)),
        (
            "state_decelerated_stop",
            Command::SetState(StateRequest::DeceleratedStop),
        ),
        ("get_state", Command::GetState),
        ("buffered", Command::Buffered),
        ("get_fault", Command::GetFault),
        ("clean_error", Command::CleanError),
        ("clean_warning", Command::CleanWarning),
        (
            "brake_release",
            Command::Brake {
                joint: Command::ALL_JOINTS,
                release: true,
            },
        ),
        ("mode_position", Command::SetMode(Mode::Position)),
        ("mode_servo", Command::SetMode(Mode::Servo)),
        ("mode_velocity", Command::SetMode(Mode::JointVelocity)),
        ("move_joint", move_joint(None)),
        ("move_joint_checked", move_joint(Some(1))),
        (
            "move_home",
            Command::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked: None,
            },
        ),
        ("servo_joint", Command::ServoJoint(q)),
        ("joint_jerk", Command::JointJerk(20.0)),
        ("joint_acceleration", Command::JointAcceleration(10.0)),
        (
            "tcp_offset",
            Command::TcpOffset(TcpPose {
                position_m: [0.0, -0.05, 0.2],
                rpy_rad: [0.5, 0.25, -1.0],
            }),
        ),
        (
            "tcp_load",
            Command::TcpLoad {
                mass_kg: 0.5,
                centre_m: [0.001, -0.002, 0.064],
            },
        ),
        ("collision_sensitivity", Command::CollisionSensitivity(3)),
        ("teach_sensitivity", Command::TeachSensitivity(2)),
        ("tcp_pose", Command::TcpPose),
        (
            "joints_commanded",
            Command::JointPosition(JointQuery::Commanded),
        ),
        (
            "joints_measured",
            Command::JointPosition(JointQuery::MEASURED),
        ),
        (
            "joints_measured_with_rates",
            Command::JointPosition(JointQuery::Quantities {
                quantities: 3,
                targets: false,
            }),
        ),
        ("forward_kinematics", Command::ForwardKinematics(q)),
        ("digital_inputs", Command::DigitalInputs),
        ("joint_limit_test", Command::JointLimitTest(q)),
        ("velocity", velocity(true, None)),
        ("velocity_with_duration", velocity(false, Some(0.5))),
        ("set_speed_limit_factor", Command::SetSpeedLimitFactor(1.25)),
        ("get_speed_limit_factor", Command::GetSpeedLimitFactor),
        ("feedback_check", Command::FeedbackCheck),
        ("feedback_mask", Command::FeedbackMask(3)),
    ]
}

#[test]
fn requests_are_the_bytes_of_the_vendors_encoder() {
    let (requests, protocols) = (requests(), [Protocol::Private, Protocol::PrivateHeartbeat]);
    let mut ours = String::new();
    for (n, (protocol, (name, command))) in (1..)
        .zip((protocols.iter()).flat_map(|p| requests.iter().map(move |request| (*p, request))))
    {
        let mut out = [0; MAX_FRAME_LEN];
        let len = emit_command(&mut out, n, protocol, command).unwrap();
        let hex: String = out[..len].iter().map(|b| format!("{b:02x}")).collect();
        ours += &format!("{} {name} {hex}\n", u16::from_be_bytes([out[2], out[3]]));
    }
    // The first line tells the SDK's version.
    let (_, sdks) = SDK_REQUESTS.split_once('\n').unwrap();
    assert_eq!(ours, sdks);
    let sent: Vec<Register> = requests.iter().map(|(_, c)| c.register()).collect();
    assert!(TYPED.iter().all(|register| sent.contains(register)));
}

/// Replies as the vendor's documents list them.
#[test]
fn replies_have_the_vendors_layout() {
    let floats =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let q = JointVector(ANGLES.map(f64::from));
    let protocol = Protocol::Private;
    let mut out = [0; MAX_FRAME_LEN];
    let motion = ReplyData::JointMotion {
        quantities: 2,
        position: q,
        velocity: q * 2.0,
        effort: JointVector::ZERO,
    };
    let (error, warning) = (22, 11);
    for (reply, register, data) in [
        (ReplyData::Fault { error, warning }, 15, vec![22, 11]),
        (ReplyData::DigitalInputs(0xFFFD), 131, vec![0xFF, 0xFD]),
        (
            motion,
            42,
            [floats(&ANGLES), floats(&ANGLES.map(|v| v * 2.0))].concat(),
        ),
    ] {
        let (transaction, parameters) = (0x0102, &[][..]);
        let request = Request {
            transaction,
            protocol,
            register,
            parameters,
        };
        let n = reply.emit(&mut out, &request, Status(0x10)).unwrap();
        let len = u8::try_from(data.len() + 2).unwrap();
        let head = [1, 2, 0, 2, 0, len, register, 0x10];
        assert_eq!(out[..n], [&head[..], &data].concat(), "{reply:?}");
    }
}

/// Registers with a typed form.
const TYPED: [Register; 30] = {
    use Register as R;
    [
        R::Version,
        R::SerialNumbers,
        R::MotionEnable,
        R::SetState,
        R::GetState,
        R::Buffered,
        R::Fault,
        R::CleanError,
        R::CleanWarning,
        R::Brake,
        R::SetMode,
        R::MoveJoint,
        R::MoveHome,
        R::ServoJoint,
        R::JointJerk,
        R::JointAcceleration,
        R::TcpOffset,
        R::TcpLoad,
        R::CollisionSensitivity,
        R::TeachSensitivity,
        R::TcpPose,
        R::JointPosition,
        R::ForwardKinematics,
        R::JointLimitTest,
        R::JointVelocity,
        R::DigitalInputs,
        R::SetParameter,
        R::GetParameter,
        R::FeedbackCheck,
        R::FeedbackMask,
    ]
};

#[test]
fn these_registers_are_typed() {
    // A joint, a state, a level and a number of quantities; or a speed limit factor.
    let parsed = |register: &Register| {
        let parse = |byte| Command::parse(register.code(), &[byte; 60]);
        parse(3).or_else(|_| parse(1)).is_ok()
    };
    let typed: Vec<Register> = Register::ALL.iter().copied().filter(parsed).collect();
    assert_eq!(typed, TYPED);
}
