//! A small run with everything that an export reads, as `wag run` and its recorder leave it.

use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector, Limits};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rt_controller::control::{ControlState, Thresholds};
use rt_controller::recording::{ChunkWriter, RecordedCycle, Snapshot};
use run_log::{Channel, McapFile, files};
use serde_json::{Value, json};
use shared_types::ipc::{ControllerMode, JointReport};
use shared_types::keypoints::TrackedFrame;
use shared_types::plan::trajectory_hash_hex;
use shared_types::{FaultCode, KeypointTrack};
use std::fs;
use std::path::Path;

/// Control cycles, each with a setpoint, a joint report and the places of the links.
pub(crate) const CYCLES: u64 = 40;
/// Pictures, each with keypoints.
pub(crate) const PICTURES: u64 = 5;
/// When it began (CLOCK_MONOTONIC, ns), and how far the wall clock was ahead (ns).
const BEGIN_NS: u64 = 7_000_000_123;
const AHEAD_NS: u64 = 1_700_000_000_000_000_001;
/// A rotation other than none, so that it is told from the intrinsics.
const TURNED: [f64; 9] = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
const NINE: [f64; 9] = [500.0, 0.0, 320.5, 0.0, 501.0, 180.5, 0.0, 0.0, 1.0];

/// Writes it into a folder that is not there yet.
pub(crate) fn write(folder: &Path) {
    fs::create_dir(folder).unwrap();
    let write = |name: &str, value: &Value| files::write_json(&folder.join(name), value).unwrap();
    write(files::SUMMARY, &json!({ "ok": true, "epoch_ns": BEGIN_NS }));
    let middle = START_POSE + JointVector([0.01; 7]);
    let motion = JointTrajectory::new(&[0.0, 0.5, 1.0], &[START_POSE, middle, START_POSE]).unwrap();
    let rope = json!({
        "links": 23, "length_m": 0.55, "joint_damping_nms_per_rad": 1e-4,
        "joint_stiffness_nm_per_rad": 0.01, "radius_m": 0.004, "mass_per_length_kg_per_m": 0.05,
        "lead_mass_kg": 0.02, "lead_radius_m": 0.01, "link_extra_scale": 0.5,
    });
    let plan = json!({
        "version": "0", "seed": 5, "task": "strike", "target_m": [0.9, 0.1, 0.0], "rope": rope,
        "trajectory": motion, "predicted_error_m": 0.0125, "predicted_time_s": 0.9,
        "fitness": -1.0, "simulations": 1, "resampled": 0, "margins": [],
        "trajectory_sha256": trajectory_hash_hex(&motion),
    });
    write(files::PLAN, &plan);
    let rows = rope.as_object().unwrap().iter();
    let rows: Vec<_> = rows
        .map(|(key, value)| format!("{key} = {value}\n"))
        .collect();
    fs::write(folder.join(files::ROPE), rows.concat()).unwrap();
    let frame = |number: u32| TrackedFrame {
        t_s: f64::from(number) / 60.0,
        points: (0..4)
            .map(|i| [f64::from(i) + 0.125, f64::from(number)])
            .collect(),
        confidence: vec![0.5, 0.75, 1.0, 0.25],
        lost: number == 2,
    };
    let track = KeypointTrack {
        keypoints: 4,
        frames: (0..6).map(frame).collect(),
        unconfirmed: vec!["it swings – by 7°".to_owned()],
    };
    files::write_json(&folder.join(files::KEYPOINTS), &track).unwrap();
    record(&folder.join(files::RUN));
}

fn at_ns(cycle: u64) -> u64 {
    BEGIN_NS + cycle * 4_000_000
}

/// Joints that no other cycle has.
fn joints(cycle: u64, scale: f64) -> JointVector {
    JointVector(std::array::from_fn(|joint| {
        scale * (cycle as f64 + 0.1 * joint as f64).sin()
    }))
}

fn record(path: &Path) {
    let mut file = McapFile::create(path).unwrap();
    let control = ControlState::new(Limits::default(), Thresholds::strict());
    let mut writer = ChunkWriter::default();
    writer.keyframe(&Snapshot::of(&control).unwrap());
    film(&mut file);
    for cycle in 0..CYCLES {
        let wall_ns = AHEAD_NS + at_ns(cycle);
        let one = cycle_of(cycle);
        if let Some(chunk) = writer.cycle(&one) {
            file.bytes(Channel::Replay, wall_ns, chunk).unwrap();
        }
        let (measured, commanded) = (
            told(&joints(cycle, 1.0), true),
            told(&one.record.q_c, false),
        );
        file.json(Channel::Measured, wall_ns, &measured).unwrap();
        file.json(Channel::Commanded, wall_ns, &commanded).unwrap();
        let place = joints(cycle, 0.3);
        let links = json!({ "transforms": [
            transform("base", "link1", place[0]), transform("base", "pole_end", place[1]),
        ] });
        file.json(Channel::Frames, wall_ns, &links).unwrap();
    }
    if let Some(chunk) = writer.flush() {
        file.bytes(Channel::Replay, 1, chunk).unwrap();
    }
    for (level, text) in [(2, "mode Streaming"), (4, "stopped in cycle 9: é")] {
        let line = json!({
            "level": level, "message": text, "name": "rt-controller", "file": "", "line": 0,
        });
        // Later in the file than in time.
        file.json(Channel::Log, AHEAD_NS + at_ns(9), &line).unwrap();
    }
    scene(&mut file);
    file.finish().unwrap();
}

