//! The shards of a submitted study: their folder, and the script that makes one.

use crate::args::SubmitArgs;
use crate::program::program;
use crate::results::is_finished;
use anyhow::{Context, bail, ensure};
use rope_sim::Precision;
use run_log::files;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::fs::{File, Permissions, TryLockError};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The shards of a study in their folder, while a command makes them. Dropped, what still waits
/// in a queue makes none.
#[derive(Debug)]
pub struct Shards {
    folder: PathBuf,
    count: u64,
    /// What this submission is called in its folder.
    token: String,
    /// Held: another submission of the same result would make them once more.
    _lock: File,
}

impl Shards {
    /// The folder of the shards, at most one for each of so many `trials`; one that holds what was
    /// made of something else is refused.
    pub fn open(args: &SubmitArgs, trials: Option<u64>) -> anyhow::Result<Self> {
        let name = args.out.file_name().context("--out names no file")?;
        let mut name = name.to_owned();
        name.push(".shards");
        let folder = args.out.with_file_name(name);
        files::create_folder(&folder)?;
        let folder = folder.canonicalize()?;
        let lock = File::create(folder.join("lock")).context("the shards' lock")?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => bail!(
                "another command makes the shards in `{}`: wait for it, or name another --out",
                folder.display()
            ),
            Err(TryLockError::Error(error)) => eprintln!(
                "no lock in `{}` ({error}): let no other command make the same shards",
                folder.display()
            ),
        }
        let count = settle(&folder, args, trials)?;
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH)?;
        let shards = Self {
            folder,
            count,
            token: format!("{}-{}", now.as_nanos(), std::process::id()),
            _lock: lock,
        };
        files::write_atomic(&shards.submission(), shards.token.as_bytes())?;
        Ok(shards)
    }

    /// Folder of scripts, logs and result files (absolute).
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Number of shards.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The second argument of the script, by which a queue's shards end with this submission.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// The script that makes the shard whose number is its argument.
    pub fn script(&self) -> PathBuf {
        self.folder.join("shard.sh")
    }

    /// Result file of a shard.
    pub fn file(&self, number: u64) -> PathBuf {
        self.folder.join(format!("shard-{number}.json"))
    }

    /// What a shard says.
    pub fn log(&self, number: u64) -> PathBuf {
        self.folder.join(format!("shard-{number}.log"))
    }

    /// Names the submission that runs.
    fn submission(&self) -> PathBuf {
        self.folder.join("submission")
    }

    /// Left by a shard's script at its end.
    fn mark(&self, number: u64) -> PathBuf {
        self.folder.join(format!("shard-{number}.done"))
    }

    /// Those that are not made yet. The folder is read as a whole: a network's file system then
    /// looks for what is new.
    pub fn missing(&self) -> Vec<u64> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten();
        let there: HashSet<_> = entries.flatten().map(|entry| entry.file_name()).collect();
        let is_there = |path: PathBuf| path.file_name().is_some_and(|name| there.contains(name));
        let is_made = |number| is_there(self.mark(number)) && is_there(self.file(number));
        (1..=self.count)
            .filter(|number| !is_made(*number))
            .collect()
    }

    /// Whether a shard has been begun, here or by an earlier submission.
    pub fn is_any_begun(&self) -> bool {
        (1..=self.count).any(|number| self.log(number).exists())
    }

    /// Takes the marks from shards that are not finished: made twice at once, after an engine had
    /// given one up too early, a shard may be written by the slower one last.
    pub fn unmark_unfinished(&self) -> anyhow::Result<()> {
        let missing: HashSet<u64> = self.missing().into_iter().collect();
        for number in (1..=self.count).filter(|number| !missing.contains(number)) {
            if !is_finished(&self.file(number))? {
                std::fs::remove_file(self.mark(number))?;
            }
        }
        Ok(())
    }

    /// Writes the script; a mark makes it do nothing.
    pub fn write_script(&self, program: &Path, args: &SubmitArgs) -> anyhow::Result<()> {
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
             # Of a submission that has ended, a queue may still hold shards.\n\
             if [ $# -ge 2 ] && [ \"$2\" != \"$(cat \"$folder/submission\")\" ]; then\n\
             \x20 echo \"not made: its submission has ended\" >&2\n\
             \x20 exit 0\n\
             fi\n\
             [ ! -e \"$folder/shard-$n.done\" ] || exit 0\n\
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
        let path = self.script();
        files::write_atomic(&path, text.as_bytes())?;
        std::fs::set_permissions(&path, Permissions::from_mode(0o755))
            .with_context(|| format!("`{}`", path.display()))
    }
}

impl Drop for Shards {
    fn drop(&mut self) {
        // Left behind, it costs a shard that is made twice.
        let _ = std::fs::remove_file(self.submission());
    }
}

/// Notes what the folder's shards are made of, unless it holds some of the same already; their
/// number, which stays what it was where none is asked for.
fn settle(folder: &Path, args: &SubmitArgs, trials: Option<u64>) -> anyhow::Result<u64> {
    let kept = folder.join("study.json");
    let kernels = [Precision::F32, Precision::F64].map(Precision::fastest_kernel);
    let count = args.shards.unwrap_or(4 * u64::from(args.workers));
    let mut study = json!({
        "study": args.study, "shards": count.min(trials.unwrap_or(count)), "program": program()?,
        "kernels": format!("{kernels:?}"),
    });
    let found: Value = match kept.exists() {
        true => files::read_json(&kept)?,
        false => Value::Null,
    };
    let mut others = Vec::new();
    for (key, what) in [
        ("study", "study"),
        ("program", "program"),
        ("kernels", "processor (its kernels)"),
        ("shards", "number of shards"),
    ] {
        let is_asked = key != "shards" || args.shards.is_some();
        if is_asked && found[key] != study[key] {
            others.push(format!("{what} {}, not {}", found[key], study[key]));
        }
    }
    if others.is_empty() {
        study = found;
    } else {
        // A lock is held here, but a queue's shards hold none: what one has kept is left alone.
        ensure!(
            found.is_null() || !holds_trials(folder)?,
            "`{}` holds shards of another {}: name another --out, or remove it",
            folder.display(),
            others.join("; ")
        );
        files::write_json(&kept, &study)?;
    }
    let count = study["shards"].as_u64();
    count.with_context(|| format!("`{}`: `shards` is no number: remove it", kept.display()))
}

/// Whether a shard has left trials, or its mark.
fn holds_trials(folder: &Path) -> anyhow::Result<bool> {
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name();
        let name = name.to_string_lossy();
        let is_kept = name.ends_with(".json") || name.ends_with(".done");
        if name.starts_with("shard-") && is_kept {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A word for the shell.
pub fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}
