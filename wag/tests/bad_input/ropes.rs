//! Commands from files to files: films, ropes, plans.

use super::Case;

pub(crate) const CASES: &[Case] = &[
    ("calib", 2, &["Usage", "extrinsics"]),
    (
        "sim rope --rope rope.toml --pose pose.csv --fps -60 --out o.npy",
        2,
        &["--fps"],
    ),
    (
        "sim rope --rope rope.toml --pose pose.csv --fps 60 --dt 0 --out o.npy",
        2,
        &["--dt"],
    ),
    (
        "sim rope --rope rope.toml --pose pose.csv --fps 60 --out no/o.npy",
        2,
        &["no/o.npy"],
    ),
    (
        "sim throw --rope rope.toml --joints pose.csv --out o.csv",
        2,
        &["pose.csv", "q1"],
    ),
    (
        "track --video v.avi --camera none.toml --pose pose.csv --out k.json",
        2,
        &["none.toml"],
    ),
    (
        "track --video v.avi --camera camera.toml --pose pose.csv --out k.json",
        2,
        &["camera.toml"],
    ),
    (
        "track --video v.avi --camera camera.toml --out k.json",
        2,
        &["--joints"],
    ),
    (
        "track --video v.avi --camera camera.toml --pose pose.csv --keypoints 1 --out k.json",
        2,
        &["--keypoints"],
    ),
    (
        "plan strike --rope doubted.toml --target 0.8,0,0.3 --out p.json",
        1,
        &["in doubt", "end is not confirmed", "--accept-unconfirmed"],
    ),
    (
        "identify --keypoints k.json --video v.avi --camera camera.toml --pose pose.csv --out r.toml",
        2,
        &["cannot be used with"],
    ),
    (
        "identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model missing.onnx --out r.toml",
        2,
        &["missing.onnx"],
    ),
    (
        "identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model rope.toml --out r.toml",
        2,
        &["rope.toml", "not an ONNX file"],
    ),
    (
        "identify --keypoints k.json --camera camera.toml --pose pose.csv --method cmaes --model m.onnx --out r.toml",
        2,
        &["m.onnx", "--method nn"],
    ),
    (
        "identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model LINKS --out r.toml",
        2,
        &["link", "only simulated films show"],
    ),
    (
        "plan strike --rope rope.toml --target 2.5,0,0.3 --out p.json",
        2,
        &["reach", "nearest"],
    ),
    (
        "plan strike --rope rope.toml --target 0,0,0.1 --reach r.svg --out p.json",
        2,
        &["arm's base"],
    ),
    (
        "plan strike --rope rope.toml --target 1,0,0.3 --limits limits.toml --out p.json",
        2,
        &["limits.toml", "rate_hz"],
    ),
    (
        "plan drape --rope rope.toml --target 1,0,0.3 --robust 8 --out p.json",
        2,
        &["rope.toml", "posterior", "--robust"],
    ),
    (
        "plan strike --rope rope.toml --target 1,0,0.3 --arm-response limits.toml --out p.json",
        2,
        &["arm response", "limits.toml"],
    ),
    ("check none.json", 2, &["none.json"]),
    (
        "check none.json --fence -1,1,0.2",
        2,
        &["--fence", "6 numbers"],
    ),
    (
        "check none.json --fence -1,1,0.2,-0.2,0,1",
        2,
        &["boundary", "in y"],
    ),
    ("check none.json --speed-factor 0", 2, &["--speed-factor"]),
    (
        "check none.json --speed-factor 100",
        2,
        &["--speed-factor", "1 m/s"],
    ),
    (
        "identify --keypoints k.json --lead-mass 50 --out r.toml",
        2,
        &["--lead-mass", "kg"],
    ),
    ("check damaged.json", 2, &["damaged.json"]),
    (
        "score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,300 --target-rgb 0,0,0",
        2,
        &["300"],
    ),
];

/// Rope, pose, and words in the error of `wag sim rope`.
pub(crate) const SIM_ROPE: &[(&str, &str, &[&str])] = &[
    ("none.toml", "pose.csv", &["none.toml"]),
    (
        "negative.toml",
        "pose.csv",
        &["negative.toml", "lead_mass_kg", "-0.05"],
    ),
    ("zero.toml", "pose.csv", &["zero.toml", "links"]),
    ("missing.toml", "pose.csv", &["missing.toml", "length_m"]),
    ("unknown.toml", "pose.csv", &["unknown.toml", "wibble"]),
    ("nan.toml", "pose.csv", &["nan.toml", "radius_m"]),
    ("text.toml", "pose.csv", &["text.toml"]),
    ("rope.toml", "nan.csv", &["nan.csv", "line 12", "`x`"]),
    (
        "rope.toml",
        "unsorted.csv",
        &["unsorted.csv", "does not come after"],
    ),
    (
        "rope.toml",
        "columns.csv",
        &["columns.csv", "t,x,y,z,qw,qx,qy,qz"],
    ),
    ("rope.toml", "noquat.csv", &["noquat.csv", "quaternion"]),
    ("rope.toml", "short.csv", &["short.csv", "two rows"]),
];
