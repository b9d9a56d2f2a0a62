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

/// An entry, its fields apart by semicolons; the field that is named, and what is allowed.
const REFUSED: &str = r#"
at_s = 1                                                    | `kind`         | "stall"
at_s = 1; kind = "stal"                                     | `kind`         | "stall"
kind = "collision"                                          | `at_s`         | first_setpoint
kind = "collision"; on = "later"                            | `on`           | motion:PERCENT
kind = "collision"; on = "motion:50"                        | `motion_s`     | a number
at_s = 1; kind = "stall"                                    | `duration_s`   | a number from 0
at_s = 1; kind = "joint_stuck"; joint = 8                   | `joint` is 8   | from 1 to 7
at_s = nan; kind = "collision"                              | `at_s` is nan  | a number
at_s = 1; kind = "report_stop"; port = "30000"              | `port`         | "realtime"
at_s = 1; kind = "collision"; duration_s = 1                | `duration_s`   | collision
at_s = 1; kind = "firmware_changed"; version = "two"        | `version`      | 2.7.1
"#;

#[test]
fn errors_name_entry_field_and_what_is_allowed() {
    let fine = "[[fault]]\nat_s = 1\nkind = \"cable_pull\"\nduration_s = 0.5\n";
    for case in REFUSED.trim().lines() {
        let [entry, field, allowed] = case.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
            panic!("{case}");
        };
        let text = format!("{fine}[[fault]]\n{}", entry.replace("; ", "\n"));
        let said = text.parse::<FaultScript>().unwrap_err().to_string();
        let words = ["fault 2", field, allowed];
        assert!(words.iter().all(|w| said.contains(w)), "{entry}: {said}");
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
