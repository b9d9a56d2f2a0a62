//! Wrong input to every command: exit code 2 (or 1), one clear line that names
//! the file and the field, nothing half-written.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn wag(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wag"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// A network that reads what no camera shows.
const LINKS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../configs/models/phi-nn-links.onnx"
);

const ROPE: &str = "links = 23\nlength_m = 0.55\njoint_damping_nms_per_rad = 0.006\n\
    joint_stiffness_nm_per_rad = 0.15\nradius_m = 0.0055\nmass_per_length_kg_per_m = 0.05\n\
    lead_mass_kg = 0.05\nlead_radius_m = 0.02\nlink_extra_scale = 1.0\n";

fn pose_csv(rows: usize) -> String {
    let mut text = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
    for i in 0..rows {
        text.push_str(&format!("{:.3},0,0,1,1,0,0,0\n", i as f64 * 1e-3));
    }
    text
}

fn prepare() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(dir.path().join(name), text).unwrap();
    put("rope.toml", ROPE);
    put("pose.csv", &pose_csv(200));
    put("short.csv", "t,x,y,z,qw,qx,qy,qz\n0,0,0,1,1,0,0,0\n");
    put("nan.csv", &pose_csv(200).replace("0.010,0,", "0.010,nan,"));
    put(
        "unsorted.csv",
        &pose_csv(200).replace("0.010,0,", "0.001,0,"),
    );
    put("columns.csv", "t,x,y\n0,0,0\n");
    put(
        "noquat.csv",
        &pose_csv(200).replace("0.010,0,0,1,1,", "0.010,0,0,1,3,"),
    );
    put(
        "negative.toml",
        &ROPE.replace("lead_mass_kg = 0.05", "lead_mass_kg = -0.05"),
    );
    put("zero.toml", &ROPE.replace("links = 23", "links = 0"));
    put("missing.toml", &ROPE.replace("length_m = 0.55\n", ""));
    put("unknown.toml", &format!("{ROPE}wibble = 3\n"));
    put(
        "nan.toml",
        &ROPE.replace("radius_m = 0.0055", "radius_m = nan"),
    );
    put("text.toml", "this is not toml");
    put("damaged.json", "{\"version\": ");
    put(
        "notvideo.avi",
        "RIFF but not really, and long enough for a header",
    );
    put("empty.bin", "");
    fs::write(dir.path().join("bare.mcap"), b"\x89MCAP0\r\n").unwrap();
    put("cut.bin", "WAGR\u{1}\0\u{1}\0");
    put("other.bin", &format!("WAGR\u{9}{}", "\0".repeat(40)));
    put("camera.toml", "calibration = \"none.conf\"\n");
    put("limits.toml", "rate_hz = -250\n");
    put("slip.toml", "tcp_sped_max_m_s = 0.5\n");
    put(
        "faults.toml",
        "[[fault]]\nat_s = 1\nkind = \"joint_stuck\"\njoint = 9\n",
    );
    dir
}

/// Arguments, exit code, words that must be in the error.
type Case = (&'static [&'static str], i32, &'static [&'static str]);

