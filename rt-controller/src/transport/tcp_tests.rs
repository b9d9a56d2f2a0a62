use super::*;
use crate::os::now_ns;
use crate::xarm::{ReplyData, StateRequest};
use arm_model::JointVector;
use std::io::Read;
use std::net::TcpListener;

fn pair() -> (TcpLink, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let settings = LinkSettings::new(64, 5);
    let link = TcpLink::connect(address, Duration::from_secs(1), settings).unwrap();
    let (peer, _) = listener.accept().unwrap();
    peer.set_nodelay(true).unwrap();
    (link, peer)
}

/// Whether a link takes all of these commands, and leaves none out.
fn sends<W: ByteStream>(link: &mut TcpLink<W>, commands: &[Command], now_ns: u64) -> bool {
    let skipped = link.skipped;
    link.send(commands, now_ns).unwrap();
    link.skipped == skipped
}

/// Reads `count` requests and returns their replies, in order.
fn replies(peer: &mut TcpStream, count: usize, status: Status) -> Vec<Vec<u8>> {
    let mut reader = FrameReader::new();
    let mut out = Vec::new();
    while out.len() < count {
        let n = peer.read(reader.space()).unwrap();
        reader.commit(n);
        while let Some(frame) = reader.next_frame().unwrap() {
            let request = frame.as_request().unwrap();
            let mut bytes = [0; MAX_FRAME_LEN];
            let n = ReplyData::None.emit(&mut bytes, &request, status).unwrap();
            out.push(bytes[..n].to_vec());
        }
    }
    out
}

