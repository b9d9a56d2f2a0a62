//! `wag plan`: broken off, it leaves the best throw so far, marked as such.

use super::files::ROPE;
use super::support::{command, send};
use rustix::process::Signal;
use serde_json::Value;
use std::time::Duration;

/// A search that would last for hours.
const ENDLESS: &str = "[search]\ngenerations = 1000000\npopulation = 2000\n";

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
