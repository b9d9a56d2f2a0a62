//! Runs as a data set for LeRobot: its values, layout and statistics as another reader of
//! Parquet finds them, and what is refused. `.ci/lerobot-check` does the same with the library.
#![cfg(test)]

#[path = "../../../hil-tests/support/missing.rs"]
mod missing;
mod recorded;

use recorded::Recorded;
use run_export::lerobot;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Every file below a folder.
fn files_of(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            let below = files_of(&path).into_iter();
            let name = PathBuf::from(path.file_name().unwrap());
            found.extend(below.map(|(file, bytes)| (name.join(file), bytes)));
        } else {
            found.insert(path.file_name().unwrap().into(), fs::read(&path).unwrap());
        }
    }
    found
}

fn refused(runs: &[&Recorded], out: &Path, fps: Option<u32>) -> String {
    let runs: Vec<PathBuf> = runs.iter().map(|run| run.folder.clone()).collect();
    let failure = lerobot(&runs, out, fps).unwrap_err();
    assert_eq!(failure.exit_code(), 2, "{failure}");
    failure.to_string()
}

#[test]
fn another_reader_finds_the_runs_values_and_their_statistics() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let first = Recorded::new(at("first"));
    let second = Recorded {
        target_m: [0.5, 0.25, 0.75],
        pictures: 40,
        ..Recorded::new(at("second"))
    };
    [&first, &second].into_iter().for_each(Recorded::write);
    let out = at("set");
    let runs = [first.folder.clone(), second.folder.clone()];
    let written = lerobot(&runs, &out, None).unwrap();
    assert_eq!(written.figures["episodes"], 2);
    // The picture that the recorder left out is missing in both.
    assert_eq!(written.figures["repeated_pictures"], 2);
    for (run, missing) in runs.iter().zip(&written.missing) {
        let said = format!("`{}`: 1 of ", run.display());
        assert!(missing.starts_with(&said), "{missing}");
        assert!(missing.ends_with("repeat the picture before"), "{missing}");
    }
    assert_eq!(written.missing.len(), 2, "{:?}", written.missing);
    assert_eq!(
        written.files[0].count,
        written.figures["frames"].as_u64().unwrap()
    );

    // The same runs make the same bytes, also in place of what was there.
    let once = files_of(&out);
    lerobot(&runs, &out, None).unwrap();
    assert_eq!(files_of(&out), once);

    let Some(python) = missing::named("WAG_SDK_PYTHON", "Python with pyarrow") else {
        return;
    };
    let expected = json!({
        "fps": 30, "size_px": first.size_px,
        "tasks": [
            "strike the target at (0.600, 0.000, 0.400) m with the tip of the rope",
            "strike the target at (0.500, 0.250, 0.750) m with the tip of the rope",
        ],
        "episodes": [first.expected(&at("pictures-1")), second.expected(&at("pictures-2"))],
    });
    fs::write(at("expected.json"), expected.to_string()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/lerobot/check.py");
    let mut python = Command::new(python);
    let output = python
        .arg(script)
        .arg(&out)
        .arg(at("expected.json"))
        .output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    print!("{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn a_lower_rate_thins_the_frames_and_a_run_without_a_camera_needs_one() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let (filmed, blind) = (
        Recorded::new(at("filmed")),
        Recorded {
            pictures: 0,
            ..Recorded::new(at("blind"))
        },
    );
    [&filmed, &blind].into_iter().for_each(Recorded::write);
    let frames = |run: &Recorded, fps| {
        let runs = [run.folder.clone()];
        lerobot(&runs, &at("set"), fps).unwrap().figures["frames"].clone()
    };
    let (all, fifth) = (frames(&filmed, None), frames(&filmed, Some(6)));
    assert_eq!([all, fifth], [json!(55), json!(11)]);
    // From the first setpoint, 20 ms after the begin, to the last report at 1851 ms.
    assert_eq!(frames(&blind, Some(100)), 184);
    let features = fs::read_to_string(at("set").join("meta/info.json")).unwrap();
    assert!(!features.contains("observation.images"), "{features}");
    let none = at("none");
    let said = refused(&[&blind], &none, None);
    assert!(said.contains("blind") && said.contains("--fps"), "{said}");
    let said = refused(&[&filmed], &none, Some(31));
    assert!(said.contains("30 pictures a second"), "{said}");
    assert!(!none.exists());
}

