//! Results and benchmarks of planning: complete JSON, trials kept in their file.
#![cfg(test)]

use serde_json::Value;
use std::process::{Command, Output};

fn experiments(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_experiments"));
    command.args(args).output().unwrap()
}

fn report(args: &[&str]) -> Value {
    let output = experiments(args);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    serde_json::from_slice(&output.stdout).expect("standard output is JSON")
}

#[test]
fn trials_are_kept_and_an_interrupted_run_resumes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sysid.json");
    let path = path.to_str().unwrap();
    let sysid = |ropes: &'static str, seed: &'static str| {
        vec!["sysid", "--ropes", ropes, "--seed", seed, "--json", "--out"]
    };
    let run = |ropes, seed| report(&[&sysid(ropes, seed)[..], &[path]].concat());
    assert_eq!(run("1", "3")["summary"]["trials"], 1);
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let both = run("2", "3");
    assert_eq!(both["command"], "sysid");
    assert_eq!(both["summary"]["parameters"].as_array().unwrap().len(), 9);
    let picture = std::fs::read_to_string(dir.path().join("sysid.svg")).unwrap();
    assert!(picture.contains("sysid, seed 3") && picture.contains("joint stiffness"));
    let methods = |kept: &Value| -> Vec<String> {
        let trials = kept["trials"].as_array().unwrap();
        let name = |t: &Value| t["method"].as_str().unwrap().to_owned();
        trials.iter().map(name).collect()
    };
    let more: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert_eq!(more["trials"][0], kept["trials"][0]);
    // The network has a proposal for both.
    assert_eq!(methods(&more), ["hybrid-network"; 2]);
    let refused = experiments(&[&sysid("2", "4")[..], &[path]].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stdout).contains("seed 3"));
}

#[test]
fn the_network_answers_at_once_and_better_than_the_middle_of_the_ranges() {
    let report = report(&[
        "sysid", "--ropes", "24", "--seed", "5", "--method", "nn", "--json",
    ]);
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
    let sysid = ["sysid", "--ropes", "24", "--seed", "5"];
    let with = |method| {
        [
            &sysid[..],
            &["--method", method, "--model", model, "--json"],
        ]
        .concat()
    };
    let report = report(&with("nn"));
    let links = &report["summary"]["parameters"][0];
    assert!(links["mean_error"].as_f64().unwrap() < 0.15, "{links}");
    let refused = experiments(&with("hybrid"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stdout).contains("only simulated films show"));
}

/// One rope with each of the nine wiggles, no better than the film allows.
#[test]
fn every_wiggle_of_the_ablation_identifies_a_rope() {
    let report = report(&["wiggle-ablation", "--ropes", "1", "--seed", "5", "--json"]);
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
    let path = dir.path().join("maps.json");
    let path = path.to_str().unwrap();
    let maps = ["sensitivity-maps", "--ropes", "1"];
    let rest = ["--seed", "5", "--json", "--out", path];
    let told = report(&[&maps[..], &rest].concat());
    let rows = told["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 9);
    let mean = |i: usize| rows[i]["mean_per_m"].as_f64().unwrap();
    assert!(mean(1) > 4.0 * mean(8), "{rows:?}");
    for row in rows {
        assert!(
            (0.0..6.7).contains(&row["peak_s"].as_f64().unwrap()),
            "{row}"
        );
    }
    assert_eq!(told["map"]["values"][0].as_array().unwrap().len(), 50 * 12);
    let drawn = std::fs::read_to_string(dir.path().join("maps.svg")).unwrap();
    assert_eq!(drawn.matches("class=\"map\"").count(), 9);
    assert!(drawn.contains("seed 5") && drawn.contains("lead mass"));
    let refused = experiments(&[&maps[..], &["--method", "cmaes"]].concat());
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn bench_identify_prints_every_method() {
    let report = report(&["bench", "identify", "--quick", "--json"]);
    assert_eq!(report["command"], "bench identify");
    let methods = report["methods"].as_array().unwrap();
    let names: Vec<&str> = methods
        .iter()
        .map(|m| m["method"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["nn", "hybrid", "cmaes"]);
    for row in methods {
        assert!(row["wall_s"].as_f64().unwrap() > 0.0);
        assert!(row["limit_wall_s"].as_f64().unwrap() > 0.0);
    }
    assert!(methods[2]["simulations"].as_f64().unwrap() >= 3000.0);
}

#[test]
fn bench_plan_splits_the_time_of_every_task() {
    let report = report(&["bench", "plan", "--quick", "--json"]);
    let tasks = report["tasks"].as_array().unwrap();
    assert_eq!(tasks.len(), 3);
    for row in tasks {
        assert!(row["rollouts_per_s"].as_f64().unwrap() > 0.0);
        let parts = ["rope_part", "contacts_part", "search_part"];
        let whole: f64 = parts.iter().map(|p| row[p].as_f64().unwrap()).sum();
        assert!((whole - 1.0).abs() < 1e-9, "{row}");
    }
}

/// One rope of each, gone on with to no more.
#[test]
fn results_of_planning_are_whole_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let (pipeline, both) = (at("pipeline.json"), at("both.json"));
    let strikes = ["sim-pipeline", "--ropes", "1", "--json", "--out"];
    let first = report(&[&strikes[..], &[&pipeline]].concat());
    let rows = first["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    assert!(
        rows[0]["error"]["median_m"].as_f64().unwrap() < 0.01,
        "{first}"
    );
    let again = report(&[&strikes[..], &[&pipeline]].concat());
    assert_eq!(first["rows"], again["rows"]);
    let tasks = ["lob-drape", "--ropes", "1", "--json", "--out"];
    let tasks = report(&[&tasks[..], &[&both]].concat());
    assert_eq!(tasks["trials"].as_array().unwrap().len(), 1);
    assert!(tasks["trials"][0]["drape"]["error_m"].as_f64().unwrap() < 0.2);
    let robust = report(&["robust", "--ropes", "1", "--json"]);
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
        ("bench", &["NAME"]),
        ("bench wibble", &["wibble", "possible values", "rope"]),
        ("bench track", &["--video", "camera.toml"]),
        ("bench track --video none", &["none"]),
    ] {
        let args: Vec<&str> = line.split_whitespace().collect();
        let output = experiments(&args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(words.iter().all(|w| said.contains(w)), "{line}: {said}");
    }
}
