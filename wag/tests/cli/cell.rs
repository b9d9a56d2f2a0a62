//! A cell given in one file: everything that computes with the pole, the floor or the
//! column follows it.

use super::support::{are_refused_in, has, json_in, plan_json, wag_in};
use arm_model::joint::START_POSE;
use arm_model::{Cell, JointTrajectory};
use planner::collide::{ArmShape, tool_contacts};
use planner::plan::PolePose;
use planner::plan::check_reach;
use planner::ropes::random_rope;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose};
use rig_sim::{CameraConfig, RigConfig};
use rope_sim::{AttachMotion, PlannedArm};
use run_log::files::write_trajectory;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use xarm_sim::collision::obstacle_depth_m;

const LAB: &str = include_str!("../../../configs/cell/lab.toml");

/// The shipped cell, and one with a pole of 0.30 m and a floor that this pole reaches in
/// the start pose bent down, the shipped one not.
fn cells() -> (Cell, Cell) {
    let other = LAB
        .replace("length_m = 0.20", "length_m = 0.30")
        .replace("floor_z_m = -0.75", "floor_z_m = -0.10");
    (Cell::default(), toml::from_str(&other).unwrap())
}

/// The start pose bent down until the lab's pole ends 5 cm above the other cell's floor.
fn low_pose(lab: &Cell, other: &Cell) -> arm_model::JointVector {
    let (mut q, wanted_m) = (START_POSE, other.floor_z_m + 0.05);
    while lab.pole.attach_pose(&q).0.z > wanted_m {
        q[1] += 1e-3;
        q[5] -= 1e-3;
    }
    q
}

#[test]
fn planner_preflight_arm_and_viewer_follow_the_cell() {
    let (lab, other) = cells();
    let attach = |cell: &Cell| {
        let hold = JointTrajectory::hold(START_POSE, 1.0).unwrap();
        PlannedArm::new(hold, cell.pole).at(0.5).p_m
    };
    let down_m = attach(&lab) - attach(&other);
    assert!((down_m.norm() - 0.10).abs() < 1e-9 && down_m.z > 0.0999);
    let pole_z = |cell: &Cell| PolePose::of(&START_POSE, &cell.pole).z_m;
    assert!((pole_z(&lab) - pole_z(&other) - 0.10).abs() < 1e-6);
    assert!(check_reach([0.6, 0.0, -0.2], 0.5, &lab).is_ok());
    assert!(check_reach([0.6, 0.0, -0.2], 0.5, &other).is_err());

    let q = low_pose(&lab, &other);
    let touches = |cell: &Cell| !tool_contacts(&ArmShape::at(&q, &cell.pole), cell).none();
    assert!(!touches(&lab) && touches(&other));

    let depth_m = |cell: Cell| {
        let arm = RigConfig {
            cell,
            ..RigConfig::default()
        };
        let arm = arm.arm();
        let tool = arm.limits.tcp_offset();
        obstacle_depth_m(&q, &tool, arm.cell.as_ref(), &arm.obstacles)
    };
    assert!(depth_m(lab) < 0.0 && depth_m(other) > 0.0);

    let end = |cell: &Cell| {
        let points = viewer::report::arm_points(&START_POSE, &cell.pole);
        points[points.len() - 1]
    };
    assert_eq!(end(&lab) - end(&other), 1000, "tenths of a millimetre");
}

#[test]
fn the_renderer_draws_the_cell() {
    let (lab, other) = cells();
    let camera = CameraConfig::default().stereo_camera();
    let shape = RopeShape::from(&random_rope(1));
    let frame = |cell: &Cell| {
        let colours = Appearance::from_seed(1);
        let mut renderer = Renderer::new(&camera, cell, shape, colours, 0.0, 1);
        let pose = ScenePose {
            q: START_POSE,
            nodes: Vec::new(),
        };
        let mut out = vec![0; renderer.frame_bytes()];
        renderer.render(&[pose], 0, &mut out);
        out
    };
    let longer = Cell {
        pole: other.pole,
        ..lab
    };
    let [plain, longer_pole, all] = [&lab, &longer, &other].map(frame);
    // Where only the longer pole is: the wall, or dark carbon.
    let ends = [&lab, &other].map(|cell| cell.pole.attach_pose(&START_POSE).0);
    let [u, v] = camera.project_left(&ends[0].lerp(&ends[1], 0.5)).unwrap();
    let at = (v.round() as usize * camera.width_px as usize * 2 + u.round() as usize) * 2;
    assert!(plain[at] > longer_pole[at] + 30);
    assert_ne!(longer_pole, all, "the floor is another one");
}

