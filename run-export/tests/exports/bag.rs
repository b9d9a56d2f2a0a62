//! Runs as bags of ROS 2.

use super::{break_off, exports, names_in, refused, small};
use run_export::ros2;
use run_log::{Channel, files};
use serde_json::json;
use std::fs;

#[test]
fn readers_of_bags_find_every_message_of_the_run() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let written = ros2(&run, None).unwrap();
    let [moving, pictures] = [small::CYCLES, small::PICTURES];
    // Both kinds of joints, places of links and camera, pictures with their cameras, keypoints, log.
    let count = 3 * moving + 1 + 2 * pictures + pictures + 2;
    assert_eq!(written.files[0].count, count);
    assert!(written.missing.is_empty());
    assert_eq!(names_in(&run.join("ros2")), ["metadata.yaml", "run_0.mcap"]);
    // The same run makes the same bytes, also in place of what was there.
    let files = ["ros2/metadata.yaml", "ros2/run_0.mcap"];
    let bytes = || files.map(|file| fs::read(run.join(file)).unwrap());
    let once = bytes();
    ros2(&run, None).unwrap();
    assert!(bytes() == once);
    for write in [run_export::csv, run_export::npz] {
        write(&run, None).unwrap();
    }
    exports::agree(
        &run,
        &["/joint_states", "/tf_static", "/camera/left/camera_info"],
    );
}

#[test]
fn what_is_no_earlier_bag_is_not_replaced_and_nothing_is_left() {
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
    assert_eq!(names_in(place.path()), ["bag", "run"]);
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
    assert!(refused(run_export::npz, &at("nothing"), &out).contains("nothing"));
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
fn a_run_that_breaks_off_is_a_bag_as_far_as_it_goes() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let path = run.join(files::RUN);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let failure = ros2(&run, None).unwrap_err();
    assert!(failure.to_string().contains("no message"), "{failure}");
    fs::write(&path, &bytes).unwrap();
    break_off(&run);
    let told = ros2(&run, None).unwrap().missing;
    assert!(
        matches!(&told[..], [only] if only.contains("breaks off")),
        "{told:?}"
    );
}
