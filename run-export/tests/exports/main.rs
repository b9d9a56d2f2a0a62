//! Runs as tables, arrays and bags: their values as the published libraries read them, what is
//! refused, and what is left behind.
#![cfg(test)]

#[path = "../../../hil-tests/support/missing.rs"]
mod missing;
mod small;

use run_export::{Write, csv, npz, ros2};
use run_log::{Channel, files};
use serde_json::json;
use std::fs;
use std::path::Path;
use std::process::Command;

/// What an export that must fail as wrong input says.
fn refused(write: Write, run: &Path, out: &Path) -> String {
    let failure = write(run, Some(out)).unwrap_err();
    assert_eq!(failure.exit_code(), 2, "{failure}");
    failure.to_string()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn other_libraries_find_the_values_of_the_run() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let before = names_in(&run);
    let written = [csv, npz, ros2].map(|write: Write| write(&run, None).unwrap());
    let count = |of: usize| written[of].files[0].count;
    assert_eq!([count(0), count(1)], [small::CYCLES, 38]);
    let [moving, pictures] = [small::CYCLES, small::PICTURES];
    // Both kinds of joints, places of links and camera, pictures with their cameras, keypoints, log.
    assert_eq!(count(2), 3 * moving + 1 + 2 * pictures + pictures + 2);
    assert_eq!(names_in(&run.join("ros2")), ["metadata.yaml", "run_0.mcap"]);
    assert!(written.iter().all(|written| written.missing.is_empty()));
    // The same run makes the same bytes, also in place of what was there.
    let files = ["run.npz", "ros2/metadata.yaml", "ros2/run_0.mcap"];
    let bytes = || files.map(|file| fs::read(run.join(file)).unwrap());
    let once = bytes();
    for write in [npz, ros2] {
        write(&run, None).unwrap();
    }
    assert!(bytes() == once);
    let exported = ["cycles.csv", "joints.csv", "ros2", "run.npz"].map(str::to_owned);
    let mut all = [before, exported.to_vec()].concat();
    all.sort();
    assert_eq!(names_in(&run), all);

    let python = missing::named("WAG_SDK_PYTHON", "Python with mcap, numpy and rosbags");
    let Some(python) = python else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-exports");
    let mut python = Command::new(python);
    let python = python.arg(script).args([&run, &run]);
    let output = python
        .args(["/joint_states", "/tf_static", "/camera/left/camera_info"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    print!("{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn what_is_no_earlier_export_is_not_replaced_and_nothing_is_left() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let bag = place.path().join("bag");
    ros2(&run, Some(&bag)).unwrap();
    fs::write(bag.join("notes.txt"), "mine").unwrap();
    let said = refused(ros2, &run, &bag);
    assert!(said.contains("bag") && said.contains("--out"), "{said}");
    // A bag that somebody recorded looks like one of these.
    fs::remove_file(bag.join("notes.txt")).unwrap();
    let text = fs::read_to_string(bag.join("metadata.yaml")).unwrap();
    let (_mark, others) = text.split_once('\n').unwrap();
    fs::write(bag.join("metadata.yaml"), others).unwrap();
    refused(ros2, &run, &bag);
    assert_eq!(names_in(&bag), ["metadata.yaml", "run_0.mcap"]);
    // No file, and no place for one.
    assert!(refused(npz, &run, &bag).contains("it is a folder"));
    let under_a_file = run.join(files::RUN).join("a.npz");
    assert!(refused(npz, &run, &under_a_file).contains(files::RUN));
    // The run's own recording, and what others wrote.
    let before = fs::read(run.join(files::RUN)).unwrap();
    refused(npz, &run, &run.join(files::RUN));
    assert!(fs::read(run.join(files::RUN)).unwrap() == before);
    fs::write(place.path().join("mine.npz"), "PK\u{3}\u{4} of mine").unwrap();
    refused(npz, &run, &place.path().join("mine.npz"));
    assert_eq!(names_in(place.path()), ["bag", "mine.npz", "run"]);
}

#[test]
fn a_run_without_messages_or_with_a_foreign_one_is_refused_by_name() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let only = |name: &str, channel: Channel, message: serde_json::Value| {
        fs::create_dir(at(name)).unwrap();
        let mut file = run_log::McapFile::create(&at(name).join(files::RUN)).unwrap();
        file.json(channel, 1_500_000_000, &message).unwrap();
        file.finish().unwrap();
    };
    let out = at("out");
    only("nothing", Channel::Summary, json!({}));
    let said = refused(ros2, &at("nothing"), &out);
    assert!(
        said.contains("nothing") && said.contains("no message"),
        "{said}"
    );
    only("foreign", Channel::Measured, json!({ "joints": 7 }));
    let said = refused(ros2, &at("foreign"), &out);
    let words = ["foreign/run.mcap", "/arm/measured", "1500000000 ns"];
    assert!(words.iter().all(|word| said.contains(word)), "{said}");
    assert!(refused(ros2, &at("none"), &out).contains("does not exist"));
    assert!(refused(ros2, place.path(), &out).contains("run.mcap"));
    fs::write(at("notvideo.avi"), "RIFF").unwrap();
    let said = refused(ros2, &at("notvideo.avi"), &out);
    assert!(
        said.contains("notvideo.avi") && said.contains("not an MCAP file"),
        "{said}"
    );
    fs::remove_file(at("notvideo.avi")).unwrap();
    assert!(refused(npz, &at("nothing"), &out).contains("nothing"));
    // What is there is written, what is not is told.
    let line = json!({ "level": 2, "message": "x", "name": "n" });
    only("quiet", Channel::Log, line);
    let written = ros2(&at("quiet"), Some(&out)).unwrap();
    assert_eq!(written.files[0].count, 1);
    assert!(written.missing.contains(&"/joint_states".to_owned()));
    assert_eq!(
        names_in(place.path()),
        ["foreign", "nothing", "out", "quiet"]
    );
}

#[test]
fn a_run_that_breaks_off_is_exported_as_far_as_it_goes() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let path = run.join(files::RUN);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let failure = ros2(&run, None).unwrap_err();
    assert!(failure.to_string().contains("no message"), "{failure}");
    // Up to the record that ends the data, which lies before the index.
    let index = u64::from_le_bytes(*bytes[bytes.len() - 28..].first_chunk().unwrap());
    fs::write(&path, &bytes[..usize::try_from(index).unwrap() - 5]).unwrap();
    for write in [csv, npz, ros2] {
        let told = write(&run, None).unwrap().missing;
        assert!(
            matches!(&told[..], [only] if only.contains("breaks off")),
            "{told:?}"
        );
    }
}
