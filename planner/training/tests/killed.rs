//! A training that is killed goes on to the same result.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "tests may fail loudly"
)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const STEPS: i64 = 80;

/// `phi-train STEP` in a folder, on the tiny configuration there.
fn phi_train(folder: &Path, step: &str, run: [&str; 2]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_phi-train"));
    command
        .current_dir(folder)
        .args([step, "--config", "tiny.toml", "--data", "data"])
        .args(run)
        .stderr(Stdio::null());
    command
}

#[test]
fn a_killed_training_goes_on_to_the_same_result() {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/models/phi-nn.toml");
    let config = std::fs::read_to_string(shipped).unwrap();
    let mut config: toml::Table = config.parse().unwrap();
    let mut set = |table: &str, key: &str, value: toml::Value| config[table][key] = value;
    set("data", "ropes", 24.into());
    set("data", "held_out", 6.into());
    set("data", "keypoints", 5.into());
    set("network", "channels", vec![4, 6, 8].into());
    set("network", "pooled", 5.into());
    set("training", "steps", STEPS.into());
    set("training", "batch", 8.into());
    set("training", "warmup_steps", 4.into());
    set("training", "checkpoint_every", 2.into());
    set("training", "validate_every", 20.into());
    set("training", "validation_ropes", 6.into());
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("tiny.toml"), config.to_string()).unwrap();

    let train = |out| phi_train(folder, "train", ["--out", out]);
    assert!(train("whole").status().unwrap().success());

    let mut killed = train("killed").spawn().unwrap();
    let began = Instant::now();
    while !folder.join("killed/checkpoint.phi").exists() {
        assert!(began.elapsed() < Duration::from_secs(120), "no checkpoint");
        std::thread::sleep(Duration::from_millis(1));
    }
    killed.kill().unwrap();
    assert!(
        !killed.wait().unwrap().success(),
        "it ended before it was killed"
    );
    assert!(train("killed").status().unwrap().success());

    let metrics = |run: &str| std::fs::read(folder.join(run).join("metrics.jsonl")).unwrap();
    assert_eq!(metrics("whole"), metrics("killed"));
    let judged = |run| {
        let mut command = phi_train(folder, "evaluate", ["--run", run]);
        let output = command.arg("--json").output().unwrap();
        assert!(output.status.success());
        output.stdout
    };
    let whole = judged("whole");
    assert!(whole.starts_with(b"{"));
    assert_eq!(whole, judged("killed"));
}