#[test]
fn runs_that_differ_are_refused_by_name_and_nothing_is_left() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let first = Recorded::new(at("first"));
    let slow = Recorded {
        fps: 15,
        pictures: 30,
        ..Recorded::new(at("slow"))
    };
    let large = Recorded {
        size_px: [32, 8],
        ..Recorded::new(at("large"))
    };
    let blind = Recorded {
        pictures: 0,
        ..Recorded::new(at("blind"))
    };
    [&first, &slow, &large, &blind]
        .into_iter()
        .for_each(Recorded::write);
    let before = fs::read_dir(place.path()).unwrap().count();
    for (other, fps, words) in [
        (&slow, None, "15 frames a second"),
        (&large, None, "32x8 px"),
        (&blind, Some(30), "no pictures"),
    ] {
        let said = refused(&[&first, other], &at("set"), fps);
        let named = [&first, other].map(|run| run.folder.display().to_string());
        assert!(named.iter().all(|name| said.contains(name)), "{said}");
        assert!(said.contains(words), "{said}");
    }
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), before);
    // Of two rates, a common one can be named.
    let runs = [first.folder.clone(), slow.folder.clone()];
    let written = lerobot(&runs, &at("set"), Some(15)).unwrap();
    assert_eq!(written.figures["fps"], 15);
    let said = refused(&[&first], &first.folder, None);
    assert!(said.contains("no earlier export"), "{said}");
    // Nor is a set that somebody has put something into.
    let data = at("set/data/chunk-000/file-000.parquet");
    let others = ["notes.txt", "data/chunk-000/file-001.parquet"].map(|name| at("set").join(name));
    for other in &others {
        fs::write(other, "mine").unwrap();
        let said = refused(&[&first], &at("set"), None);
        assert!(said.contains("no earlier export"), "{said}");
        fs::remove_file(other).unwrap();
    }
    std::os::unix::fs::symlink(&data, &others[1]).unwrap();
    let said = refused(&[&first], &at("set"), None);
    assert!(said.contains("no earlier export"), "{said}");
    fs::remove_file(&others[1]).unwrap();
    // As it was, it is replaced; with a file of another size, it is not.
    lerobot(&runs, &at("set"), Some(15)).unwrap();
    let longer = [fs::read(&data).unwrap(), b"mine".to_vec()].concat();
    fs::write(&data, longer).unwrap();
    let said = refused(&[&first], &at("set"), None);
    assert!(said.contains("no earlier export"), "{said}");
}

#[test]
fn what_is_wrong_with_a_run_is_told_with_its_name() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let (good, bad) = (
        Recorded::new(at("good")),
        Recorded {
            lost_cycles: 100..200,
            is_ok: false,
            ..Recorded::new(at("bad"))
        },
    );
    [&good, &bad].into_iter().for_each(Recorded::write);
    // Times of the tracker's frames that are of none of the camera's.
    for run in [&good, &bad] {
        let path = run.folder.join("keypoints.json");
        let mut track: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        for frame in track["frames"].as_array_mut().unwrap() {
            frame["t_s"] = json!(frame["t_s"].as_f64().unwrap() + 1000.0);
        }
        fs::write(&path, track.to_string()).unwrap();
    }
    let runs = [good.folder.clone(), bad.folder.clone()];
    let missing = lerobot(&runs, &at("set"), None).unwrap().missing;
    let of = |run: &Recorded| {
        let name = format!("`{}`: ", run.folder.display());
        let own = missing.iter().filter_map(|said| said.strip_prefix(&name));
        own.collect::<Vec<_>>().join("\n")
    };
    let [of_good, of_bad] = [&good, &bad].map(of);
    // From cycle 99 to cycle 200, 4 ms each.
    let gap = "gaps over 0.25 s without control cycles: 1, 0.4 s in all, the longest 0.4 s";
    assert!(of_bad.contains(gap), "{of_bad}");
    assert!(of_bad.contains("it failed"), "{of_bad}");
    assert!(of_bad.contains("no keypoints"), "{of_bad}");
    assert!(of_good.contains("no keypoints"), "{of_good}");
    assert_eq!(of_good.lines().count(), 2, "{of_good}");
}
