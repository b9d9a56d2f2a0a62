//! The publisher for ROS 2, as another implementation of DDS meets it.
#![cfg(test)]

#[path = "../../../hil-tests/support/missing.rs"]
mod missing;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use run_log::{Channel, Sink};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};
use telemetry::{Domain, Publisher};

/// On this machine alone, whatever networks it has and whether they pass on what is for many.
const LOOPBACK: &str = "<CycloneDDS><Domain><General><Interfaces>\
    <NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>\
    <AllowMulticast>false</AllowMulticast></General><Discovery>\
    <ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"127.0.0.1\"/></Peers>\
    </Discovery></Domain></CycloneDDS>";
const AT_NS: u64 = 1_700_000_000_250_000_000;
/// Many times what fits into one packet.
const PICTURE: usize = 200_000;
/// Of that picture.
const SHA_256: &str = "a45477d9b0449be9fc0229ca0f104e8c0a389ddf9768221b3a34beb0287e92f7";
/// Between two messages of a topic.
const PERIOD: Duration = Duration::from_millis(20);

/// One of each process and test. From 102 on a domain's ports are those that the system gives to
/// whoever asks for any.
fn domain(test: u32) -> u32 {
    1 + (2 * std::process::id() + test) % 100
}

/// One that only this machine hears: what is told is invented.
fn published(domain: u32) -> Publisher {
    let domain = Domain {
        is_local: true,
        ..Domain::of(Some(domain)).unwrap()
    };
    Publisher::start(domain).unwrap()
}

/// A run that goes on, told in a thread.
struct Told {
    ended: Arc<AtomicBool>,
    /// Longest time that one turn's messages took since it was last asked for (µs).
    longest_us: Arc<AtomicU64>,
    thread: JoinHandle<()>,
}

impl Told {
    fn start(mut publisher: Publisher) -> Self {
        // Told once, before anybody listens.
        let line = json!({ "level": 4, "message": "stopped: é", "name": "rt-controller" });
        let once = [
            (Channel::Calibration, eye()),
            (Channel::Frames, transforms("camera_left")),
            (Channel::Log, line),
            // ROS has no type for it.
            (Channel::Summary, json!({ "ok": true })),
        ];
        for (channel, message) in &once {
            publisher.message(*channel, AT_NS, message).unwrap();
        }
        let ended = Arc::new(AtomicBool::new(false));
        let longest_us = Arc::new(AtomicU64::new(0));
        let (end, longest) = (Arc::clone(&ended), Arc::clone(&longest_us));
        let thread = std::thread::spawn(move || {
            while !end.load(Ordering::Relaxed) {
                let began = Instant::now();
                for (channel, message) in turn() {
                    publisher.message(channel, AT_NS, &message).unwrap();
                }
                let took_us = u64::try_from(began.elapsed().as_micros()).unwrap();
                longest.fetch_max(took_us, Ordering::Relaxed);
                sleep(PERIOD);
            }
        });
        Self {
            ended,
            longest_us,
            thread,
        }
    }

    fn longest(&self) -> Duration {
        Duration::from_micros(self.longest_us.swap(0, Ordering::Relaxed))
    }

    fn end(self) {
        self.ended.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
    }
}

fn picture() -> Vec<u8> {
    (0..PICTURE).map(|i| (i * i % 251) as u8).collect()
}

fn turn() -> Vec<(Channel, Value)> {
    let measured = json!({ "joints": [
        { "name": "joint1", "position": 0.5, "velocity": -0.25 }, { "name": "joint2", "position": 1.5 },
    ] });
    let commanded = json!({ "joints": [{ "name": "joint1", "position": 0.75 }] });
    let image = json!({
        "frame_id": "camera_left", "data": STANDARD.encode(picture()), "format": "jpeg",
    });
    let drawn = json!({
        "points": [{ "x": 3.5, "y": 4.75 }], "thickness": 4.0,
        "outline_color": { "r": 1.0, "g": 0.5, "b": 0.0, "a": 1.0 },
    });
    vec![
        (Channel::Measured, measured),
        (Channel::Commanded, commanded),
        (Channel::Frames, transforms("link1")),
        (Channel::Image, image),
        (Channel::Keypoints, json!({ "points": [drawn] })),
    ]
}

fn transforms(child: &str) -> Value {
    json!({ "transforms": [{
        "parent_frame_id": "base", "child_frame_id": child,
        "translation": { "x": 0.25, "y": -0.5, "z": 1.0 },
        "rotation": { "x": 0.5, "y": -0.5, "z": 0.5, "w": -0.5 },
    }] })
}