const CASES: &[Case] = &[
    (&[], 2, &["Usage"]),
    (&["fling"], 2, &["fling"]),
    (&["demo", "--seed", "x"], 2, &["--seed"]),
    (&["bench"], 2, &["NAME"]),
    (
        &["bench", "wibble"],
        2,
        &["wibble", "possible values", "rope"],
    ),
    (&["bench", "track"], 2, &["--video", "camera.toml"]),
    (&["bench", "track", "--video", "none"], 2, &["none"]),
    (&["calib"], 2, &["Usage", "extrinsics"]),
    (&["demo", "--target", "1,2"], 2, &["x,y,z"]),
    (&["demo", "--target", "3,0,0.4"], 2, &["reach"]),
    (&["demo", "--target", "nan,0,0.4"], 2, &["finite"]),
    (&["demo", "--out", "."], 2, &["exists already"]),
    (&["demo", "--out", "rope.toml/run"], 2, &["rope.toml/run"]),
    (&["demo", "--task", "lob"], 1, &["lob", "not implemented"]),
    (&["replay", "none.run"], 2, &["none.run", "does not exist"]),
    (&["replay", "."], 2, &["no run folder", "cycles.bin"]),
    (&["replay", "empty.bin"], 2, &["empty.bin", "is empty"]),
    (
        &["replay", "notvideo.avi"],
        2,
        &["notvideo.avi", "no recording"],
    ),
    (
        &["replay", "cut.bin"],
        2,
        &["cut.bin", "cut off", "first chunk"],
    ),
    (&["replay", "other.bin"], 2, &["other.bin", "layout 9"]),
    (&["replay", "bare.mcap"], 2, &["bare.mcap", "/wag/replay"]),
    (&["record", "recover"], 2, &["FILE.mcap"]),
    (&["record", "recover", "none.mcap"], 2, &["none.mcap"]),
    (&["record", "recover", "."], 2, &["`.`"]),
    (
        &["record", "recover", "notvideo.avi"],
        2,
        &["notvideo.avi", "no MCAP file"],
    ),
    (&["ledger"], 2, &["runs"]),
    (&["ledger", "none"], 2, &["none"]),
    (&["ledger", ".", "--csv", "none/a.csv"], 2, &["none/a.csv"]),
    (&["ledger", "--result", "great"], 2, &["great", "broken"]),
    (&["ledger", "compare", "."], 2, &["SECOND"]),
    (
        &["ledger", "compare", ".", "none"],
        2,
        &["none", "run folder"],
    ),
    (&["ledger", "rerun", "."], 2, &["command.json"]),
    (&["ledger", "rerun", "none"], 2, &["none", "run folder"]),
    (&["explain", "none.run"], 2, &["none.run", "does not exist"]),
    (&["explain", "."], 2, &["no run folder", "cycles.bin"]),
    (&["explain", "empty.bin"], 2, &["empty.bin", "is empty"]),
    (
        &["explain", "notvideo.avi"],
        2,
        &["notvideo.avi", "no recording"],
    ),
    (
        &["explain", "cut.bin"],
        2,
        &["cut.bin", "cut off", "first chunk"],
    ),
    (&["explain", "other.bin"], 2, &["other.bin", "layout 9"]),
    (&["replay", ".", "--from-cycle=x"], 2, &["--from-cycle"]),
    (&["record", "--out", "."], 2, &["exists already"]),
    (&["film", "--out", "w"], 2, &["--device"]),
    (
        &["film", "--device", "none", "--out", "w"],
        2,
        &["camera none", "there is no such device", "/dev/v4l/by-id"],
    ),
    (
        &["film", "--device", "/dev/null", "--out", "w"],
        2,
        &["/dev/null", "no video device"],
    ),
    (
        &["film", "--device", "/dev/null", "--out", "w", "--fps", "0"],
        2,
        &["rate_hz is 0"],
    ),
    (
        &[
            "film",
            "--device",
            "/dev/null",
            "--out",
            "w",
            "--sensor-gain-raw",
            "5",
        ],
        2,
        &["--exposure-raw"],
    ),
    (&["record", "--seconds", "0"], 2, &["--seconds"]),
    (&["record", "--domain", "a b"], 2, &["a b", "letters"]),
    (&["watch", "none"], 2, &["none", "no run folder"]),
    (&["watch", "--domain", "a b"], 2, &["a b", "letters"]),
    (&["watch", "--bind", "here"], 2, &["--bind"]),
    (&["watch", "--bind", "127.0.0.1:99999"], 2, &["--bind"]),
    (&["watch", "--bind", "192.0.2.7:0"], 1, &["192.0.2.7"]),
    (&["watch", "--seconds", "nan"], 2, &["--seconds"]),
    (&["rig", "--report-ports", "1,2"], 2, &["four ports"]),
    (&["rig", "--bind", "here"], 2, &["--bind"]),
    (&["rig", "--faults", "f.toml"], 2, &["f.toml"]),
    (&["rig", "--faults", "text.toml"], 2, &["text.toml", "TOML"]),
    (
        &["rig", "--faults", "faults.toml"],
        2,
        &["faults.toml", "fault 1", "`joint` is 9", "from 1 to 7"],
    ),
    (&["rig", "--camera", "x"], 2, &["--rope"]),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "none.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["none.toml"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "negative.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["negative.toml", "lead_mass_kg", "-0.05"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "zero.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["zero.toml", "links"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "missing.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["missing.toml", "length_m"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "unknown.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["unknown.toml", "wibble"],
    ),
    (
        &[
            "sim", "rope", "--rope", "nan.toml", "--pose", "pose.csv", "--fps", "60", "--out",
            "o.npy",
        ],
        2,
        &["nan.toml", "radius_m"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "text.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["text.toml"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "nan.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["nan.csv", "line 12", "`x`"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "unsorted.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["unsorted.csv", "does not come after"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "columns.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["columns.csv", "t,x,y,z,qw,qx,qy,qz"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "noquat.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["noquat.csv", "quaternion"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "short.csv",
            "--fps",
            "60",
            "--out",
            "o.npy",
        ],
        2,
        &["short.csv", "two rows"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "-60",
            "--out",
            "o.npy",
        ],
        2,
        &["--fps"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--dt",
            "0",
            "--out",
            "o.npy",
        ],
        2,
        &["--dt"],
    ),
    (
        &[
            "sim",
            "rope",
            "--rope",
            "rope.toml",
            "--pose",
            "pose.csv",
            "--fps",
            "60",
            "--out",
            "no/o.npy",
        ],
        2,
        &["no/o.npy"],
    ),
    (
        &[
            "sim",
            "throw",
            "--rope",
            "rope.toml",
            "--joints",
            "pose.csv",
            "--out",
            "o.csv",
        ],
        2,
        &["pose.csv", "q1"],
    ),
    (&["wiggle"], 2, &["--csv", "--arm"]),
    (&["wiggle", "--csv", "no/w.csv"], 2, &["no/w.csv"]),
    (&["wiggle", "--arm", "192.0.2.1"], 2, &["--yes"]),
    (
        &[
            "track",
            "--video",
            "v.avi",
            "--camera",
            "none.toml",
            "--pose",
            "pose.csv",
            "--out",
            "k.json",
        ],
        2,
        &["none.toml"],
    ),
    (
        &[
            "track",
            "--video",
            "v.avi",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--out",
            "k.json",
        ],
        2,
        &["camera.toml"],
    ),
    (
        &[
            "track",
            "--video",
            "v.avi",
            "--camera",
            "camera.toml",
            "--out",
            "k.json",
        ],
        2,
        &["--joints"],
    ),
    (
        &[
            "track",
            "--video",
            "v.avi",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--keypoints",
            "1",
            "--out",
            "k.json",
        ],
        2,
        &["--keypoints"],
    ),
    (
        &[
            "identify",
            "--keypoints",
            "k.json",
            "--video",
            "v.avi",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--out",
            "r.toml",
        ],
        2,
        &["cannot be used with"],
    ),
    (
        &[
            "identify",
            "--keypoints",
            "k.json",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--method",
            "nn",
            "--model",
            "missing.onnx",
            "--out",
            "r.toml",
        ],
        2,
        &["missing.onnx"],
    ),
    (
        &[
            "identify",
            "--keypoints",
            "k.json",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--method",
            "nn",
            "--model",
            "rope.toml",
            "--out",
            "r.toml",
        ],
        2,
        &["rope.toml", "not an ONNX file"],
    ),
    (
        &[
            "identify",
            "--keypoints",
            "k.json",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--method",
            "cmaes",
            "--model",
            "m.onnx",
            "--out",
            "r.toml",
        ],
        2,
        &["m.onnx", "--method nn"],
    ),
    (
        &[
            "identify",
            "--keypoints",
            "k.json",
            "--camera",
            "camera.toml",
            "--pose",
            "pose.csv",
            "--method",
            "nn",
            "--model",
            LINKS,
            "--out",
            "r.toml",
        ],
        2,
        &["link", "only simulated films show"],
    ),
    (
        &["reproduce", "wiggle-ablation", "--method", "nn"],
        2,
        &["one wiggle only"],
    ),
    (
        &[
            "plan",
            "strike",
            "--rope",
            "rope.toml",
            "--target",
            "2.5,0,0.3",
            "--out",
            "p.json",
        ],
        2,
        &["reach", "nearest"],
    ),
    (
        &[
            "plan",
            "strike",
            "--rope",
            "rope.toml",
            "--target",
            "1,0,0.3",
            "--limits",
            "limits.toml",
            "--out",
            "p.json",
        ],
        2,
        &["limits.toml", "rate_hz"],
    ),
    (
        &["config", "check", "limits", "limits.toml"],
        2,
        &["limits.toml", "rate_hz"],
    ),
    (
        &["config", "check", "limits", "slip.toml"],
        2,
        &["slip.toml", "line 1", "did you mean `tcp_speed_max_m_s`?"],
    ),
    (
        &["config", "show", "planner", "none.toml"],
        2,
        &["none.toml", "cannot read"],
    ),
    (&["config", "show", "camera"], 2, &["camera", "planner"]),
    (&["config"], 2, &["Usage"]),
    (
        &[
            "plan",
            "drape",
            "--rope",
            "rope.toml",
            "--target",
            "1,0,0.3",
            "--robust",
            "8",
            "--out",
            "p.json",
        ],
        2,
        &["rope.toml", "posterior", "--robust"],
    ),
    (
        &[
            "plan",
            "strike",
            "--rope",
            "rope.toml",
            "--target",
            "1,0,0.3",
            "--arm-response",
            "limits.toml",
            "--out",
            "p.json",
        ],
        2,
        &["arm response", "limits.toml"],
    ),
    (&["check", "none.json"], 2, &["none.json"]),
    (
        &["check", "none.json", "--fence", "-1,1,0.2"],
        2,
        &["--fence", "6 numbers"],
    ),
    (
        &["check", "none.json", "--fence", "-1,1,0.2,-0.2,0,1"],
        2,
        &["boundary", "in y"],
    ),
    (
        &["check", "none.json", "--speed-factor", "0"],
        2,
        &["--speed-factor"],
    ),
    (&["check", "damaged.json"], 2, &["damaged.json"]),
    (
        &["throw", "damaged.json", "--arm", "127.0.0.1"],
        2,
        &["damaged.json"],
    ),
    (
        &[
            "score",
            "--video",
            "notvideo.avi",
            "--camera",
            "camera.toml",
            "--tip-rgb",
            "1,2,300",
            "--target-rgb",
            "0,0,0",
        ],
        2,
        &["300"],
    ),
    (&["latency"], 2, &["--arm", "--run"]),
    (
        &["latency", "--run", "none"],
        2,
        &["none", "does not exist"],
    ),
    (&["latency", "--run", "."], 2, &["cycles.csv"]),
    (
        &["latency", "--run", ".", "--arm", "127.0.0.1"],
        2,
        &["cannot be used with"],
    ),
    (
        &["latency", "--arm", "127.0.0.1", "--joints", "8"],
        2,
        &["8"],
    ),
    (
        &[
            "latency",
            "--arm",
            "127.0.0.1",
            "--excitation",
            "unknown.toml",
        ],
        2,
        &["unknown.toml"],
    ),
    (
        &["process", "planner", "--config", "none.toml"],
        2,
        &["none.toml"],
    ),
    (
        &["process", "planner", "--config", "unknown.toml"],
        2,
        &["unknown.toml"],
    ),
];

#[test]
fn wrong_input_gets_one_clear_line_and_leaves_nothing_behind() {
    let dir = prepare();
    let before = fs::read_dir(dir.path()).unwrap().count();
    for (args, code, words) in CASES {
        let output = wag(dir.path(), args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(
            output.status.code(),
            Some(*code),
            "wag {}: {said}",
            args.join(" ")
        );
        for word in *words {
            assert!(
                said.contains(word),
                "wag {}: `{word}` is not in: {said}",
                args.join(" ")
            );
        }
        assert!(!said.contains("panicked"), "wag {}: {said}", args.join(" "));
        let errors = said.lines().filter(|l| l.starts_with("error: ")).count();
        assert_eq!(errors.max(1), 1, "wag {}: {said}", args.join(" "));
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            before,
            "wag {} left something",
            args.join(" ")
        );
    }
}

#[test]
fn a_port_in_use_is_named_with_a_remedy() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let dir = tempfile::tempdir().unwrap();
    let output = wag(
        dir.path(),
        &["rig", "--command-port", &port, "--report-ports", "0,0,0,0"],
    );
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(&port), "{said}");
}

#[test]
fn json_errors_are_json() {
    let dir = tempfile::tempdir().unwrap();
    let output = wag(dir.path(), &["check", "none.json", "--json"]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["ok"], false);
    assert!(told["error"].as_str().unwrap().contains("none.json"));
}
