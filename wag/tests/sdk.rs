//! The vendor's own Python client against `wag rig`, by the conformance check
//! that lies beside the checkout.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn the_vendor_sdk_accepts_the_simulated_arm() {
    let check = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/checks/xarm_sdk_check.py");
    if !check.is_file() {
        println!("skipped: {} not found", check.display());
        return;
    }
    let Some(python) = std::env::var_os("WAG_SDK_PYTHON") else {
        println!("skipped: WAG_SDK_PYTHON does not name a Python with xarm-python-sdk installed");
        return;
    };
    let mut rig = Command::new(env!("CARGO_BIN_EXE_wag"))
        .args(["rig", "--command-port", "0", "--report-ports", "0,0,0,0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(rig.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    let ports: Vec<&str> = line
        .split(|c: char| !c.is_ascii_digit())
        .filter(|p| p.len() >= 4)
        .collect();
    assert_eq!(ports.len(), 5, "unexpected greeting: {line}");
    let reports = [ports[2], ports[3], ports[4]].join(",");
    let output = Command::new(python)
        .arg(&check)
        .args([
            "127.0.0.1",
            "--control-port",
            ports[0],
            "--report-ports",
            &reports,
        ])
        .output()
        .unwrap();
    rig.kill().unwrap();
    rig.wait().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(
        output.status.success(),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
