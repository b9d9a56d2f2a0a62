//! Figures of the documents: made from runs that are kept, written into documents, and checked.
#![cfg(test)]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn figures(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_experiments"));
    command.current_dir(folder).arg("figures");
    command.args(line.split_whitespace()).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// README and book say what the runs that are kept gave.
#[test]
fn the_documents_say_what_the_records_give() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let output = figures(root, "check");
    assert!(output.status.success(), "{}", said(&output));
}

/// Commits files in a folder.
fn commit(folder: &Path, files: &str) {
    let shell = format!(
        "git add {files} && git -c user.name=a -c user.email=a@example.org commit -q -m one"
    );
    let made = Command::new("sh")
        .args(["-c", &shell])
        .current_dir(folder)
        .status();
    assert!(made.unwrap().success());
}

/// A folder with a commit, and a `wag` whose throw with an odd seed fails and that counts its runs.
fn workplace() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write(
        "wag",
        r#"#!/bin/sh
echo run >>runs.txt
seed="$6"
mkdir -p "$8" && echo film >"$8/run.mcap"
if [ "$((seed % 2))" = 1 ]; then
  echo '{"ok": false, "error": "the rope is lost"}'
  exit 1
fi
echo '{"ok": true, "true_tip_target_distance_m": 0.0025}'
"#,
    );
    write(
        "README.md",
        "one\n<!-- figures\n{lob.ok.true} of {lob.n} throws, median {lob.miss_m.median:mm1} mm\n-->\n<!-- end of figures -->\n",
    );
    let shell = ["-c", "chmod +x wag && git init -q ."];
    let made = Command::new("sh")
        .args(shell)
        .current_dir(dir.path())
        .status();
    assert!(made.unwrap().success());
    std::fs::create_dir_all(dir.path().join("docs/figures")).unwrap();
    write("docs/figures/lob.jsonl", "an older record\n");
    commit(dir.path(), "wag README.md docs");
    dir
}

#[test]
fn figures_are_made_once_from_seeds_of_the_commit_and_documents_are_held_to_them() {
    let dir = workplace();
    let runs = || {
        std::fs::read_to_string(dir.path().join("runs.txt"))
            .unwrap()
            .lines()
            .count()
    };
    let make = |runs: u64| format!("make lob --json --out kept --wag ./wag --runs {runs}");
    let fill = |how: &str| figures(dir.path(), &format!("{how} README.md"));

    let output = figures(dir.path(), &make(3));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
    let study = &report["studies"][0];
    let failed = study["failed"].as_u64().unwrap();
    assert!(failed == 1 || failed == 2, "{report}");
    assert_eq!(runs(), 3);
    // That the record of the commit differs now does not matter: no program is built from it.
    // More runs: those that are kept are not made again, and what failed can be looked into.
    assert!(figures(dir.path(), &make(4)).status.success());
    assert_eq!(runs(), 4);
    let record = std::fs::read_to_string(dir.path().join("docs/figures/lob.jsonl")).unwrap();
    assert_eq!(record.matches("the rope is lost").count(), 2);
    let folders = std::fs::read_dir(dir.path().join("kept/lob")).unwrap();
    let folders = folders.filter(|entry| entry.as_ref().unwrap().path().is_dir());
    assert_eq!(folders.count(), 2);

    let output = fill("check");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said(&output).contains("`README.md`, line 5"),
        "{}",
        said(&output)
    );
    assert!(fill("write").status.success());
    let text = std::fs::read_to_string(dir.path().join("README.md")).unwrap();
    assert!(text.contains("\n2 of 4 throws, median 2.5 mm\n"), "{text}");
    assert!(fill("check").status.success());
    std::fs::write(
        dir.path().join("README.md"),
        text.replace("median 2.5", "median 1.5"),
    )
    .unwrap();
    let output = fill("check");
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("median 1.5"), "{}", said(&output));
}

#[test]
fn changed_sources_another_program_and_unknown_studies_are_refused() {
    let dir = workplace();
    let refused = |line: &str, word: &str| {
        let output = figures(dir.path(), line);
        assert_eq!(output.status.code(), Some(2), "{line}: {}", said(&output));
        assert!(said(&output).contains(word), "{line}: {}", said(&output));
    };
    let line = "make lob --out kept --wag ./wag --runs 1";
    refused(
        "make lobs --out kept",
        "no study `lobs`; there are strike, lob",
    );
    refused("make lob --out kept --wag ./wog", "wog");
    refused("check missing.md --records .", "missing.md");
    refused("check README.md --records .", "lob.jsonl");
    refused("check wag --records .", "no block of figures");
    assert!(figures(dir.path(), line).status.success());
    let script = std::fs::read_to_string(dir.path().join("wag")).unwrap();
    std::fs::write(dir.path().join("wag"), script + "# changed\n").unwrap();
    refused(line, "commit first");
    commit(dir.path(), "wag");
    refused(line, "name another folder with --out");
}
