//! The folder of one run: results, configurations as used, logs.

use anyhow::Context;
use cli_output::{OrInput, Outcome};
use run_log::{CommandLine, files, ledger};
use shared_types::file_error::why;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(Debug)]
pub struct RunFolder {
    pub path: PathBuf,
    /// Shared-memory domain of this run's processes.
    pub domain: String,
}

impl RunFolder {
    /// Creates `out`, or `runs/<time>-<name>`, with folders `config` and `log`.
    pub fn create(out: Option<&Path>, name: &str) -> Outcome<Self> {
        let path = match out {
            Some(path) => path.to_owned(),
            None => Path::new(ledger::RUNS).join(ledger::new_name(name)),
        };
        Self::refuse_existing(&path)?;
        crate::config::check_here().or_input()?;
        for folder in ["config", "log"] {
            let refused = |e| {
                let (path, why) = (path.display(), why(&e));
                bad_input!("cannot create run folder `{path}` (--out): {why}")
            };
            std::fs::create_dir_all(path.join(folder)).map_err(refused)?;
        }
        let folder = Self {
            path,
            domain: ledger::domain_of_process(std::process::id()),
        };
        let command = CommandLine::of_this_program(SystemTime::now());
        files::write_json(&folder.file(files::COMMAND), &command).or_failed()?;
        Ok(folder)
    }

    /// Refuses a folder or file that is there already; results are never mixed or replaced.
    pub fn refuse_existing(path: &Path) -> Outcome {
        if path.exists() {
            return Err(bad_input!(
                "`{}` exists already; name another with --out",
                path.display()
            ));
        }
        Ok(())
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    pub fn log(&self) -> PathBuf {
        self.path.join("log")
    }

    /// Writes the configuration a process runs with; returns its path.
    pub fn config<T: serde::Serialize>(&self, name: &str, config: &T) -> anyhow::Result<PathBuf> {
        let path = self.path.join("config").join(format!("{name}.toml"));
        let text = toml::to_string(config).with_context(|| format!("configuration of {name}"))?;
        files::write_atomic(&path, text.as_bytes())?;
        Ok(path)
    }
}

/// A run that left nothing leaves no folder either: one without any file in it
/// tells nothing and is in the way of the next try.
impl Drop for RunFolder {
    fn drop(&mut self) {
        // Removes empty folders only.
        let count = |folder: &Path| folder.read_dir().map_or(0, Iterator::count);
        let only_command =
            count(&self.path) == 3 && count(&self.path.join("config")) + count(&self.log()) == 0;
        if only_command {
            let _ = std::fs::remove_file(self.file(files::COMMAND));
        }
        for folder in [self.path.join("config"), self.log(), self.path.clone()] {
            let _ = std::fs::remove_dir(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_results_leaves_no_folder() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("run");
        let folder = RunFolder::create(Some(&out), "test").unwrap();
        assert!(out.join("log").is_dir());
        drop(folder);
        assert!(!out.exists());
        let folder = RunFolder::create(Some(&out), "test").unwrap();
        folder.config("rig", &toml::toml! { a = 1 }).unwrap();
        drop(folder);
        assert!(out.join("config/rig.toml").is_file());
    }
}
