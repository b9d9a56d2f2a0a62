//! Commands from files to files: films, ropes, plans.

use super::Case;

pub(crate) const CASES: &[Case] = &[
    ("calib", 2, &["Usage", "extrinsics"]),
    (
        "sim rope --rope none.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["none.toml"],
    ),
    (
        "sim rope --rope negative.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["negative.toml", "lead_mass_kg", "-0.05"],
    ),
    (
        "sim rope --rope zero.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["zero.toml", "links"],
    ),
    (
        "sim rope --rope missing.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["missing.toml", "length_m"],
    ),
    (
        "sim rope --rope unknown.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["unknown.toml", "wibble"],
    ),
    (
        "sim rope --rope nan.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["nan.toml", "radius_m"],
    ),
    (
        "sim rope --rope text.toml --pose pose.csv --fps 60 --out o.npy",
        2,
        &["text.toml"],
    ),
    (
        "sim rope --rope rope.toml --pose nan.csv --fps 60 --out o.npy",
        2,
        &["nan.csv", "line 12", "`x`"],
    ),
    (
        "sim rope --rope rope.toml --pose unsorted.csv --fps 60 --out o.npy",
        2,
        &["unsorted.csv", "does not come after"],
    ),
    (
        "sim rope --rope rope.toml --pose columns.csv --fps 60 --out o.npy",
        2,
        &["columns.csv", "t,x,y,z,qw,qx,qy,qz"],
    ),
    (
        "sim rope --rope rope.toml --pose noquat.csv --fps 60 --out o.npy",
        2,
        &["noquat.csv", "quaternion"],
    ),
    (
        "sim rope --rope rope.toml --pose short.csv --fps 60 --out o.npy",
        2,
        &["short.csv", "two rows"],
    ),
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
    ("check damaged.json", 2, &["damaged.json"]),
    (
        "score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,300 --target-rgb 0,0,0",
        2,
        &["300"],
    ),
];