fn eye() -> Value {
    json!({
        "width": 640, "height": 360, "distortion_model": "plumb_bob", "D": [-0.125, 0.5],
        "K": [500.0, 0.0, 320.5, 0.0, 501.0, 180.5, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [500.0, 0.0, 320.5, 0.0, 0.0, 501.0, 180.5, 0.0, 0.0, 0.0, 1.0, 0.25],
    })
}

/// A reader that is there, and what it has read.
fn reader(python: &str, domain: u32, mode: &str) -> (Child, Value) {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/reader.py");
    let mut reader = Command::new(python)
        .args([script, &domain.to_string(), mode])
        .env("CYCLONEDDS_URI", LOOPBACK)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let mut output = BufReader::new(reader.stdout.take().unwrap());
    output.read_line(&mut line).unwrap();
    let read = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: `{line}`"));
    (reader, read)
}

fn is_as_told(read: &Value) {
    let first = &read["first"];
    let topic = |name: &str| first[format!("rt/{name}")].clone();
    let stamp = json!({ "sec": 1_700_000_000, "nanosec": 250_000_000 });
    let header = |frame: &str| json!({ "stamp": stamp, "frame_id": frame });
    let measured = topic("joint_states");
    assert_eq!(measured["header"], header(""));
    assert_eq!(measured["name"], json!(["joint1", "joint2"]));
    assert_eq!(measured["position"], json!([0.5, 1.5]));
    assert_eq!(measured["velocity"], json!([-0.25, "NaN"]));
    assert_eq!(topic("joint_setpoints")["position"], json!([0.75]));
    for (name, child) in [("tf", "link1"), ("tf_static", "camera_left")] {
        let frame = &topic(name)["transforms"][0];
        assert_eq!(frame["header"], header("base"));
        assert_eq!(frame["child_frame_id"], child);
        let turned = json!({ "x": 0.5, "y": -0.5, "z": 0.5, "w": -0.5 });
        assert_eq!(frame["transform"]["rotation"], turned);
    }
    let image = topic("camera/left/image/compressed");
    assert_eq!(image["header"], header("camera_left"));
    assert_eq!(image["data"][0], PICTURE);
    assert_eq!(image["data"][1], SHA_256);
    let camera = topic("camera/left/camera_info");
    assert_eq!([&camera["width"], &camera["height"]], [640, 360]);
    assert_eq!(camera["k"], eye()["K"]);
    assert_eq!(camera["p"], eye()["P"]);
    assert_eq!(camera["roi"]["do_rectify"], false);
    let marker = topic("camera/left/keypoints");
    assert_eq!(marker["points"], json!([{ "x": 3.0, "y": 4.25, "z": 0.0 }]));
    let line = topic("rosout");
    assert_eq!(line["msg"], "stopped: é");
    assert_eq!(line["level"], 40);
    // What was told once comes once.
    let counts = &read["counts"];
    assert_eq!([&counts["rt/tf_static"], &counts["rt/rosout"]], [1, 1]);
    assert_eq!(read["offers"], offers(), "{}", read["offers"]);
    assert_eq!(read["takes"], json!([]));
}

/// Topic, type, whether it is reliable and whether late readers get it.
fn offers() -> Value {
    let of = |topic: &str, kind: &str, reliable: bool, latched: bool| {
        json!([format!("rt/{topic}"), kind, reliable, latched])
    };
    let joints = "sensor_msgs::msg::dds_::JointState_";
    let frames = "tf2_msgs::msg::dds_::TFMessage_";
    json!([
        of(
            "camera/left/camera_info",
            "sensor_msgs::msg::dds_::CameraInfo_",
            false,
            false
        ),
        of(
            "camera/left/image/compressed",
            "sensor_msgs::msg::dds_::CompressedImage_",
            false,
            false
        ),
        of(
            "camera/left/keypoints",
            "visualization_msgs::msg::dds_::ImageMarker_",
            true,
            false
        ),
        of("joint_setpoints", joints, true, false),
        of("joint_states", joints, true, false),
        of("rosout", "rcl_interfaces::msg::dds_::Log_", true, true),
        of("tf", frames, true, false),
        of("tf_static", frames, true, true),
    ])
}

#[test]
fn cyclone_dds_reads_every_topic_late_and_after_another_was_killed() {
    let Some(python) = missing::named("WAG_SDK_PYTHON", "Python with cyclonedds") else {
        return;
    };
    let python = python.to_str().unwrap();
    let domain = domain(0);
    let told = Told::start(published(domain));
    let (mut killed, read) = reader(python, domain, "until-killed");
    is_as_told(&read);
    told.longest();
    // It says nothing any more, and then does not even end.
    killed.kill().unwrap();
    killed.wait().unwrap();
    sleep(Duration::from_secs(3));
    let longest = told.longest();
    println!("longest turn of messages after a reader was killed: {longest:?}");
    assert!(longest < Duration::from_millis(500), "{longest:?}");
    let (mut second, read) = reader(python, domain, "once");
    is_as_told(&read);
    assert!(second.wait().unwrap().success());
    told.end();
}

#[test]
fn a_domain_that_is_none_is_refused_by_its_number() {
    let said = format!("{:#}", Domain::of(Some(233)).unwrap_err());
    assert!(said.contains("233") && said.contains("0 to 232"), "{said}");
}

#[test]
fn a_message_that_is_not_as_a_run_has_it_is_refused() {
    let mut publisher = published(domain(1));
    let foreign = publisher.message(Channel::Measured, AT_NS, &json!({ "joints": 7 }));
    assert!(foreign.is_err());
    assert!(publisher.wants(Channel::Measured) && !publisher.wants(Channel::Plan));
}
