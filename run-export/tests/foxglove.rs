//! Runs with the messages of Foxglove's SDK in Protobuf: what another reader finds by the
//! descriptors in the file, which topics there are, and what is refused.
#![cfg(test)]

#[path = "../../hil-tests/support/missing.rs"]
mod missing;
#[path = "exports/small.rs"]
mod small;

use mcap::Summary;
use run_export::foxglove;
use run_log::{Channel, McapFile, files};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const FILE: &str = "run.foxglove.mcap";

fn small_run(place: &Path) -> PathBuf {
    let run = place.join("run");
    small::write(&run);
    run
}

/// Each topic of a file with the name of its schema, and how its messages are encoded.
fn topics(file: &Path) -> BTreeMap<String, (String, String)> {
    let summary = Summary::read(&fs::read(file).unwrap()).unwrap().unwrap();
    let channels = summary.channels.into_values();
    let told = |channel: std::sync::Arc<mcap::Channel<'_>>| {
        let schema = channel.schema.as_ref().map(|schema| schema.name.clone());
        let kind = (schema.unwrap_or_default(), channel.message_encoding.clone());
        (channel.topic.clone(), kind)
    };
    channels.map(told).collect()
}

#[test]
fn another_library_finds_the_messages_of_the_run() {
    let place = tempfile::tempdir().unwrap();
    let run = small_run(place.path());
    let written = foxglove(&run, None).unwrap();
    assert_eq!(written.files[0].path, run.join(FILE));
    // Joints, links, log; camera, pictures, keypoints; scene; and, in JSON, the plan.
    let converted = 3 * small::CYCLES + 2 + 2 + 2 * small::PICTURES + 1;
    assert_eq!(written.figures["protobuf"], converted);
    assert_eq!(written.files[0].count, converted + 1);
    let silent = [
        "/controller/cycles",
        "/rope/simulated",
        "/wag/parameters",
        "/wag/summary",
    ];
    let mut missing = written.missing;
    missing.sort();
    assert_eq!(missing, silent);
    // The same run makes the same bytes, also in place of what was there.
    let once = fs::read(run.join(FILE)).unwrap();
    foxglove(&run.join(files::RUN), None).unwrap();
    assert!(fs::read(run.join(FILE)).unwrap() == once);

    let python = missing::named(
        "WAG_SDK_PYTHON",
        "Python with mcap and mcap-protobuf-support",
    );
    let Some(python) = python else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-protobuf");
    let mut python = Command::new(python);
    let python = python
        .arg(script)
        .args([run.join(files::RUN), run.join(FILE)]);
    let output = python
        .args([
            "/arm/measured",
            "/camera/left/calibration",
            "/scene",
            "/wag/plan",
        ])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    print!("{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn all_topics_of_the_run_and_of_the_layout_are_there_but_for_the_replay() {
    let place = tempfile::tempdir().unwrap();
    let run = small_run(place.path());
    foxglove(&run, None).unwrap();
    let mut expected = topics(&run.join(files::RUN));
    expected.remove(Channel::Replay.topic()).unwrap();
    for (schema, encoding) in expected.values_mut() {
        let is_foxglove = schema.starts_with("foxglove.");
        *encoding = if is_foxglove { "protobuf" } else { "json" }.to_owned();
    }
    assert_eq!(topics(&run.join(FILE)), expected);
    // That it names no others is tested where the channels are.
    let layout = include_str!("../../configs/foxglove/wag.json");
    assert!(layout.contains(Channel::Measured.topic()));
    assert!(!layout.contains(Channel::Replay.topic()));
}

#[test]
fn what_cannot_be_exported_is_refused_by_name_and_nothing_is_written() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let only = |name: &str, channel: Channel, message: Value| {
        fs::create_dir(at(name)).unwrap();
        let mut file = McapFile::create(&at(name).join(files::RUN)).unwrap();
        file.json(channel, 1_500_000_000, &message).unwrap();
        file.finish().unwrap();
    };
    let refused = |run: &str, out: Option<&Path>| {
        let failure = foxglove(&at(run), out).unwrap_err();
        assert_eq!(failure.exit_code(), 2, "{failure}");
        assert!(!at(run).join(FILE).exists());
        failure.to_string()
    };
    only("foreign", Channel::Log, json!({ "level": 77 }));
    let said = refused("foreign", None);
    let words = ["foreign/run.mcap", "/log", "1500000000 ns", "`level`", "77"];
    assert!(words.iter().all(|word| said.contains(word)), "{said}");
    only("short", Channel::Log, json!({ "level": 2 }));
    let said = refused("short", None);
    assert!(said.contains("`message`"), "{said}");
    only("ours", Channel::Summary, json!({}));
    assert!(refused("ours", None).contains("no message"));
    assert!(refused("none", None).contains("does not exist"));
    let nowhere = at("ours/run.mcap/a.mcap");
    assert!(refused("ours", Some(&nowhere)).contains("run.mcap"));

    let run = small_run(place.path());
    let recording = fs::read(run.join(files::RUN)).unwrap();
    let itself = run.join("../run/run.mcap");
    assert!(refused("run", Some(&itself)).contains("--out"));
    assert!(fs::read(run.join(files::RUN)).unwrap() == recording);
    // What this program has written is replaced, what another has is not.
    foxglove(&run, None).unwrap();
    foxglove(&run, None).unwrap();
    let mine = at("mine.mcap");
    let theirs = mcap::WriteOptions::new().library("another");
    let file = fs::File::create(&mine).unwrap();
    theirs.create(file).unwrap().finish().unwrap();
    let failure = foxglove(&run, Some(&mine)).unwrap_err();
    assert!(
        failure.to_string().contains("no earlier export"),
        "{failure}"
    );
}

#[test]
fn a_run_that_breaks_off_is_exported_as_far_as_it_goes() {
    let place = tempfile::tempdir().unwrap();
    let run = small_run(place.path());
    let path = run.join(files::RUN);
    let bytes = fs::read(&path).unwrap();
    let whole = foxglove(&run, None).unwrap();
    // Up to the record that ends the data, which lies before the index.
    let index = u64::from_le_bytes(*bytes[bytes.len() - 28..].first_chunk().unwrap());
    fs::write(&path, &bytes[..usize::try_from(index).unwrap() - 5]).unwrap();
    let part = foxglove(&run, None).unwrap();
    assert_eq!(part.files[0].count, whole.files[0].count);
    assert!(part.missing[0].contains("breaks off"), "{:?}", part.missing);
    assert_eq!(part.missing[1..], whole.missing);
}
