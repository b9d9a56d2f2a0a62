//! The arm's wire: frames, requests, replies, every report layout, streams cut
//! anywhere.

use arm_model::JointVector;
use rt_controller::report_feed::arm_codes;
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::report::{ForceReport, NormalReport, RealtimeReport, RichReport};
use rt_controller::xarm::{
    ArmVersion, Command, Firmware, FrameReader, JointQuery, Protocol, ReplyData, ReportReader,
    StateRequest, Status,
};

/// Commands whose replies carry something.
fn requested() -> Vec<Command> {
    vec![
        Command::Version,
        Command::SerialNumbers,
        Command::GetState,
        Command::Buffered,
        Command::GetFault,
        Command::DigitalInputs,
        Command::GetSpeedLimitFactor,
        Command::JointPosition(JointQuery::MEASURED),
        Command::SetState(StateRequest::Ready),
        Command::ServoJoint(JointVector::splat(0.3)),
    ]
}

/// The frames of `bytes` fed in pieces of `piece` bytes, as text.
fn frames(bytes: &[u8], piece: usize) -> (Vec<String>, bool) {
    let mut reader = FrameReader::new();
    let mut found = Vec::new();
    for piece in bytes.chunks(piece.max(1)) {
        let mut fed = 0;
        while fed < piece.len() {
            let taken = reader.feed(&piece[fed..]);
            assert!(taken > 0, "a reader that takes nothing blocks its stream");
            fed += taken;
            loop {
                match reader.next_frame() {
                    Ok(Some(frame)) => found.push(format!("{frame:?}")),
                    Ok(None) => break,
                    Err(_lost) => return (found, true),
                }
            }
        }
    }
    (found, false)
}

fn commands(bytes: &[u8]) {
    let mut reader = FrameReader::new();
    reader.feed(bytes);
    while let Ok(Some(frame)) = reader.next_frame() {
        if let Some(request) = frame.as_request()
            && let Ok(command) = Command::parse(request.register, request.parameters)
        {
            let mut out = [0; MAX_FRAME_LEN];
            let len = emit_command(&mut out, 7, Protocol::Private, &command).unwrap();
            let mut again = FrameReader::new();
            again.feed(&out[..len]);
            let frame = again.next_frame().unwrap().unwrap();
            let request = frame.as_request().unwrap();
            let back = Command::parse(request.register, request.parameters).unwrap();
            // `{:?}` tells NaN from numbers and is exact for these.
            assert_eq!(format!("{back:?}"), format!("{command:?}"));
        }
        if let Some(reply) = frame.as_reply() {
            for command in requested() {
                let _ = ReplyData::parse(&command, &reply);
            }
        }
    }
}

fn reports(bytes: &[u8]) {
    let mut reader = ReportReader::new();
    for piece in bytes.chunks(700) {
        reader.feed(piece);
        while let Ok(Some(frame)) = reader.next_report() {
            report(frame);
        }
    }
    report(bytes);
}

fn report(frame: &[u8]) {
    let _ = ForceReport::parse(frame);
    let _ = NormalReport::parse(frame);
    let _ = RichReport::parse(frame);
    let _ = RealtimeReport::parse(frame);
    let _ = arm_codes(frame, 1);
}

/// Reads `data` as everything that may come over the wire.
pub fn run(data: &[u8]) {
    let Some((cut, bytes)) = data.split_first() else {
        return;
    };
    let whole = frames(bytes, 512);
    assert_eq!(frames(bytes, usize::from(*cut)), whole);
    commands(bytes);
    reports(bytes);
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = (ArmVersion::parse(text), Firmware::parse(text));
    }
}

/// Requests, replies, reports.
pub fn seeds() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for command in requested() {
        let mut out = [0; MAX_FRAME_LEN];
        let len = emit_command(&mut out, 3, Protocol::PrivateHeartbeat, &command).unwrap();
        let mut seed = vec![5];
        seed.extend_from_slice(&out[..len]);
        let mut reader = FrameReader::new();
        reader.feed(&out[..len]);
        let frame = reader.next_frame().unwrap().unwrap();
        let request = frame.as_request().unwrap();
        let mut reply = [0; MAX_FRAME_LEN];
        let len = ReplyData::None
            .emit(&mut reply, &request, Status(0))
            .unwrap();
        seed.extend_from_slice(&reply[..len]);
        all.push(seed);
    }
    for len in [87_usize, 133, 135, 145, 233, 245, 784] {
        let mut report = vec![9];
        report.extend(u32::try_from(len).unwrap().to_be_bytes());
        report.resize(1 + len, 0);
        all.push(report);
    }
    all.push(b"\0v2.7.1".to_vec());
    all
}
