use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// The example names every kind once, and survives being written again.
#[test]
fn the_shipped_example_has_every_kind_and_comes_back() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/rig/faults.toml");
    let script = FaultScript::read(&path).unwrap();
    let tables: Vec<Table> = script.clone().into();
    for kind in KINDS {
        assert!(
            tables.iter().any(|t| t["kind"].as_str() == Some(kind.name)),
            "{} is not shown",
            kind.name
        );
    }
    assert_eq!(FaultScript::try_from(tables).unwrap(), script);
}

#[test]
fn errors_name_entry_field_and_what_is_allowed() {
    let fine = "[[fault]]\nat_s = 1\nkind = \"cable_pull\"\nduration_s = 0.5\n";
    let cases = [
        ("[[fault]]\nat_s = 1", ["fault 2", "`kind`", "\"stall\""]),
        (
            "[[fault]]\nat_s = 1\nkind = \"stal\"",
            ["fault 2", "`kind`", "\"stall\""],
        ),
        (
            "[[fault]]\nkind = \"collision\"",
            ["fault 2", "`at_s`", "first_setpoint"],
        ),
        (
            "[[fault]]\nkind = \"collision\"\non = \"later\"",
            ["fault 2", "`on`", "motion:PERCENT"],
        ),
        (
            "[[fault]]\nkind = \"collision\"\non = \"motion:50\"",
            ["fault 2", "`motion_s`", "a number"],
        ),
        (
            "[[fault]]\nat_s = 1\nkind = \"stall\"",
            ["fault 2", "`duration_s`", "a number from 0"],
        ),
        (
            "[[fault]]\nat_s = 1\nkind = \"joint_stuck\"\njoint = 8",
            ["fault 2", "`joint` is 8", "from 1 to 7"],
        ),
        (
            "[[fault]]\nat_s = nan\nkind = \"collision\"",
            ["fault 2", "`at_s` is nan", "a number"],
        ),
        (
            "[[fault]]\nat_s = 1\nkind = \"report_stop\"\nport = \"30000\"",
            ["fault 2", "`port`", "\"realtime\""],
        ),
        (
            "[[fault]]\nat_s = 1\nkind = \"collision\"\nduration_s = 1",
            ["fault 2", "`duration_s`", "collision"],
        ),
        (
            "[[fault]]\nat_s = 1\nkind = \"firmware_changed\"\nversion = \"two\"",
            ["fault 2", "`version`", "2.7.1"],
        ),
    ];
    for (text, words) in cases {
        let said = format!("{fine}{text}")
            .parse::<FaultScript>()
            .unwrap_err()
            .to_string();
        assert!(words.iter().all(|w| said.contains(w)), "{text}: {said}");
    }
    let top = "seed = 1".parse::<FaultScript>().unwrap_err().to_string();
    assert!(top.contains("`seed`"), "{top}");
}

#[test]
fn a_missing_file_is_named() {
    let said = FaultScript::read(Path::new("no_such_script.toml"))
        .unwrap_err()
        .to_string();
    assert!(said.contains("no_such_script.toml"), "{said}");
}

#[test]
fn spoilt_scripts_are_read_or_refused_and_survive_being_written() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/rig/faults.toml");
    let whole = std::fs::read_to_string(path).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..3000 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = b"0-9.e\n\"#=[]x"[rng.random_range(0..12)];
        }
        let Ok(text) = String::from_utf8(bytes) else {
            continue;
        };
        match text.parse::<FaultScript>() {
            Ok(script) => {
                let tables: Vec<Table> = script.clone().into();
                assert_eq!(FaultScript::try_from(tables).unwrap(), script);
                read += 1;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(read > 100 && refused > 100, "{read} {refused}");
}
