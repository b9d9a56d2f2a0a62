//! `wag report`: one file, whose numbers are those of the run's own files, in which
//! nothing of the run is markup, and which is the same every time.

use super::support::{self, plan_json, record, refused_in, wag};
use arm_model::{Cell, JointTrajectory, Pole};
use rt_controller::recording::RecordedCycle;
use serde_json::{Value, json};
use shared_types::MonotonicNs;
use shared_types::ipc::{ControllerMode, CycleRecord, JointReport};
use std::fs;
use std::path::{Path, PathBuf};

/// A name and a text that would do harm as markup.
const HOSTILE: &str = "<script>alert(1)<!--";
const CLOSE: &str = "</script><script>alert(2)</script>&amp;";
const ROPE: &str = "links = 22\nlength_m = 0.5\njoint_damping_nms_per_rad = 0.02\n\
    joint_stiffness_nm_per_rad = 0.2\nradius_m = 0.008\nmass_per_length_kg_per_m = 0.05\n\
    lead_mass_kg = 0.08\nlead_radius_m = 0.03\nlink_extra_scale = 1.0\n\
    [interval_90]\nlength_m = [4.9e-1, 5.1e-1]\n";

fn throw() -> JointTrajectory {
    support::throw([0.1, 0.4])
}

/// The measured arm is behind its setpoints by this (s).
const LAG_S: f64 = 0.02;
/// Control cycles before and after the throw's begin; each brings a joint report.
const CYCLES: std::ops::Range<i32> = -125..500;
const PERIOD_S: f64 = 0.004;

fn record_throw(run: &Path, motion: &JointTrajectory) {
    let begin = MonotonicNs(12_500_000_000);
    let cycles = CYCLES.map(|cycle| {
        let t = f64::from(cycle) * PERIOD_S;
        let streams = (0.0..=1.0).contains(&t);
        let mode = if streams {
            ControllerMode::Streaming
        } else {
            ControllerMode::Idle
        };
        let late_us = cycle.rem_euclid(50).unsigned_abs() + 10;
        let deadline_ns = begin.plus_s(t).0;
        let record = CycleRecord {
            deadline_ns,
            mode: mode as u8,
            sent: 1,
            wake_late_ns: 1000 * late_us,
            compute_ns: 20_000,
            send_ns: 60_000,
            trajectory_s: if streams { t } else { -1.0 },
            q_c: motion.state_at(t.clamp(0.0, 1.0)).q,
            ..CycleRecord::default()
        };
        let mut one = RecordedCycle {
            record,
            ..RecordedCycle::default()
        };
        one.input.reports.push(JointReport {
            stamp_ns: deadline_ns,
            q: motion.state_at((t - LAG_S).clamp(0.0, 1.0)).q,
            ..JointReport::default()
        });
        one
    });
    record(run, cycles);
}

/// A run whose every text tries to get out of its place.
fn hostile_run(folder: &Path) -> PathBuf {
    let run = folder.join(HOSTILE);
    fs::create_dir(&run).unwrap();
    let motion = throw();
    record_throw(&run, &motion);
    fs::write(run.join("params.toml"), ROPE).unwrap();
    let rope = toml::from_str(ROPE.split("[interval").next().unwrap()).unwrap();
    let put = |name: &str, value: &Value| fs::write(run.join(name), value.to_string()).unwrap();
    let mut plan = plan_json(&motion, &rope);
    plan["version"] = json!(CLOSE);
    put("plan.json", &plan);
    put(
        "summary.json",
        &json!({
            "ok": true, "command": CLOSE, "seed": 5, "error": HOSTILE, "warnings": [CLOSE],
            "target_m": [0.9, 0.1, 0.0], "true_tip_target_distance_m": 0.031,
            "score": { "closest_m": 0.028, "interval_m": [0.02, 0.04] },
            "truth": { "rope": { "length_m": 0.503 } },
        }),
    );
    let mut png = png::Encoder::new(fs::File::create(run.join("throw.png")).unwrap(), 64, 32);
    png.set_color(png::ColorType::Rgb);
    let pixels: Vec<u8> = (0..64 * 32 * 3_u32).map(|i| (i % 251) as u8).collect();
    let mut png = png.write_header().unwrap();
    png.write_image_data(&pixels).unwrap();
    run
}

