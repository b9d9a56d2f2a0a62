//! A run's MCAP file: walked, its film and recording taken out, made whole.

use crate::{folder, recording};
use run_log::{Channel, Run, RunFilm, recover};

/// Reads `data` as `run.mcap`, then makes it whole: once is enough.
pub fn run(data: &[u8]) {
    let path = folder().join("run.mcap");
    std::fs::write(&path, data).expect("a run file");
    if let Ok(film) = RunFilm::read(&path) {
        let _ = film.part(1);
    }
    if let Ok(recording) = Run::open(&path).and_then(|run| run.recording()) {
        let _ = (recording.log(), recording.cycles());
    }
    if recover(&path).is_ok() {
        let again = recover(&path).expect("what was written is read");
        assert!(again.was_whole, "{again:?}");
    }
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

fn record(opcode: u8, body: &[&[u8]]) -> Vec<u8> {
    let body = body.concat();
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], &body].concat()
}

/// Files as the format's specification has them, without chunks, whose checksums and compression
/// hide from a fuzzer what is inside: whole, cut off, with settings of a camera, and empty.
pub fn seeds() -> Vec<Vec<u8>> {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let none = 0_u32.to_le_bytes();
    let joints: Vec<String> = (1..=7)
        .map(|n| format!(r#"{{"name":"joint{n}","position":0.5}}"#))
        .collect();
    let joints = format!(r#"{{"joints":[{}]}}"#, joints.join(","));
    let cycle = |mode: &str| format!(r#"{{"mode":"{mode}"}}"#).into_bytes();
    let picture = br#"{"data":"/9j/2Q==","format":"jpeg"}"#.to_vec();
    let header = record(1, &[&text(""), &text("fuzz")]);
    let mut records = header.clone();
    let channels = [
        Channel::Measured,
        Channel::Cycles,
        Channel::Image,
        Channel::Replay,
    ];
    for (id, channel) in (1_u16..).zip(channels) {
        let (topic, coding) = (text(channel.topic()), text("json"));
        records.extend(record(
            4,
            &[&id.to_le_bytes(), &[0, 0], &topic, &coding, &none],
        ));
    }
    let recorded = recording::seeds().remove(0);
    let mut message = |id: u16, at_ms: u64, data: &[u8]| {
        let at = (at_ms * 1_000_000).to_le_bytes();
        records.extend(record(5, &[&id.to_le_bytes(), &none, &at, &at, data]));
    };
    message(2, 1_000, &cycle("Idle"));
    for at_ms in (1_004..1_100).step_by(8) {
        message(3, at_ms - 3, &picture);
        message(1, at_ms, joints.as_bytes());
        message(2, at_ms, &cycle("Streaming"));
    }
    message(2, 1_101, &cycle("Idle"));
    message(4, 1_102, &recorded);
    let pair = [text("json"), text("{}")].concat();
    let length = (pair.len() as u32).to_le_bytes();
    let camera = record(12, &[&text("camera"), &length, &pair]);
    let end = record(15, &[&none]);
    let whole = [MAGIC, &records, &end, MAGIC].concat();
    let cut = whole[..whole.len() / 2].to_vec();
    let of_camera = [MAGIC, &header, &camera, &end].concat();
    vec![whole, cut, of_camera, MAGIC.to_vec()]
}
