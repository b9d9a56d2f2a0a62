//! The socket for Foxglove, as Foxglove's own client meets it.

use super::fake::{Fake, run_folder};
use super::support::{Running, alone, missing};
use rustix::process::Signal;
use serde_json::Value;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;

const CLIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/foxglove.mjs");
/// What comes of a controller with a camera and an identified rope.
const TOPICS: [&str; 7] = [
    "/arm/measured",
    "/controller/cycles",
    "/tf",
    "/scene",
    "/camera/left/image",
    "/camera/left/calibration",
    "/wag/parameters",
];

fn client(url: &str, topics: &[&str]) -> Command {
    let mut client = Command::new("node");
    client.arg(CLIENT).arg(url).args(topics);
    client
}

/// Runs the client until it has seen these topics.
fn seen(url: &str, topics: &[&str]) -> Value {
    let output = client(url, topics).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}{text}");
    serde_json::from_str(&text).unwrap()
}

#[test]
fn foxglove_sees_all_topics_with_their_schemas_and_can_do_nothing() {
    let _alone = alone();
    if missing::named("WAG_NODE_MODULES", "folder of Node modules").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let fake = Fake::start(&format!("foxglove-{}", std::process::id()));
    run_folder(folder.path(), &fake.domain);
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/camera/example");
    for (from, to) in [("toml", "camera.toml"), ("conf", "example.conf")] {
        std::fs::copy(format!("{camera}.{from}"), folder.path().join(to)).unwrap();
    }
    let run = folder.path().display();
    let (mut watch, reported) = Running::start(&format!("watch {run} --foxglove 127.0.0.1:0"));
    let url = reported["foxglove"].as_str().unwrap();
    let seen = seen(url, &TOPICS);
    assert_eq!(seen["server"]["name"], "wag");
    assert_eq!(seen["server"]["capabilities"], serde_json::json!([]));
    let channels = seen["channels"].as_object().unwrap();
    // All but the exact recording.
    assert_eq!(channels.len(), run_log::Channel::all().count() - 1);
    for (topic, channel) in channels {
        assert_eq!(channel["encoding"], "json", "{topic}");
        assert_eq!(channel["schemaEncoding"], "jsonschema", "{topic}");
        assert_eq!(channel["schemaName"], channel["title"], "{topic}");
    }
    let message = |topic: &str| &seen["messages"][topic]["message"];
    assert_eq!(
        message("/arm/measured")["joints"].as_array().unwrap().len(),
        7
    );
    assert_eq!(message("/controller/cycles")["mode"], "Streaming");
    assert_eq!(message("/camera/left/image")["format"], "jpeg");
    assert!(message("/wag/parameters")["parameters"]["length_m"].is_f64());
    // The message's own time, and the one that it is sent under.
    let told = &message("/arm/measured")["timestamp"];
    let [sec, nsec] = ["sec", "nsec"].map(|part| told[part].as_u64().unwrap());
    let under = seen["messages"]["/arm/measured"]["timestamp"].as_str();
    assert_eq!(under.unwrap(), (sec * 1_000_000_000 + nsec).to_string());
    // It was refused to publish, and nothing came of it.
    assert!(!seen["statuses"].as_array().unwrap().is_empty(), "{seen}");
    let wires = &fake.wires;
    let asked = [&wires.stops, &wires.disarms].map(|n| n.load(Ordering::SeqCst));
    assert_eq!(asked, [0, 0]);
    assert_eq!(watch.end(Signal::INT).0, Some(0));
}

#[test]
fn clients_and_sockets_that_are_killed_leave_nothing_in_the_way() {
    let _alone = alone();
    if missing::named("WAG_NODE_MODULES", "folder of Node modules").is_none() {
        return;
    }
    let fake = Fake::start(&format!("foxglove-kill-{}", std::process::id()));
    let options = format!("watch --domain {} --foxglove 127.0.0.1:0", fake.domain);
    let topics = ["/arm/measured", "/camera/left/image"];
    // More than may listen at once.
    for _ in 0..8 {
        let (mut watch, reported) = Running::start(&options);
        let url = reported["foxglove"].as_str().unwrap();
        seen(url, &topics);
        let mut killed = client(url, &["/never"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        killed.kill().unwrap();
        killed.wait().unwrap();
        seen(url, &topics);
        watch.kill();
    }
    let (mut watch, reported) = Running::start(&options);
    seen(reported["foxglove"].as_str().unwrap(), &topics);
    assert_eq!(watch.end(Signal::INT).0, Some(0));
}
