//! Commands that start processes or move an arm, and the configuration.

use super::Case;

pub(crate) const CASES: &[Case] = &[
    ("", 2, &["Usage"]),
    ("fling", 2, &["fling"]),
    ("demo --seed x", 2, &["--seed"]),
    ("bench", 2, &["NAME"]),
    ("bench wibble", 2, &["wibble", "possible values", "record"]),
    ("demo --target 1,2", 2, &["x,y,z"]),
    ("demo --target 3,0,0.4", 2, &["reach"]),
    ("demo --target nan,0,0.4", 2, &["finite"]),
    ("demo --out .", 2, &["exists already"]),
    ("demo --out rope.toml/run", 2, &["rope.toml/run"]),
    ("demo --task lob", 1, &["lob", "not implemented"]),
    ("film --out w", 2, &["--device"]),
    (
        "film --device none --out w",
        2,
        &["camera none", "there is no such device", "/dev/v4l/by-id"],
    ),
    (
        "film --device /dev/null --out w",
        2,
        &["/dev/null", "not a video device"],
    ),
    (
        "film --device /dev/null --out w --fps 0",
        2,
        &["rate_hz is 0"],
    ),
    (
        "film --device /dev/null --out w --sensor-gain-raw 5",
        2,
        &["--exposure-raw"],
    ),
    ("rig --report-ports 1,2", 2, &["four ports"]),
    ("rig --bind here", 2, &["--bind"]),
    ("rig --faults f.toml", 2, &["f.toml"]),
    ("rig --faults text.toml", 2, &["text.toml", "TOML"]),
    (
        "rig --faults faults.toml",
        2,
        &["faults.toml", "fault 1", "`joint` is 9", "from 1 to 7"],
    ),
    ("rig --camera x", 2, &["--rope"]),
    ("wiggle", 2, &["--csv", "--arm"]),
    ("wiggle --csv no/w.csv", 2, &["no/w.csv"]),
    ("wiggle --arm 192.0.2.1", 2, &["--yes"]),
    (
        "config check limits limits.toml",
        2,
        &["limits.toml", "rate_hz"],
    ),
    (
        "config check limits slip.toml",
        2,
        &["slip.toml", "line 1", "did you mean `tcp_speed_max_m_s`?"],
    ),
    (
        "config show planner none.toml",
        2,
        &["none.toml", "cannot read"],
    ),
    ("config show camera", 2, &["camera", "planner"]),
    ("config", 2, &["Usage"]),
    ("throw damaged.json --arm 127.0.0.1", 2, &["damaged.json"]),
    ("latency", 2, &["--arm", "--run"]),
    ("latency --run none", 2, &["none", "does not exist"]),
    ("latency --run .", 2, &["no run folder", "run.mcap"]),
    (
        "latency --run . --arm 127.0.0.1",
        2,
        &["cannot be used with"],
    ),
    ("latency --arm 127.0.0.1 --joints 8", 2, &["8"]),
    (
        "latency --arm 127.0.0.1 --excitation unknown.toml",
        2,
        &["unknown.toml"],
    ),
    ("process planner --config none.toml", 2, &["none.toml"]),
    (
        "process planner --config unknown.toml",
        2,
        &["unknown.toml"],
    ),
];
