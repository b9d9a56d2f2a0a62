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

/// Parameters as the vendor's documents list them.
#[test]
fn requests_and_replies_have_the_vendors_layout() {
    let floats =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let angles = [0.5_f32, -0.25, 0.75, 1.0, -1.5, 2.0, -3.0];
    let q = JointVector(angles.map(f64::from));
    let velocity = |synchronised, duration_s| Command::JointVelocity {
        velocity: q,
        synchronised,
        duration_s,
    };
    let offset = TcpPose {
        position_m: [0.0, -0.05, 0.2],
        rpy_rad: [0.5, 0.25, -1.0],
    };
    let offset_mm_rad = floats(&[0.0, -50.0, 200.0, 0.5, 0.25, -1.0]);
    let protocol = Protocol::Private;
    let mut out = [0; MAX_FRAME_LEN];
    for (command, register, parameters) in [
        (Command::SetState(StateRequest::Stop), 12, vec![4]),
        (
            Command::ServoJoint(q),
            29,
            [floats(&angles), vec![0; 12]].concat(),
        ),
        (
            velocity(true, None),
            81,
            [floats(&angles), vec![1]].concat(),
        ),
        (
            velocity(false, Some(0.5)),
            81,
            [floats(&angles), vec![0], floats(&[0.5])].concat(),
        ),
        (Command::TcpOffset(offset), 35, offset_mm_rad),
        (
            Command::SetSpeedLimitFactor(1.25),
            232,
            [vec![1], floats(&[1.25])].concat(),
        ),
    ] {
        let n = emit_command(&mut out, 0x0102, protocol, &command).unwrap();
        let len = u8::try_from(parameters.len() + 1).unwrap();
        let head = [1, 2, 0, 2, 0, len, register];
        assert_eq!(out[..n], [&head[..], &parameters].concat(), "{command:?}");
    }
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
            [floats(&angles), floats(&angles.map(|v| v * 2.0))].concat(),
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

#[test]
fn these_registers_are_typed() {
    use Register as R;
    // A joint, a state, a level and a number of quantities; or a speed limit factor.
    let parsed = |register: &R| {
        let parse = |byte| Command::parse(register.code(), &[byte; 60]);
        parse(3).or_else(|_| parse(1)).is_ok()
    };
    let typed: Vec<Register> = R::ALL.iter().copied().filter(parsed).collect();
    let listed = [
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
    ];
    assert_eq!(typed, listed);
}