fn cycle_of(cycle: u64) -> RecordedCycle {
    let mut one = RecordedCycle::default();
    (one.input.cycle, one.record.cycle) = (cycle, cycle);
    one.record.deadline_ns = at_ns(cycle);
    one.record.mode = if cycle < 20 {
        ControllerMode::Idle as u8
    } else {
        ControllerMode::Streaming as u8
    };
    one.record.fault = u16::from(cycle == 30) * FaultCode::OperatorStop as u16;
    one.record.sent = u8::from(!cycle.is_multiple_of(3));
    (one.record.wake_late_ns, one.record.send_ns) = (12_300, 45_600);
    one.record.trajectory_s = cycle as f64 * 0.004 - 0.08;
    one.record.q_c = joints(cycle, 0.9);
    let mut report = JointReport {
        stamp_ns: at_ns(cycle) - 1_234_567,
        arrival_ns: at_ns(cycle) - 1_000_000,
        ..JointReport::default()
    };
    (report.q, report.qd) = (joints(cycle, 1.0), joints(cycle, 2.0));
    report.q_target = joints(cycle, 0.9);
    one.input.reports.push(report);
    one
}

/// What an arm tells that has lost the speed of its third joint.
fn told(q: &JointVector, has_speed: bool) -> Value {
    let joint = |i: usize| {
        let mut joint = json!({ "name": format!("joint{}", i + 1), "position": q[i] });
        if has_speed && i != 2 {
            joint["velocity"] = json!(0.5 * q[i]);
        }
        joint
    };
    json!({ "joints": (0..7).map(joint).collect::<Vec<_>>() })
}

fn transform(parent: &str, child: &str, x: f64) -> Value {
    json!({
        "parent_frame_id": parent, "child_frame_id": child,
        "translation": { "x": x, "y": -0.25, "z": 0.5 },
        "rotation": { "x": 0.5, "y": -0.5, "z": 0.5, "w": x },
    })
}

fn colour() -> Value {
    json!({ "r": 1.0, "g": 0.6, "b": 0.0, "a": 1.0 })
}

/// A line and a ball in the pole's frame, in place of what was there.
fn scene(file: &mut McapFile) {
    let wall_ns = AHEAD_NS + BEGIN_NS;
    let at = |x: f64| json!({ "x": x, "y": -0.25, "z": 1e-7 });
    let pose = json!({
        "position": at(0.125), "orientation": { "x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5 },
    });
    let line = json!({
        "type": 2, "pose": pose, "thickness": 0.004, "scale_invariant": false, "color": colour(),
        "points": [at(0.0), at(0.1)], "colors": [], "indices": [1, 0],
    });
    let entity = json!({
        "frame_id": "pole_end", "id": "rope", "lifetime": { "sec": -1, "nsec": 500_000_000 },
        "frame_locked": true, "metadata": [{ "key": "k", "value": "é" }], "arrows": [],
        "cubes": [], "spheres": [{ "pose": pose, "size": at(0.02), "color": colour() }],
        "cylinders": [], "lines": [line], "triangles": [], "texts": [], "models": [],
    });
    let then = json!({ "sec": 1_700_000_007, "nsec": 124 });
    let update = json!({
        "deletions": [{ "timestamp": then, "type": 1, "id": "" }], "entities": [entity],
    });
    file.json(Channel::Scene, wall_ns, &update).unwrap();
    let plan = json!({ "timestamp": then, "plan": { "target_m": [0.9, 0.1, 0.0] } });
    file.json(Channel::Plan, wall_ns, &plan).unwrap();
    let urdf = b"<?xml version=\"1.0\"?><robot/>";
    file.attach(wall_ns, "robot.urdf", "application/xml", urdf)
        .unwrap();
    let table = [("wall_minus_monotonic_ns", AHEAD_NS.to_string())];
    file.metadata("wag", &table).unwrap();
}

/// A camera that is told, with its pictures and what was tracked in them: nothing in one.
fn film(file: &mut McapFile) {
    let wall_ns = AHEAD_NS + BEGIN_NS;
    let eye = json!({
        "frame_id": "camera_left", "width": 640, "height": 360, "distortion_model": "plumb_bob",
        "D": [-0.17, 0.02, 4e-4, -3e-4, -0.002], "K": NINE, "R": TURNED,
        "P": [500.0, 0.0, 320.5, 0.0, 0.0, 501.0, 180.5, 0.0, 0.0, 0.0, 1.0, 0.25],
    });
    file.json(Channel::Calibration, wall_ns, &eye).unwrap();
    let stands = json!({ "transforms": [transform("base", "camera_left", 1.5)] });
    file.json(Channel::Frames, wall_ns, &stands).unwrap();
    for picture in 0..PICTURES {
        let wall_ns = wall_ns + picture * 33_333_333;
        // Of any length, and no picture at all: it is passed on as it is.
        let data: Vec<u8> = (0..100 + picture)
            .map(|i| (i * (picture + 1) % 251) as u8)
            .collect();
        let image = json!({
            "frame_id": "camera_left", "data": STANDARD.encode(data), "format": "jpeg",
        });
        file.json(Channel::Image, wall_ns, &image).unwrap();
        let point = |i: u64| json!({ "x": 10.5 + i as f64 / 8.0, "y": 20.25 + picture as f64 });
        let points: Vec<_> = (0..4).filter(|_| picture != 3).map(point).collect();
        let drawn = |kind: u32| {
            json!({
                "type": kind, "points": points, "thickness": 4.0, "outline_color": colour(),
                "outline_colors": [], "metadata": [],
            })
        };
        let seen = json!({ "circles": [], "points": [drawn(1), drawn(3)], "texts": [] });
        file.json(Channel::Keypoints, wall_ns, &seen).unwrap();
    }
}
