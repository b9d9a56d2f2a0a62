//! `experiments bench`: complete, clean JSON.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

use serde_json::Value;
use std::process::Command;

/// The number at `path`, which must be there, finite and above zero.
fn positive(value: &Value, path: &str) -> f64 {
    let number = value.pointer(path).and_then(Value::as_f64);
    let number = number.unwrap_or_else(|| panic!("no number at {path} in {value}"));
    assert!(number.is_finite() && number > 0.0, "{path} is {number}");
    number
}

#[test]
fn bench_rope_prints_one_whole_json_object() {
    let output = Command::new(env!("CARGO_BIN_EXE_experiments"))
        .args(["bench", "rope", "--quick", "--json", "--seed", "9"])
        .output()
        .unwrap();
    assert!(output.status.success());
    let report: Value = serde_json::from_slice(&output.stdout).expect("standard output is JSON");
    assert_eq!(report["ok"], true);
    assert_eq!(report["command"], "bench rope");
    assert_eq!(report["seed"], 9);
    assert_eq!(report["quick"], true);
    positive(&report, "/machine/cores");
    for key in ["cpu", "version"] {
        assert!(!report["machine"][key].as_str().unwrap().is_empty());
    }
    let rows = |key: &str| report[key].as_array().unwrap();
    let kernels: Vec<&str> = rows("kernels")
        .iter()
        .map(|row| row["kernel"].as_str().unwrap())
        .collect();
    assert!(kernels.contains(&"PortableF32") && kernels.contains(&"ScalarF64"));
    for row in rows("kernels") {
        positive(row, "/lanes");
        positive(row, "/simulated_s_per_cpu_s");
        for key in ["still", "throw", "floor_far", "on_floor"] {
            positive(row, &format!("/{key}_ns"));
        }
    }
    for job in ["throw", "wiggle"] {
        let row = rows("jobs").iter().find(|row| row["job"] == job).unwrap();
        for key in ["/candidates", "/cpu_s", "/wall_s", "/rollouts_per_s"] {
            positive(row, key);
        }
        assert!(row["repeated"].is_u64() && row["diverged"].is_u64());
        assert_eq!(row["limit_cpu_s"].is_null(), row["within_limit"].is_null());
    }
    let links = report["links"]["rows"].as_array().unwrap();
    assert_eq!(links.first().unwrap()["links"], 5);
    assert_eq!(links.last().unwrap()["links"], 200);
    positive(&report, "/links/slope_ns_per_link_step");
    positive(&report, "/links/r_squared");
    assert_eq!(rows("candidates").first().unwrap()["candidates"], 1);
    for row in rows("candidates") {
        positive(row, "/us_per_rollout");
    }
}
