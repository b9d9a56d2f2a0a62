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

#[test]
fn lengths_are_millimetres_on_the_wire() {
    let mut out = [0; MAX_FRAME_LEN];
    let offset = TcpPose {
        position_m: [0.0, 0.0, 0.2],
        rpy_rad: [0.0; 3],
    };
    emit_command(&mut out, 1, Protocol::Private, &Command::TcpOffset(offset)).unwrap();
    assert_eq!(out[15..19], 200.0_f32.to_le_bytes());
}
