//! `wag plan`: broken off, it leaves the best throw so far, marked as such.

use super::files::ROPE;
use super::support::{are_refused_in, command, plan_json, send, throw};
use rustix::process::Signal;
use serde_json::Value;
use std::time::Duration;

/// A search that would last for hours.
const ENDLESS: &str =
    "[search]\ngenerations = 1000000\npopulation = 2000\nlibrary_candidates = 0\n";

#[test]
fn a_correction_without_a_miss_or_a_throw_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let rope = toml::from_str(ROPE).unwrap();
    let plan = plan_json(&throw([0.0, 0.0]), &rope);
    put("plan.json", &plan.to_string());
    std::fs::create_dir(dir.path().join("run")).unwrap();
    put("run/plan.json", &plan.to_string());
    put("run/summary.json", "{\"ok\": true}");
    put("rope.toml", ROPE);
    std::fs::create_dir(dir.path().join("hidden")).unwrap();
    put("hidden/plan.json", &plan.to_string());
    let score = "{\"score\": {\"miss_m\": [0.1, 0, 0], \"interval_m\": [0.0, 0.199]}}";
    put("hidden/summary.json", score);
    std::fs::create_dir(dir.path().join("stopped")).unwrap();
    put("stopped/plan.json", &plan.to_string());
    put("stopped/summary.json", "{\"ok\": false}");
    are_refused_in(
        dir.path(),
        2,
        "plan again plan.json --out p.json => --miss | wag score
         plan again run --out p.json => summary.json | --miss
         plan again hidden --out p.json => 0.199 m only | --miss
         plan again gone.json --miss 0,0,0.01 --out p.json => gone.json
         plan again rope.toml --miss 0,0,0.01 --out p.json => `rope.toml` is not a plan
         plan again plan.json --miss 0,0.2,0 --out p.json => 20.0 cm
         plan again plan.json --miss 0,0,0.01 --out p.json => other waypoints
         plan again plan.json --miss nan,0,0 --out p.json => finite
         throw --again plan.json --arm 127.0.0.1 => --miss
         throw --again run --arm 127.0.0.1 => summary.json | wag score --run
         throw --again plan.json --miss 0,0.3,0 --dry-run => 30.0 cm is too far
         throw --again stopped --miss 0,0.01,0 --arm 127.0.0.1 => stopped | name another run
         demo --again run => run | config/rig.toml",
    );
    assert!(!dir.path().join("p.json").exists());
}

#[test]
fn an_interrupt_leaves_the_best_plan_so_far() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("rope.toml"), ROPE).unwrap();
    std::fs::write(at("planner.toml"), ENDLESS).unwrap();
    let mut child = command(
        "plan strike --target 0.95,0.1,0.2 --json --rope rope.toml --config planner.toml \
         --out plan.json --allow-miss",
    )
    .current_dir(dir.path())
    .spawn()
    .unwrap();
    std::thread::sleep(Duration::from_secs(2));
    assert!(child.try_wait().unwrap().is_none(), "ended by itself");
    send(child.id(), Signal::INT);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["interrupted"], true);
    assert!(answer["warnings"].to_string().contains("interrupted"));
    let plan = std::fs::read(at("plan.json")).unwrap();
    let plan: Value = serde_json::from_slice(&plan).unwrap();
    assert_eq!(plan["interrupted"], true);
    let margins = plan["margins"].as_array().unwrap();
    assert!(margins.iter().all(|m| m["left"].as_f64().unwrap() >= 0.0));
}