/// The page that `wag report` makes of a run.
fn page_of(run: &Path, more: &str) -> String {
    let made = wag(&format!("report {} {more}", run.display()));
    assert!(made.status.success(), "{made:?}");
    fs::read_to_string(run.join("report.html")).unwrap()
}

/// The data of a report, and everything else of the page.
fn parts(html: &str) -> (Value, String) {
    let open = "<script type=\"application/json\" id=\"data\">";
    let (before, rest) = html.split_once(open).unwrap();
    let (data, after) = rest.split_once("</script>").unwrap();
    let page = format!("{before}{after}");
    (serde_json::from_str(data).unwrap(), page)
}

#[test]
fn a_report_tells_the_runs_numbers_and_does_no_harm() {
    let dir = tempfile::tempdir().unwrap();
    let run = hostile_run(dir.path());
    let out = dir.path().join("r.html");
    let said = support::json(&format!("report {} --out {}", run.display(), out.display()));
    let html = fs::read_to_string(&out).unwrap();
    assert_eq!(said["bytes"], html.len());
    assert!(html.len() < 1_000_000, "{}", html.len());

    let (data, page) = parts(&html);
    for word in ["alert(", "<!--"] {
        assert!(!page.contains(word), "`{word}` stands in the page itself");
    }
    assert_eq!(html.matches("<script").count(), 2);
    let other = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!other.contains("http:") && !other.contains("https:"));
    assert_eq!(data["run"], HOSTILE);
    assert_eq!(data["summary"]["warnings"][0], CLOSE);

    assert_eq!(data["error"]["planned_m"], 0.0125);
    assert_eq!(data["error"]["true_m"], 0.031);
    assert_eq!(data["error"]["camera_interval_m"], json!([0.02, 0.04]));
    let length = &data["rope"][1];
    assert_eq!(length["label"], "length");
    assert_eq!(length["interval_90"], json!([0.49, 0.51]));
    assert_eq!(length["truth"], 0.503);
    let wake = &data["latency"][0];
    assert_eq!(wake["cycles"], 251);
    assert_eq!(wake["max_us"], 59.0);
    let missing = data["missing"].to_string();
    assert!(missing.contains("wiggle.png"), "{missing}");
    assert!(!missing.contains("run.mcap"), "{missing}");
    let url = data["pictures"][0]["url"].as_str().unwrap();
    assert!(url.starts_with("data:image/jpeg;base64,"));

    // The same bytes again.
    assert_eq!(page_of(&run, ""), html);
}

/// The cell is the one named, else the run's own, else the effective one.
#[test]
fn a_run_is_shown_in_its_own_cell_unless_another_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let run = hostile_run(dir.path());
    let pole_m =
        |more: &str| parts(&page_of(&run, more)).0["scenes"][0]["cell"]["pole"]["length_m"].clone();
    let named = dir.path().join("named.toml");
    fs::write(&named, "[pole]\nlength_m = 0.25\n").unwrap();
    let named = format!("--cell {}", named.display());
    assert_eq!([pole_m(""), pole_m(&named)], [json!(0.20), json!(0.25)]);

    let mut cell = Cell::default();
    cell.pole.length_m = 0.30;
    fs::create_dir(run.join("config")).unwrap();
    let cell = toml::to_string(&cell).unwrap();
    fs::write(run.join("config/cell.toml"), cell).unwrap();
    assert_eq!([pole_m(""), pole_m(&named)], [json!(0.30), json!(0.25)]);
}

