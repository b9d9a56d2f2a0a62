//! Commands that read, list or watch runs.

use super::Case;

pub(crate) const CASES: &[Case] = &[
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
    (
        &["track", "--video", "bare.mcap", "--out", "k.json"],
        2,
        &["bare.mcap", "no motion"],
    ),
    (
        &["identify", "--video", "bare.mcap", "--out", "r.toml"],
        2,
        &["bare.mcap", "no motion"],
    ),
    (
        &[
            "track",
            "--video",
            "bare.mcap",
            "--fps",
            "60",
            "--out",
            "k.json",
        ],
        2,
        &["bare.mcap", "--fps"],
    ),
    (
        &[
            "track", "--video", "v.avi", "--part", "1", "--out", "k.json",
        ],
        2,
        &["v.avi", "--part"],
    ),
    (
        &[
            "track", "--video", "v.avi", "--pose", "pose.csv", "--out", "k.json",
        ],
        2,
        &["--camera"],
    ),
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
    (&["record", "--seconds", "0"], 2, &["--seconds"]),
    (&["record", "--domain", "a b"], 2, &["a b", "letters"]),
    (&["watch", "none"], 2, &["none", "no run folder"]),
    (&["watch", "--domain", "a b"], 2, &["a b", "letters"]),
    (&["watch", "--bind", "here"], 2, &["--bind"]),
    (&["watch", "--bind", "127.0.0.1:99999"], 2, &["--bind"]),
    (&["watch", "--bind", "192.0.2.7:0"], 1, &["192.0.2.7"]),
    (&["watch", "--seconds", "nan"], 2, &["--seconds"]),
];
