//! A training that is killed goes on to the same result.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "tests may fail loudly"
)]

use phi_training::config::TrainingConfig;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const STEPS: usize = 80;

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
    let mut config = TrainingConfig::load(&shipped).unwrap();
    config.data.ropes = 24;
    config.data.held_out = 6;
    config.data.keypoints = 5;
    config.network.channels = [4, 6, 8];
    config.network.pooled = 5;
    config.training.steps = STEPS;
    config.training.batch = 8;
    config.training.warmup_steps = 4;
    config.training.checkpoint_every = 2;
    config.training.validate_every = 20;
    config.training.validation_ropes = 6;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("killed-training");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let text = toml::to_string(&config).unwrap();
    std::fs::write(folder.join("tiny.toml"), text).unwrap();

    let train = |out| phi_train(&folder, "train", ["--out", out]);
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
        let mut command = phi_train(&folder, "evaluate", ["--run", run]);
        let output = command.arg("--json").output().unwrap();
        assert!(output.status.success());
        output.stdout
    };
    let whole = judged("whole");
    assert!(whole.starts_with(b"{"));
    assert_eq!(whole, judged("killed"));
}