#[test]
fn one_file_changes_what_the_commands_compute() {
    let (dir, _) = folder_of_cells();
    let rope = toml::to_string(&random_rope(1)).unwrap();
    std::fs::write(dir.path().join("rope.toml"), rope).unwrap();
    let hold = JointTrajectory::hold(START_POSE, 0.2).unwrap();
    write_trajectory(&dir.path().join("joints.csv"), &hold, 0.01).unwrap();
    let tip_z = |more: &str| -> f64 {
        let sim = "sim throw --rope rope.toml --joints joints.csv --out tip.csv";
        let output = wag_in(dir.path(), &format!("{sim} {more}"));
        assert!(output.status.success(), "{output:?}");
        let tips = std::fs::read_to_string(dir.path().join("tip.csv")).unwrap();
        let last = tips.lines().last().unwrap();
        last.rsplit(',').next().unwrap().parse().unwrap()
    };
    let lower_m = tip_z("") - tip_z("--cell cell.toml");
    assert!((lower_m - 0.10).abs() < 1e-6, "{lower_m}");

    let shown = wag_in(dir.path(), "config show cell cell.toml --origin");
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    has(&shown, &["pole.length_m", "cell.toml"]);
}

/// A folder with a cell of another pole, whole and as what differs, and one that is wrong.
fn folder_of_cells() -> (tempfile::TempDir, Cell) {
    let dir = tempfile::tempdir().unwrap();
    let mut other = Cell::default();
    other.pole.length_m = 0.30;
    let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    put("cell.toml", "[pole]\nlength_m = 0.30\n");
    put("wrong.toml", "[pole]\nlength_m = -0.30\n");
    (dir, other)
}

#[test]
fn a_runs_own_configuration_is_taken_in_its_cell_only() {
    let (dir, other) = folder_of_cells();
    let table = toml::to_string(&BTreeMap::from([("cell", other)])).unwrap();
    for kind in ["planner", "rig"] {
        let file = format!("{kind}.toml");
        std::fs::write(dir.path().join(&file), &table).unwrap();
        let check = format!("config check {kind} {file}");
        let words = "pole.length_m = 0.3 | remove [cell] | --cell";
        are_refused_in(dir.path(), 2, &format!("{check} => {file} | {words}"));
        json_in(dir.path(), &format!("{check} --cell cell.toml"));
    }
    // Of a kind without one it is an unknown key.
    std::fs::write(dir.path().join("limits.toml"), &table).unwrap();
    are_refused_in(dir.path(), 2, "config check limits limits.toml => cell");
}

#[test]
fn a_wrong_cell_is_refused_by_all_that_take_one() {
    let (dir, _) = folder_of_cells();
    for line in ["config check", "rig --command-port 0", "report ."] {
        let case = format!("{line} --cell wrong.toml => wrong.toml");
        are_refused_in(dir.path(), 2, &case);
    }
}

#[test]
fn a_plan_is_for_the_cell_that_it_was_made_for() {
    let (dir, other) = folder_of_cells();
    let mut end = START_POSE;
    end[6] += 0.1;
    let motion = JointTrajectory::new(&[0.0, 2.0], &[START_POSE, end]).unwrap();
    let mut plan = plan_json(&motion, &random_rope(1));
    plan["cell"] = json!(other);
    let put = |plan: &Value| {
        std::fs::write(dir.path().join("plan.json"), plan.to_string()).unwrap();
    };
    put(&plan);
    for command in ["check", "throw --dry-run"] {
        let line = format!("{command} plan.json");
        let words = "pole.length_m = 0.3 | 0.2 | --cell | plan anew";
        are_refused_in(dir.path(), 2, &format!("{line} => {words}"));
        json_in(dir.path(), &format!("{line} --cell cell.toml"));
    }
    // Plans of older versions do not tell it.
    plan.as_object_mut().unwrap().remove("cell");
    put(&plan);
    json_in(dir.path(), "check plan.json");
    let slow = format!("velocity_max_rad_s = {:?}", [0.01; 7]);
    std::fs::write(dir.path().join("slow.toml"), slow).unwrap();
    let broken = wag_in(dir.path(), "check plan.json --limits slow.toml --json");
    let reported: Value = serde_json::from_slice(&broken.stdout).unwrap();
    assert_eq!(reported["ok"], false);
    assert_eq!(broken.status.code(), Some(1));
    let margins = reported["margins"].as_array().unwrap();
    assert!(margins.len() > 4, "{reported}");
}
