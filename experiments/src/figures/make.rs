//! Making the figures of a study from seeds that nobody chose.

use super::args::MakeFiguresArgs;
use super::record::{Record, Source};
use super::rig::Rig;
use super::study::{Program, Study, throw};
use crate::program::program_at;
use anyhow::{Context, ensure};
use cli_output::{Machine, OrInput, Outcome, Stage, is_interrupted};
use run_log::files;
use serde_json::{Map, Value, json};
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::SystemTime;

/// Seeds kept for each study.
const SEEDS: u64 = 1000;
/// Exit code of a command whose line or files cannot be worked with.
const BAD_INPUT: i32 = 2;

/// The commit whose sources lie here, unchanged.
pub fn commit() -> anyhow::Result<String> {
    let git = |args: &[&str]| -> anyhow::Result<String> {
        let output = Command::new("git")
            .args(args)
            .output()
            .context("cannot run git")?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(
            output.status.success(),
            "git {}: {}",
            args.join(" "),
            said.trim()
        );
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    // What is made here stands in documents, which no program is built from.
    let built_from = ["--", ".", ":(exclude)docs", ":(exclude)*.md"];
    let status = ["status", "--porcelain", "--untracked-files=no"];
    let changed = git(&[&status[..], &built_from].concat())?;
    ensure!(
        changed.is_empty(),
        "the sources differ from their commit: figures say from which commit they are, so commit first"
    );
    git(&["rev-parse", "--short=12", "HEAD"])
}

/// The first seed of the study in place `index`: from the hash of the commit, which nobody can
/// pick, so that what is judged was not seen before. An even one for the results of `experiments`, whose
/// odd seeds are for tuning.
fn first_seed(commit: &str, index: usize, program: Program) -> anyhow::Result<u64> {
    let digits = commit.get(..7).context("the commit has no hash")?;
    let number = u64::from_str_radix(digits, 16).context("the commit has no hash")?;
    let seed = number + SEEDS * index as u64;
    Ok(match program {
        Program::Wag | Program::WagBesideRig => seed,
        Program::Experiments => 2 * seed,
    })
}

/// A study that is being made.
struct Making<'a> {
    study: &'a Study,
    program: PathBuf,
    /// Keeps each run's report.
    folder: PathBuf,
    source: Source,
}

/// Makes the figures of a study, or goes on where an earlier call was interrupted.
pub fn make(args: &MakeFiguresArgs, study: &Study, commit: &str, index: usize) -> Outcome<Value> {
    let folder = args.out.join(study.name);
    let program = match study.program {
        Program::Wag | Program::WagBesideRig => args.wag.clone().map_or_else(|| beside("wag"), Ok),
        Program::Experiments => std::env::current_exe().context("this program's own file"),
    }
    .or_input()?;
    let making = Making {
        source: Source {
            study: study.name.to_owned(),
            command: command_line(study),
            commit: commit.to_owned(),
            program: program_at(&program).or_input()?,
            machine: Machine::here().to_string(),
            day: today(),
            first_seed: first_seed(commit, index, study.program).or_input()?,
            load: study.load,
        },
        study,
        program,
        folder,
    };
    making.keep_source().or_input()?;
    let stage = Stage::begin(study.name);
    let runs = match study.program {
        Program::Experiments => study.runs,
        Program::Wag | Program::WagBesideRig => args.runs.unwrap_or(study.runs),
    };
    let mut rows = Vec::new();
    for run in 0..runs {
        let seed = making.source.first_seed + run;
        let report = making.report(seed).or_failed()?;
        rows.push(match study.program {
            Program::Wag | Program::WagBesideRig => throw(seed, &report),
            Program::Experiments => result(report),
        });
        let failed = rows.iter().filter(|row| row["ok"] != true).count();
        let made = Progress {
            done: u32::try_from(rows.len()).unwrap_or(u32::MAX),
            total: u32::try_from(runs).unwrap_or(u32::MAX),
            value: failed as f64,
            label: "runs, failed".to_owned(),
        };
        if stage.go_on(&made) == ControlFlow::Break(()) {
            return Err(failed!(
                "interrupted after {} of {runs} runs; the same command goes on from there",
                rows.len()
            ));
        }
    }
    let failed = rows.iter().filter(|row| row["ok"] != true).count();
    let record = Record {
        source: making.source,
        rows,
    };
    let path = record.write(&args.records).or_failed()?;
    let seconds = stage.done(&format!(
        "{runs} runs, {failed} failed, in `{}`",
        path.display()
    ));
    Ok(json!({
        "study": study.name, "runs": runs, "failed": failed,
        "record": path.display().to_string(), "seconds": seconds,
    }))
}

