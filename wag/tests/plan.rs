//! `wag plan`: broken off, it leaves the best throw so far, marked as such.
#![cfg(test)]

mod support;

use rustix::process::Signal;
use serde_json::Value;
use std::io::Read;
use std::time::Duration;
use support::{command, send};

const ROPE: &str = "links = 20
length_m = 0.5
joint_damping_nms_per_rad = 0.01
joint_stiffness_nm_per_rad = 0.2
radius_m = 0.006
mass_per_length_kg_per_m = 0.05
lead_mass_kg = 0.04
lead_radius_m = 0.02
link_extra_scale = 0.9
";
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
    let mut answer = String::new();
    let mut stdout = child.stdout.take().unwrap();
    stdout.read_to_string(&mut answer).unwrap();
    assert!(child.wait().unwrap().success(), "{answer}");
    let answer: Value = serde_json::from_str(&answer).unwrap();
    assert_eq!(answer["interrupted"], true);
    assert!(answer["warnings"].to_string().contains("interrupted"));
    let plan: Value =
        serde_json::from_str(&std::fs::read_to_string(at("plan.json")).unwrap()).unwrap();
    assert_eq!(plan["interrupted"], true);
    let margins = plan["margins"].as_array().unwrap();
    assert!(margins.iter().all(|m| m["left"].as_f64().unwrap() >= 0.0));
}
