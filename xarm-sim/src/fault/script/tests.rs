use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/rig/faults.toml");

/// The example shows every kind that a message lists, and survives being written again.
#[test]
fn the_shipped_example_has_every_kind_and_comes_back() {
    let script = FaultScript::read(Path::new(EXAMPLE)).unwrap();
    let tables: Vec<Table> = script.clone().into();
    let listed = "[[fault]]\nat_s = 1".parse::<FaultScript>().unwrap_err();
    let listed = listed.to_string();
    let (_, kinds) = listed.split_once("give one of ").unwrap();
    let kinds: Vec<&str> = kinds
        .split(", ")
        .map(|kind| kind.trim_matches('`'))
        .collect();
    assert_eq!(kinds.len(), 36, "{listed}");
    for kind in kinds {
        let shown = tables.iter().any(|t| t["kind"].as_str() == Some(kind));
        assert!(shown, "{kind} is not shown");
    }
    assert_eq!(FaultScript::try_from(tables).unwrap(), script);
}

/// An entry, its fields apart by semicolons; the field that is named, and what is allowed.
const REFUSED: &str = r#"
at_s = 1                                                    | `kind`         | `stall`
at_s = 1; kind = "stal"                                     | `kind`         | `stall`
kind = "collision"                                          | `at_s`         | first_setpoint
kind = "collision"; on = "later"                            | `on`           | motion:PERCENT
kind = "collision"; on = "motion:50"                        | `motion_s`     | a number
at_s = 1; kind = "stall"                                    | `duration_s`   | a number from 0
at_s = 1; kind = "joint_stuck"; joint = 8                   | `joint` is 8   | from 1 to 7
at_s = nan; kind = "collision"                              | `at_s` is nan  | a number
at_s = 1; kind = "joint_stuck"                              | `joint`        | missing; give a whole number from 1 to 7
at_s = 1; kind = "joint_stuck"; joint = "4"                 | `joint` is "4" | from 1 to 7
at_s = "1"; kind = "collision"                              | `at_s` is "1"  | a number from 0
at_s = 1; kind = 5                                          | `kind` is 5    | `stall`
on = 5; kind = "collision"                                  | `on` is 5      | motion:PERCENT
at_s = 1; kind = "emergency_stop"; code = 4                 | `code` is 4    | from 1 to 3
at_s = 1; kind = "report_stop"; port = "30000"              | `port`         | `realtime`
at_s = 1; kind = "report_stop"; ports = "all"               | `ports`        | `port`
at_s = 1; kind = "collision"; joint = 1                     | `joint`        | collision
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
    let whole = std::fs::read_to_string(EXAMPLE).unwrap();
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
