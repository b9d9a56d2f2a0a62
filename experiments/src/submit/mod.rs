//! `experiments submit`: a study in many processes of this machine.
//!
//! The study is cut into shards, each a run of this program with `--shard`. What is done is
//! seen from marks that the shards leave in their folder, so that one that is lost costs what
//! it had in hand and nothing else.

mod local;

use crate::args::SubmitArgs;
use crate::program::program;
use anyhow::{Context, ensure};
use cli_output::{OrInput, Outcome, Stage, is_interrupted, output, watch_interrupts};
use local::Local;
use rope_sim::Precision;
use run_log::files;
use serde_json::{Value, json};
use shared_types::ipc::message::Progress;
use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

/// How often marks are looked for.
const LOOK: Duration = Duration::from_millis(500);
/// Arguments that are this command's to give.
const OWN: [&str; 4] = ["--out", "--shard", "--threads", "--json"];

/// The shards of a study in their folder.
struct Shards {
    folder: PathBuf,
    count: u64,
    /// Held: another submission of the same result would make them once more.
    _lock: File,
}

impl Shards {
    fn file(&self, number: u64) -> PathBuf {
        self.folder.join(format!("shard-{number}.json"))
    }

    /// Left by a shard's script when the shard is made.
    fn mark(&self, number: u64) -> PathBuf {
        self.folder.join(format!("shard-{number}.done"))
    }

    /// Those that are not made yet.
    fn missing(&self) -> Vec<u64> {
        let is_made = |number| self.mark(number).exists() && self.file(number).exists();
        (1..=self.count)
            .filter(|number| !is_made(*number))
            .collect()
    }

    /// Writes the script that makes the shard whose number is its argument.
    fn write_script(&self, program: &Path, args: &SubmitArgs) -> anyhow::Result<PathBuf> {
        let quoted = |word: &str| format!("'{}'", word.replace('\'', r"'\''"));
        let here = std::env::current_dir().context("the current folder")?;
        let study: Vec<String> = args.study.iter().map(|word| quoted(word)).collect();
        let text = format!(
            "#!/bin/sh\n\
             # The shard of this number: shard.sh 3\n\
             set -eu\n\
             # Told to end, it ends after the program, which keeps what it has made.\n\
             trap : TERM\n\
             n=\"$1\"\n\
             folder={folder}\n\
             cd {here}\n\
             {program} {study} --threads {threads} --shard \"$n/{count}\" --out \"$folder/shard-$n.json\"\n\
             : > \"$folder/shard-$n.done\"\n",
            folder = quoted(&self.folder.to_string_lossy()),
            here = quoted(&here.to_string_lossy()),
            program = quoted(&program.to_string_lossy()),
            study = study.join(" "),
            threads = args.threads,
            count = self.count,
        );
        let path = self.folder.join("shard.sh");
        files::write_atomic(&path, text.as_bytes())?;
        std::fs::set_permissions(&path, Permissions::from_mode(0o755))
            .with_context(|| format!("`{}`", path.display()))?;
        Ok(path)
    }
}

/// Makes a study's shards and joins them; the value is what the study prints.
pub fn run(args: &SubmitArgs) -> Outcome<Option<Value>> {
    let own = |word: &&String| OWN.contains(&word.split('=').next().unwrap_or_default());
    if let Some(own) = args.study.iter().find(own) {
        return Err(bad_input!(
            "`{own}` after -- is this command's own: give it before --"
        ));
    }
    watch_interrupts().or_failed()?;
    files::check_writable(&args.out).or_input()?;
    let own_file = std::env::current_exe().context("this program's own file");
    let own_file = own_file.or_failed()?;
    let shards = open(args).or_input()?;
    let script = shards.write_script(&own_file, args).or_failed()?;
    let stage = Stage::begin("submit");
    if args.prepare {
        let (count, script) = (shards.count, script.display());
        stage.done(&format!("{count} shards, to be made by `{script} N`"));
        return Ok(Some(json!({
            "ok": true, "command": "submit", "shards": count, "script": script.to_string(),
        })));
    }
    let mut local = Local::new(&script, args).or_failed()?;
    for round in 0..=args.retries {
        let missing = shards.missing();
        if missing.is_empty() {
            break;
        }
        if round > 0 {
            eprintln!("{} shards failed; they are tried again", missing.len());
        }
        local.submit(&missing);
        watch(&mut local, &shards, &stage)?;
    }
    let missing = shards.missing();
    if let Some(first) = missing.first() {
        return Err(failed!(
            "{} of {} shards failed {} times; the first is {first}: see the logs in `{}`, or run `{} {first}`",
            missing.len(),
            shards.count,
            args.retries + 1,
            shards.folder.display(),
            script.display()
        ));
    }
    let paths: Vec<PathBuf> = (1..=shards.count).map(|n| shards.file(n)).collect();
    let trials = crate::results::join(&paths, &args.out).or_failed()?;
    let seconds = stage.done(&format!("{trials} trials in {} shards", shards.count));
    let result = print_result(&own_file, args)?;
    Ok(Some(json!({
        "ok": true, "command": "submit", "shards": shards.count, "trials": trials,
        "seconds": seconds, "out": args.out, "folder": shards.folder, "result": result,
    })))
}

/// The folder of the shards; one that holds those of something else is refused.
fn open(args: &SubmitArgs) -> anyhow::Result<Shards> {
    let name = args.out.file_name().context("--out names no file")?;
    let mut name = name.to_owned();
    name.push(".shards");
    let folder = args.out.with_file_name(name);
    let count = args.shards.unwrap_or(4 * u64::from(args.workers));
    files::create_folder(&folder)?;
    let folder = folder.canonicalize()?;
    let lock = File::create(folder.join("lock")).context("the shards' lock")?;
    ensure!(
        lock.try_lock().is_ok(),
        "another command makes the shards in `{}`: wait for it, or name another --out",
        folder.display()
    );
    let kept = folder.join("study.json");
    let kernels = [Precision::F32, Precision::F64].map(Precision::fastest_kernel);
    let study = json!({
        "study": args.study, "shards": count, "program": program()?,
        "kernels": format!("{kernels:?}"),
    });
    if kept.exists() {
        let found: Value = files::read_json(&kept)?;
        ensure!(
            found == study,
            "`{}` holds shards of another study, program or processor, or another number of them: name another --out, or remove it",
            folder.display()
        );
    } else {
        files::write_json(&kept, &study)?;
    }
    Ok(Shards {
        folder,
        count,
        _lock: lock,
    })
}

/// Waits until all that was handed over has ended.
fn watch(local: &mut Local, shards: &Shards, stage: &Stage) -> Outcome {
    loop {
        let done = shards.count - shards.missing().len() as u64;
        if is_interrupted() {
            return Err(failed!(
                "interrupted after {done} of {} shards; the same command goes on",
                shards.count
            ));
        }
        stage.progress(&Progress {
            done: u32::try_from(done).unwrap_or(u32::MAX),
            total: u32::try_from(shards.count).unwrap_or(u32::MAX),
            value: done as f64,
            label: "shards".to_owned(),
        });
        if local.is_over().or_failed()? {
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