fn poll_until(link: &mut TcpLink, now_ns: u64, done: impl Fn(&LinkInput) -> bool) -> LinkInput {
    for _ in 0..2000 {
        let seen = link.poll(now_ns);
        if done(&seen) {
            return seen;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("nothing came");
}

#[test]
fn late_replies_are_matched_by_id_and_status_bits_add_up() {
    let (mut link, mut peer) = pair();
    let setpoint = Command::ServoJoint(JointVector::splat(0.1));
    for k in 0..3 {
        assert!(sends(&mut link, &[setpoint], 1000 * k));
    }
    assert_eq!(link.poll(5000).unanswered_ns, 5000);
    let mut answers = replies(&mut peer, 3, Status(0));
    answers[1][7] = Status::WARNING;
    // The second one overtakes the first, which holds nothing up any more.
    peer.write_all(&answers[1]).unwrap();
    let seen = poll_until(&mut link, 7000, |s| s.status.is_some());
    assert_eq!((seen.reply_ns, seen.unanswered_ns), (6000, 5000));
    assert_eq!((seen.out_of_order, seen.unanswered), (1, 1));
    assert!(seen.status.unwrap().has_warning());
    for k in [0, 2, 2] {
        peer.write_all(&answers[k]).unwrap();
    }
    let mut counts = (0, 0);
    while counts.1 == 0 {
        let seen = poll_until(&mut link, 9000, |s| {
            s.status.is_some() || s.duplicates + s.out_of_order > 0
        });
        counts = (counts.0 + seen.out_of_order, counts.1 + seen.duplicates);
    }
    assert_eq!(counts, (1, 1));
    assert_eq!(link.poll(9000).unanswered_ns, 0);
}

#[test]
fn setpoints_neither_bunch_nor_pile_up_but_a_stop_always_goes_out() {
    let (mut link, peer) = pair();
    let q = Command::ServoJoint(JointVector::ZERO);
    link.settings = LinkSettings::new(3, 4_000_000);
    assert_eq!(link.settings.min_gap_ns, 3_200_000);
    let at = |us: u64| 1_000_000_000 + us * 1000;
    assert!(sends(&mut link, &[q], at(0)));
    assert!(!sends(&mut link, &[q], at(3_100)));
    assert!(sends(&mut link, &[q], at(3_200)));
    assert!(sends(&mut link, &[q], at(8_000)));
    assert!(!sends(&mut link, &[q], at(12_000)));
    let stop = Command::SetState(StateRequest::Stop);
    assert!(sends(&mut link, &[stop], at(12_000)));
    let seen = link.poll(at(16_000));
    assert_eq!((seen.skipped, seen.unanswered), (2, 4));
    assert_eq!(seen.unanswered_ns, 16_000_000);
    drop(peer);
    assert!(poll_until(&mut link, 1, |s| s.lost).lost);
}

#[test]
fn a_setpoint_and_a_stop_leave_in_one_write_behind_a_rest_only_the_stop() {
    let (mut link, mut peer) = pair();
    let q = Command::ServoJoint(JointVector::splat(0.2));
    let stop = Command::SetState(StateRequest::Stop);
    assert!(sends(&mut link, &[q, stop], 1000));
    assert_eq!(replies(&mut peer, 2, Status(0)).len(), 2);
    let mut frame = [0; MAX_FRAME_LEN];
    let n = emit_command(&mut frame, 3, Protocol::PrivateHeartbeat, &q).unwrap();
    link.stream.write_all(&frame[..10]).unwrap();
    link.rest = heapless::Vec::from_slice(&frame[10..n]).unwrap();
    link.in_flight.sent(2000);
    assert!(!sends(&mut link, &[q, stop], 3000));
    let answers = replies(&mut peer, 2, Status(0));
    let ids: Vec<u8> = answers.iter().map(|a| a[1]).collect();
    let registers: Vec<u8> = answers.iter().map(|a| a[6]).collect();
    assert_eq!((ids, registers[1]), (vec![3, 4], 12));
    assert!(link.rest.is_empty());
    assert_eq!(link.poll(4000).skipped, 1);
}

/// A wire that takes the first bytes only, then nothing.
struct Narrow {
    left: usize,
    taken: Vec<u8>,
    writes: usize,
}

impl ByteStream for Narrow {
    fn receive(&mut self, _: &mut [u8]) -> std::io::Result<(usize, Option<u64>)> {
        Err(ErrorKind::WouldBlock.into())
    }
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writes += 1;
        let taken = bytes.len().min(self.left);
        if taken == 0 {
            return Err(ErrorKind::WouldBlock.into());
        }
        self.left -= taken;
        self.taken.extend(&bytes[..taken]);
        Ok(taken)
    }
}

#[test]
fn wherever_the_network_stops_taking_whole_frames_in_order_come_out() {
    let q = Command::ServoJoint(JointVector::splat(0.2));
    let stop = Command::SetState(StateRequest::Stop);
    let mut frame = [0; MAX_FRAME_LEN];
    let whole = emit_command(&mut frame, 1, Protocol::PrivateHeartbeat, &q).unwrap();
    for left in 0..60 {
        let wire = Narrow {
            left,
            taken: Vec::new(),
            writes: 0,
        };
        let mut link = TcpLink::over(wire, LinkSettings::new(64, 5));
        let sent = sends(&mut link, &[q, stop], 1000);
        assert_eq!(sent, left > whole, "{left}");
        assert_eq!(link.stream.writes, 1);
        let begun = u16::from(left > 0) + u16::from(left > whole);
        assert_eq!(link.in_flight.open(), begun, "{left}");
        link.stream.left = 1000;
        link.send(&[], 2000).unwrap();
        link.send(&[q], 3000).unwrap();
        let mut reader = FrameReader::new();
        reader.feed(&link.stream.taken);
        let mut ids = Vec::new();
        while let Some(frame) = reader.next_frame().unwrap() {
            ids.push(frame.as_request().unwrap().transaction);
        }
        assert_eq!(ids, (1..=begun + 1).collect::<Vec<_>>(), "{left}");
    }
}

#[test]
fn a_silent_arm_is_asked_for_a_sign_and_then_given_up() {
    let (mut link, mut peer) = pair();
    let begin = now_ns();
    assert!(!link.poll(begin).lost, "the silence begins here");
    assert!(sends(&mut link, &[], begin));
    let later = begin + 31_000_000_000;
    assert!(!link.poll(later).lost);
    assert_eq!(link.in_flight.open(), 0);
    assert!(sends(&mut link, &[], later));
    let requested = replies(&mut peer, 1, Status(0));
    assert_eq!(requested[0][6], 13, "get state");
    assert!(link.poll(begin + 91_000_000_000).lost);
}

#[test]
fn garbage_breaks_the_link() {
    let (mut link, mut peer) = pair();
    peer.write_all(&[0xFF; 32]).unwrap();
    assert!(poll_until(&mut link, 1, |s| s.lost).lost);
}