#[test]
fn the_replay_is_the_measured_arm_with_the_rope_on_it() {
    let dir = tempfile::tempdir().unwrap();
    let run = hostile_run(dir.path());
    let (data, _) = parts(&page_of(&run, ""));
    let scene = &data["scenes"][0];
    assert_eq!(data["scenes"].as_array().unwrap().len(), 1);
    assert_eq!(scene["name"], "throw");
    let at = |frames: &Value, frame: usize, point: usize| -> [f64; 3] {
        [0, 1, 2].map(|axis| frames[frame][3 * point + axis].as_f64().unwrap() * 1e-4)
    };
    let [from_s, period_s] = ["from_s", "period_s"].map(|key| scene[key].as_f64().unwrap());
    let count = scene["arm"].as_array().unwrap().len();
    assert_eq!(count, scene["rope"].as_array().unwrap().len());
    for frame in [0, 30, count / 2, count - 30] {
        let t = from_s + period_s * frame as f64;
        let q = throw().state_at((t - LAG_S).clamp(0.0, 1.0)).q;
        let (end, _) = Pole::default().attach_pose(&q);
        let shown = at(&scene["arm"], frame, 8);
        let clamp = at(&scene["rope"], frame, 0);
        let told = format!("{frame}: {clamp:?} {shown:?} {end}");
        for axis in 0..3 {
            assert!((shown[axis] - end[axis]).abs() < 1e-3, "{told}");
            assert!((clamp[axis] - shown[axis]).abs() < 1e-3, "{told}");
        }
    }
    // The rope is as long as it was identified, and it moves.
    let (first, last) = (at(&scene["rope"], 0, 22), at(&scene["rope"], count - 1, 22));
    let hangs = at(&scene["rope"], 0, 0)[2] - first[2];
    assert!((0.49..0.56).contains(&hangs), "{hangs}");
    assert!((last[0] - first[0]).abs() > 0.03, "{first:?} {last:?}");
    // Planned and measured joint 6 differ by what the arm is late.
    let joints = &scene["joints"];
    assert_eq!(joints["wanted_is"], "planned");
    let times: Vec<f64> = serde_json::from_value(joints["t_s"].clone()).unwrap();
    for (i, t) in times.iter().enumerate().step_by(40) {
        let wanted = joints["wanted"][5][i].as_f64().unwrap();
        let measured = joints["measured"][5][i].as_f64().unwrap();
        assert!((wanted - throw().state_at(*t).q[5]).abs() < 2e-5);
        let late = throw().state_at((t - LAG_S).max(0.0)).q[5];
        assert!((measured - late).abs() < 2e-3, "{t}: {measured} {late}");
    }
}

/// The recorder died before it wrote a cycle: at a full disk, or killed at once.
#[test]
fn a_run_whose_recorder_died_is_shown_without_its_cycles() {
    let dir = tempfile::tempdir().unwrap();
    let run = hostile_run(dir.path());
    let file = run.join("run.mcap");
    let whole = fs::read(&file).unwrap();
    for len in [100, 0] {
        fs::write(&file, &whole[..len]).unwrap();
        let (data, _) = parts(&page_of(&run, ""));
        assert_eq!(data["scenes"], json!([]));
        let missing = data["missing"].to_string();
        assert!(missing.contains("run.mcap"), "{missing}");
    }
}

#[test]
fn what_is_no_run_or_is_damaged_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let empty = dir.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let refused = |run: &Path, word: &str| {
        let said = refused_in(dir.path(), 2, &format!("report {}", run.display()));
        assert!(said.contains(word) && said.lines().count() == 1, "{said}");
        assert!(!run.join("report.html").exists());
    };
    refused(&dir.path().join("none"), "is not a folder");
    refused(&empty, "not a run folder");
    for (file, text, word) in [
        ("summary.json", "{", "summary.json"),
        ("run.mcap", "nothing", "run.mcap"),
        ("cycles.bin", "nothing", "cycles.bin"),
        ("params.toml", "links = 0", "params.toml"),
        ("plan.json", "{}", "plan.json"),
        ("wiggle.png", "no picture", "wiggle.png"),
    ] {
        let folder = dir.path().join(file.replace('.', "-"));
        fs::create_dir(&folder).unwrap();
        let run = hostile_run(&folder);
        fs::write(run.join(file), text).unwrap();
        refused(&run, word);
    }
}