/// As somebody would type it.
fn command_line(study: &Study) -> String {
    let args = study.args.join(" ");
    match study.program {
        Program::Wag => format!("wag {args} --seed SEED"),
        Program::WagBesideRig => format!(
            "wag {args} --seed SEED --arm 127.0.0.1 --camera DOMAIN, in front of wag rig --rope random --camera DOMAIN --seed SEED"
        ),
        Program::Experiments if !study.has_seed => format!("experiments {args}"),
        Program::Experiments => format!("experiments {args} --seed SEED"),
    }
}

/// Another program of the same build.
fn beside(name: &str) -> anyhow::Result<PathBuf> {
    let own = std::env::current_exe().context("this program's own file")?;
    let path = own.with_file_name(name);
    ensure!(
        path.exists(),
        "`{}` is not there: build it (`cargo build --release`), or name another with --wag",
        path.display()
    );
    Ok(path)
}

/// The day (UTC).
fn today() -> String {
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    now.split('T').next().unwrap_or_default().to_owned()
}

impl Making<'_> {
    /// Writes down of what the reports in the folder are, or compares with what they are of.
    fn keep_source(&self) -> anyhow::Result<()> {
        files::create_folder(&self.folder)?;
        let path = self.folder.join("source.json");
        if !path.exists() {
            return files::write_json(&path, &self.source);
        }
        let found: Source = files::read_json(&path)?;
        let today = Source {
            day: self.source.day.clone(),
            ..found.clone()
        };
        ensure!(
            today == self.source,
            "`{}` keeps runs of commit {}, program {}: name another folder with --out",
            self.folder.display(),
            found.commit,
            found.program
        );
        Ok(())
    }

    /// The report of the run with a seed, made now unless it is kept.
    fn report(&self, seed: u64) -> anyhow::Result<Value> {
        let kept = self.folder.join(format!("{seed}.json"));
        if kept.exists() {
            return files::read_json(&kept);
        }
        let run = self.folder.join(format!("run-{seed}"));
        let stop = AtomicBool::new(false);
        let output = thread::scope(|scope| {
            for _ in 0..self.study.load {
                scope.spawn(|| {
                    while !stop.load(Ordering::Relaxed) {
                        core::hint::spin_loop();
                    }
                });
            }
            let output = self.run(seed, &run);
            stop.store(true, Ordering::Relaxed);
            output
        })?;
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        let last = said.lines().last().unwrap_or_default();
        // Neither what was stopped with this program nor what could not begin tells anything.
        let done = output.status.success();
        ensure!(
            done || !is_interrupted(),
            "interrupted at seed {seed}; the same command goes on from there"
        );
        let is_thrown = self.study.program != Program::Experiments;
        ensure!(
            done || (is_thrown && output.status.code() != Some(BAD_INPUT)),
            "{}, seed {seed}: {last}",
            self.source.command
        );
        let mut report = match serde_json::from_slice(&output.stdout) {
            Ok(Value::Object(report)) => report,
            _ => Map::from_iter([(
                "error".to_owned(),
                json!(format!("{}: {last}", output.status)),
            )]),
        };
        let ok = done && report.get("ok") == Some(&Value::Bool(true));
        report.insert("ok".to_owned(), ok.into());
        if let Some(Value::String(error)) = report.get_mut("error") {
            *error = error.replace(&run.display().to_string(), "RUN");
        }
        let report = Value::Object(report);
        files::write_json(&kept, &report)?;
        // What failed is looked into; a hundred recordings that nobody reads fill the disk.
        if ok && is_thrown {
            let _ = std::fs::remove_dir_all(&run);
        }
        Ok(report)
    }

    fn run(&self, seed: u64, run: &Path) -> anyhow::Result<Output> {
        let _ = std::fs::remove_dir_all(run);
        let mut command = Command::new(&self.program);
        command.args(self.study.args).arg("--json");
        if self.study.has_seed {
            command.args(["--seed", &seed.to_string()]);
        }
        let rig = match self.study.program {
            Program::WagBesideRig => Some(Rig::start(&self.program, seed)?),
            Program::Wag | Program::Experiments => None,
        };
        if let Some(rig) = &rig {
            command.args(rig.arguments()?);
        }
        command.arg("--out").arg(run).stdin(Stdio::null());
        let fail = || format!("cannot run `{}`", self.program.display());
        command.output().with_context(fail)
    }
}

/// What is kept of a report of `experiments`: neither the trials nor where files went.
fn result(mut report: Value) -> Value {
    if let Some(fields) = report.as_object_mut() {
        for name in ["out", "picture", "trials"] {
            fields.remove(name);
        }
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_come_from_the_commit_and_do_not_meet() {
        let seed = |index, program| first_seed("6da35872ffff", index, program).unwrap();
        assert_eq!(seed(0, Program::Wag), 0x6da_3587);
        assert_eq!(seed(2, Program::Wag), 0x6da_3587 + 2000);
        assert_eq!(seed(4, Program::Experiments), 2 * (0x6da_3587 + 4000));
        for commit in ["not", "not a hash"] {
            assert!(first_seed(commit, 0, Program::Wag).is_err());
        }
    }
}
