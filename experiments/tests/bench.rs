//! `experiments bench`: complete, clean JSON.
#![cfg(test)]

mod support;

use serde_json::Value;
use support::{missing, report};

/// The number at `path`, which must be there, finite and above zero.
fn positive(value: &Value, path: &str) -> f64 {
    let number = value.pointer(path).and_then(Value::as_f64);
    let number = number.unwrap_or_else(|| panic!("no number at {path} in {value}"));
    assert!(number.is_finite() && number > 0.0, "{path} is {number}");
    number
}

#[test]
fn bench_rope_prints_one_whole_json_object() {
    let report = report("bench rope --quick --seed 9");
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
    assert!(kernels.contains(&"ScalarF64"), "{kernels:?}");
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

#[test]
fn bench_track_reports_times_and_memory_of_a_recording() {
    let Some(data) = missing::shared("data/wiggle/a1") else {
        return;
    };
    let report = report(&format!("bench track --quick --video {}", data.display()));
    assert_eq!(report["command"], "bench track");
    assert_eq!(report["limit_mb"], 400.0);
    let together = positive(&report, "/together_cpu_ms");
    let decoding = positive(&report, "/decoding_cpu_ms");
    assert!(together >= decoding.max(positive(&report, "/tracking_cpu_ms")));
    let stages = ["background", "searching", "reading"];
    let stages = stages.map(|stage| positive(&report, &format!("/stages_wall_ms/{stage}")));
    let tracking = positive(&report, "/together_wall_ms");
    assert!(stages.iter().sum::<f64>() <= tracking, "{report}");
    // The frames alone: luma and chroma of all left images and of a quarter of the right ones.
    let frames_mb = 1.25 * positive(&report, "/frames") * (672 * 376 * 2) as f64 / 1e6;
    let peak_mb = positive(&report, "/peak_memory_mb");
    assert!(
        (frames_mb..frames_mb + 200.0).contains(&peak_mb),
        "{peak_mb} MB"
    );
    assert!((0.0..=1.0).contains(&report["lost_fraction"].as_f64().unwrap()));
}

#[test]
fn bench_identify_prints_every_method() {
    let report = report("bench identify --quick");
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
fn bench_library_compares_both_ways_of_planning() {
    let report = report("bench library --quick");
    assert_eq!(report["command"], "bench library");
    let [library, search] = report["ways"].as_array().unwrap().as_slice() else {
        panic!("{report}");
    };
    assert_eq!(library["searched"], 0);
    assert_eq!(search["searched"], report["pairs"]);
    for way in [library, search] {
        assert_eq!(way["plans"], report["pairs"]);
        assert!(positive(way, "/median_ms") <= positive(way, "/p95_ms"));
        assert!(positive(way, "/miss_max_mm") < 10.0, "{way}");
    }
}

#[test]
fn bench_plan_splits_the_time_of_every_task() {
    let report = report("bench plan --quick");
    let tasks = report["tasks"].as_array().unwrap();
    assert_eq!(tasks.len(), 3);
    for row in tasks {
        assert!(row["rollouts_per_s"].as_f64().unwrap() > 0.0);
        let parts = ["rope_fraction", "contacts_fraction", "search_fraction"];
        let whole: f64 = parts.iter().map(|p| row[p].as_f64().unwrap()).sum();
        assert!((whole - 1.0).abs() < 1e-9, "{row}");
    }
}
