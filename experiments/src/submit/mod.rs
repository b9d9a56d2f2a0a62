//! `experiments submit`: a study in many processes, of this machine or a cluster.
//!
//! The study is cut into shards, each a run of this program with `--shard`. What is done is
//! seen from marks that the shards leave in their folder, so that one that is lost costs what
//! it had in hand and nothing else.

mod engine;
mod hyperqueue;
mod local;
mod shards;
mod slurm;
mod study;

pub use study::with_hint;

use crate::args::{EngineName, SubmitArgs};
use anyhow::Context;
use cli_output::{OrInput, Outcome, Stage, is_interrupted, output, watch_interrupts};
use engine::Engine;
use hyperqueue::HyperQueue;
use local::Local;
use run_log::files;
use serde_json::{Value, json};
use shards::Shards;
use shared_types::ipc::message::Progress;
use slurm::Slurm;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How often marks are looked for.
const LOOK: Duration = Duration::from_millis(500);
/// How long after its end a shard's mark may come to be seen here: a network's file system is
/// not at once the same everywhere.
const SEEN_AFTER: Duration = Duration::from_secs(30);
/// After this long without a shard that has been begun, that is told.
const IDLE: Duration = Duration::from_secs(60);

fn engine(args: &SubmitArgs, shards: &Shards) -> Box<dyn Engine> {
    match args.engine {
        EngineName::Local => Box::new(Local::new(args)),
        EngineName::Hyperqueue => Box::new(HyperQueue::new(shards.folder(), args)),
        EngineName::Slurm => Box::new(Slurm::new(args)),
    }
}

/// Makes a study's shards and joins them; the value is what the study prints.
pub fn run(args: &SubmitArgs) -> Outcome<Option<Value>> {
    let trials = study::check(args)?;
    watch_interrupts().or_failed()?;
    files::check_writable(&args.out).or_input()?;
    let own_file = std::env::current_exe().context("this program's own file");
    let own_file = own_file.or_failed()?;
    let shards = Shards::open(args, trials).or_input()?;
    shards.write_script(&own_file, args).or_failed()?;
    let script = shards.script();
    let stage = Stage::begin("submit");
    if args.prepare {
        let (count, script) = (shards.count(), script.display());
        stage.done(&format!("{count} shards, to be made by `{script} N`"));
        return Ok(Some(json!({
            "ok": true, "command": "submit", "shards": count, "script": script.to_string(),
        })));
    }
    let mut engine = engine(args, &shards);
    let is_here = args.engine == EngineName::Local;
    let seen_after = if is_here { Duration::ZERO } else { SEEN_AFTER };
    for round in 0..=args.retries {
        let missing = shards.missing();
        if missing.is_empty() {
            break;
        }
        if round > 0 {
            eprintln!("{} shards failed; they are tried again", missing.len());
        }
        engine.submit(&shards, &missing).or_failed()?;
        watch(engine.as_mut(), &shards, seen_after, &stage)?;
        shards.unmark_unfinished().or_failed()?;
    }
    let missing = shards.missing();
    if let Some(first) = missing.first() {
        return Err(failed!(
            "{} of {} shards failed {} times; the first is {first}: {}; see the logs in `{}`, or run `{} {first}`",
            missing.len(),
            shards.count(),
            args.retries + 1,
            last_line(&shards.log(*first)),
            shards.folder().display(),
            script.display()
        ));
    }
    let paths: Vec<PathBuf> = (1..=shards.count()).map(|n| shards.file(n)).collect();
    let trials = crate::results::join(&paths, &args.out).or_failed()?;
    let seconds = stage.done(&format!("{trials} trials in {} shards", shards.count()));
    let result = print_result(&own_file, args)?;
    Ok(Some(json!({
        "ok": true, "command": "submit", "shards": shards.count(), "trials": trials,
        "seconds": seconds, "out": args.out, "folder": shards.folder(), "result": result,
    })))
}

/// The last that a log says.
fn last_line(log: &Path) -> String {
    let said = std::fs::read(log).unwrap_or_default();
    let said = String::from_utf8_lossy(&said);
    let mut lines = said.lines().map(str::trim);
    let last = lines.rfind(|line| !line.is_empty());
    last.unwrap_or("it said nothing").to_owned()
}

/// Waits until all that was handed over has ended, and for marks that are seen later.
fn watch(engine: &mut dyn Engine, shards: &Shards, seen_after: Duration, stage: &Stage) -> Outcome {
    let begin = Instant::now();
    let (mut over, mut is_idle): (Option<Instant>, _) = (None, !shards.is_any_begun());
    loop {
        let missing = shards.missing().len() as u64;
        let done = shards.count() - missing;
        if is_interrupted() {
            return Err(failed!(
                "interrupted after {done} of {} shards; the same command goes on",
                shards.count()
            ));
        }
        stage.progress(&Progress {
            done: u32::try_from(done).unwrap_or(u32::MAX),
            total: u32::try_from(shards.count()).unwrap_or(u32::MAX),
            value: done as f64,
            label: "shards".to_owned(),
        });
        is_idle = is_idle && !shards.is_any_begun();
        if is_idle && begin.elapsed() > IDLE {
            is_idle = false;
            eprintln!(
                "no shard has begun for {} s: has the engine workers that are large enough?",
                IDLE.as_secs()
            );
        }
        if over.is_none() && engine.is_over(shards).or_failed()? {
            over = Some(Instant::now());
        }
        if over.is_some_and(|since| missing == 0 || since.elapsed() >= seen_after) {
            return Ok(());
        }
        sleep(LOOK);
    }
}

/// Has the study print its result from the joined trials.
fn print_result(program: &Path, args: &SubmitArgs) -> Outcome<Value> {
    let mut command = Command::new(program);
    command.args(&args.study).arg("--out").arg(&args.out);
    let (status, printed) = if output::is_json() {
        let output = command.arg("--json").output().or_failed()?;
        (output.status, output.stdout)
    } else {
        (command.status().or_failed()?, b"null".to_vec())
    };
    if !status.success() {
        return Err(failed!("the study could not print its result: {status}"));
    }
    serde_json::from_slice(&printed).or_failed()
}
