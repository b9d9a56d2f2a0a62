//! Results: complete JSON, trials kept in their file, pictures beside it.
#![cfg(test)]

mod support;

use serde_json::Value;
use support::{assert_refused, report};

#[test]
fn trials_are_kept_and_an_interrupted_run_resumes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sysid.json");
    let line = |ropes: u32, seed: u32| {
        let out = path.display();
        format!("sysid --ropes {ropes} --seed {seed} --out {out}")
    };
    let kept =
        || -> Value { serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap() };
    assert_eq!(report(&line(1, 3))["summary"]["trials"], 1);
    let first = kept();
    let both = report(&line(2, 3));
    assert_eq!(both["command"], "sysid");
    assert_eq!(both["summary"]["parameters"].as_array().unwrap().len(), 9);
    let picture = std::fs::read_to_string(dir.path().join("sysid.svg")).unwrap();
    assert!(picture.contains("sysid, seed 3") && picture.contains("joint stiffness"));
    let more = kept();
    assert_eq!(more["trials"][0], first["trials"][0]);
    // The network has a proposal for both.
    for trial in more["trials"].as_array().unwrap() {
        assert_eq!(trial["method"], "hybrid-network");
    }
    assert_eq!(more["trials"].as_array().unwrap().len(), 2);
    assert_refused(&line(2, 4), &["seed 3"]);
}

/// Another program's trials may be those of another simulator.
#[test]
fn trials_that_another_program_kept_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let line = format!(
        "sysid --ropes 1 --seed 3 --method nn --out {}",
        at("a.json")
    );
    let other = at("other");
    std::fs::copy(env!("CARGO_BIN_EXE_experiments"), &other).unwrap();
    let mut file = std::fs::File::options().append(true).open(&other).unwrap();
    std::io::Write::write_all(&mut file, b"built anew").unwrap();
    drop(file);
    let mut command = std::process::Command::new(&other);
    assert!(command.args(line.split(' ')).status().unwrap().success());
    assert_refused(&line, &["a.json", "program", "--out"]);
}

#[test]
fn the_network_answers_at_once_and_better_than_the_middle_of_the_ranges() {
    let report = report("sysid --ropes 24 --seed 5 --method nn");
    assert_eq!(report["method"], "network");
    let rows = report["summary"]["parameters"].as_array().unwrap();
    // Length, damping, stiffness, radius, masses and lead radius are seen.
    for i in 1..8 {
        let number = |key: &str| rows[i][key].as_f64().unwrap();
        let part = number("mean_error") / number("middle");
        assert!(part < 0.7, "{}: {part}", rows[i]["label"]);
    }
}

/// The network that reads link centres recovers their number.
#[test]
fn link_centres_reveal_the_link_count() {
    let model = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../configs/models/phi-nn-links.onnx"
    );
    let with = |method| format!("sysid --ropes 24 --seed 5 --method {method} --model {model}");
    let report = report(&with("nn"));
    let links = &report["summary"]["parameters"][0];
    assert!(links["mean_error"].as_f64().unwrap() < 0.15, "{links}");
    assert_refused(&with("hybrid"), &["only simulated films show"]);
}

/// One rope with each of the nine wiggles, no better than the film allows.
#[test]
fn every_wiggle_of_the_ablation_identifies_a_rope() {
    let report = report("wiggle-ablation --ropes 1 --seed 5");
    let wiggles = report["wiggles"].as_array().unwrap();
    assert_eq!(wiggles.len(), 9);
    for wiggle in wiggles {
        let length = &wiggle["summary"]["parameters"][1];
        assert!(length["mean_error"].as_f64().unwrap() < 0.02, "{wiggle}");
        assert_eq!(wiggle["paper"].as_array().unwrap().len(), 9);
    }
}

/// One film: the length is identifiable from it, the link extra scale is not.
#[test]
fn sensitivity_maps_are_drawn_for_every_parameter() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("maps.json");
    let reported = report(&format!(
        "sensitivity-maps --ropes 1 --seed 5 --out {}",
        out.display()
    ));
    let rows = reported["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 9);
    let mean = |i: usize| rows[i]["mean_per_m"].as_f64().unwrap();
    assert!(mean(1) > 4.0 * mean(8), "{rows:?}");
    for row in rows {
        let peak_s = row["peak_s"].as_f64().unwrap();
        assert!((0.0..6.7).contains(&peak_s), "{row}");
    }
    assert_eq!(
        reported["map"]["values"][0].as_array().unwrap().len(),
        50 * 12
    );
    let drawn = std::fs::read_to_string(dir.path().join("maps.svg")).unwrap();
    assert_eq!(drawn.matches("class=\"map\"").count(), 9);
    assert!(drawn.contains("seed 5") && drawn.contains("lead mass"));
}

/// One rope of each, gone on with to no more.
#[test]
fn results_of_planning_are_whole_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let pipeline = format!("sim-pipeline --ropes 1 --out {}", at("pipeline.json"));
    let first = report(&pipeline);
    let rows = first["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    assert!(
        rows[0]["error"]["median_m"].as_f64().unwrap() < 0.01,
        "{first}"
    );
    assert_eq!(first["rows"], report(&pipeline)["rows"]);
    let tasks = report(&format!("lob-drape --ropes 1 --out {}", at("both.json")));
    assert_eq!(tasks["trials"].as_array().unwrap().len(), 1);
    for (row, estimate) in ["weighed", "unweighed"].into_iter().enumerate() {
        let drape = &tasks["trials"][0][estimate]["drape"];
        assert!(drape["error_m"].as_f64().unwrap() < 0.2, "{drape}");
        let lob = &tasks["trials"][0][estimate]["lob"];
        assert_eq!(lob["verdict"]["success"], true, "{lob}");
        let rate = &tasks["rows"][row]["drape_success"];
        assert_eq!(
            rate["true"] == 1,
            drape["verdict"]["success"] == true,
            "{rate}"
        );
    }
    let robust = report("robust --ropes 1");
    let rows = robust["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    for row in rows {
        assert!(row["median_m"].as_f64().unwrap() < 0.05, "{row}");
        assert!(row["width_m"].as_f64().unwrap() > 0.0, "{row}");
    }
}

#[test]
fn wrong_input_is_refused_with_the_reason() {
    for (line, words) in [
        ("wiggle-ablation --method nn", &["one wiggle only"][..]),
        ("sensitivity-maps --method cmaes", &["maps of the network"]),
        ("sysid --ropes 0", &["--ropes"]),
        ("bench", &["NAME"]),
        ("bench wibble", &["wibble", "possible values", "rope"]),
        ("bench track", &["--video", "camera.toml"]),
        ("bench track --video none", &["none"]),
    ] {
        assert_refused(line, words);
    }
}

#[test]
fn a_library_of_throws_is_written_or_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("throws.bin");
    let line = format!(
        "throws --searches 1 --kept 3 --seed 9 --out {}",
        out.display()
    );
    let report = report(&line);
    assert_eq!(
        (&report["throws"], &report["options"]["seed"]),
        (&3.into(), &9.into())
    );
    let bytes = std::fs::read(&out).unwrap();
    assert_eq!(report["bytes"], bytes.len());
    assert_eq!(
        planner::plan::ThrowLibrary::from_bytes(&bytes)
            .unwrap()
            .len(),
        3
    );
    let nowhere = dir.path().join("no/throws.bin");
    let line = format!("throws --out {}", nowhere.display());
    assert_refused(&line, &["no such folder"]);
}
