//! The socket for Foxglove, as Foxglove's own client meets it.

use super::client::Watch;
use super::fake::{Fake, run_folder};
use super::support::{Running, alone, missing};
use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

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

/// A client that is killed in the middle of what it is told.
fn killed_while_it_is_told(url: &str) {
    let mut client = client(url, &["/never"]);
    let client = client.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut client = client.spawn().unwrap();
    let mut said = String::new();
    let mut stderr = BufReader::new(client.stderr.take().unwrap());
    stderr.read_line(&mut said).unwrap();
    assert_eq!(said, "it tells\n");
    client.kill().unwrap();
    client.wait().unwrap();
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
    let (mut watch, reported) = Running::start(&format!("watch {run} --foxglove=127.0.0.1:0"));
    let url = reported["foxglove"].as_str().unwrap();
    let seen = seen(url, &TOPICS);
    assert_eq!(seen["server"]["name"], "wag");
    assert_eq!(seen["server"]["capabilities"], serde_json::json!([]));
    let channels = seen["channels"].as_object().unwrap();
    // All but the exact recording and the rope, which is simulated for the file.
    assert_eq!(
        channels.len(),
        run_log::Channel::with_schemas().unwrap().len() - 2
    );
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
    // It was refused to publish and to set anything, and nothing came of it.
    let refused = seen["statuses"].to_string();
    assert!(
        refused.contains("clientPublish") && refused.contains("parameters"),
        "{refused}"
    );
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
    let options = format!("watch --domain {} --foxglove=127.0.0.1:0", fake.domain);
    let topics = ["/arm/measured", "/camera/left/image"];
    // More than may listen at once.
    for _ in 0..8 {
        let (mut watch, reported) = Running::start(&options);
        let url = reported["foxglove"].as_str().unwrap();
        seen(url, &topics);
        killed_while_it_is_told(url);
        seen(url, &topics);
        watch.kill();
    }
    let (mut watch, reported) = Running::start(&options);
    seen(reported["foxglove"].as_str().unwrap(), &topics);
    assert_eq!(watch.end(Signal::INT).0, Some(0));
}

#[test]
fn what_begins_again_is_told_again_and_nobody_holds_the_end_up() {
    let _alone = alone();
    if missing::named("WAG_NODE_MODULES", "folder of Node modules").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let domain = format!("foxglove-again-{}", std::process::id());
    let fake = Fake::start(&domain);
    run_folder(folder.path(), &domain);
    let run = folder.path().display();
    // Two that look on: neither keeps alive what the other lets go.
    let page = Watch::start(&run.to_string());
    let (mut watch, reported) = Running::start(&format!("watch {run} --foxglove=127.0.0.1:0"));
    let url = reported["foxglove"].as_str().unwrap();
    let topics = ["/controller/cycles", "/arm/measured", "/scene"];
    seen(url, &topics);
    drop(fake);
    // Its figures come when it has ended, and are told all the same.
    std::fs::write(folder.path().join("summary.json"), "{\"ok\": true}").unwrap();
    assert_eq!(
        seen(url, &["/wag/summary"])["messages"]["/wag/summary"]["message"]["summary"]["ok"],
        true
    );
    // As long as one that looks on takes to let go.
    std::thread::sleep(Duration::from_secs(2));
    let again = Fake::start(&domain);
    seen(url, &topics);
    drop(again);
    // One that is connected and says nothing.
    let idle = TcpStream::connect(url.trim_start_matches("ws://")).unwrap();
    let began = Instant::now();
    assert_eq!(watch.end(Signal::INT).0, Some(0));
    assert!(began.elapsed() < Duration::from_secs(5));
    drop((idle, page));
}
