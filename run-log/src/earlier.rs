//! What a run tells to one that resumes or corrects it.

use crate::{Colours, Run, files, ledger};
use anyhow::{Context, Result, ensure};
use shared_types::Task;
use std::path::{Path, PathBuf};

/// As far as it is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Earlier {
    /// What its throw was for.
    pub task: Option<Task>,
    /// Its target (m, base frame).
    pub target_m: Option<[f64; 3]>,
    /// Colours of tip and target.
    pub colours: Colours,
}

impl Run {
    /// What it tells to another.
    ///
    /// # Errors
    /// A file of it cannot be read.
    pub fn earlier(&self) -> Result<Earlier> {
        let plan = self.plan()?;
        let summary = self.summary()?.unwrap_or_default();
        let target_m = serde_json::from_value(summary["target_m"].clone()).ok();
        let task = serde_json::from_value(summary["task"].clone()).ok();
        Ok(Earlier {
            task: plan.as_ref().map(|plan| plan.task).or(task),
            target_m: plan.map(|plan| plan.target_m).or(target_m),
            colours: self.colours()?,
        })
    }

    /// The file of its rope.
    ///
    /// # Errors
    /// It identified none, and says where to resume it instead.
    pub fn rope_file(&self) -> Result<PathBuf> {
        let file = self.folder().join(files::ROPE);
        ensure!(
            file.is_file(),
            "`{}` is not there: a run that identified no rope is resumed with --from identify, one \
             that was itself resumed from the run before it",
            file.display()
        );
        Ok(file)
    }

    /// What its planner was told; none where a planner was there already.
    #[must_use]
    pub fn planner_file(&self) -> Option<PathBuf> {
        Some(self.folder().join(files::PLANNER)).filter(|file| file.is_file())
    }

    /// Whether its arm was simulated, by its summary or, where it has none or is of an older
    /// version, by what its controller was told.
    ///
    /// # Errors
    /// A file of it cannot be read.
    pub fn is_simulated(&self) -> Result<bool> {
        let summary = self.summary()?.unwrap_or_default();
        if let Some(simulated) = summary["simulated"].as_bool() {
            return Ok(simulated);
        }
        let told = self.folder().join(files::CONTROLLER);
        let told: toml::Table = match told.is_file() {
            true => toml::from_str(&files::read_text(&told)?)?,
            false => toml::Table::new(),
        };
        let told = told.get("simulated").and_then(toml::Value::as_bool);
        Ok(told.unwrap_or_else(|| !summary["truth"].is_null()))
    }

    /// Refuses a real arm for what a rehearsal found.
    ///
    /// # Errors
    /// In words.
    pub fn check_arm(&self, simulated: bool) -> Result<()> {
        ensure!(
            simulated || !self.is_simulated()?,
            "`{}` was made with a simulated arm, whose rope is another than the one that hangs here: \
             begin with the wiggle",
            self.folder().display()
        );
        Ok(())
    }

    /// The same of a run's folder or a plan's file, by the run in whose folder it lies.
    ///
    /// # Errors
    /// In words.
    pub fn check_arm_of_throw(last: &Path, simulated: bool) -> Result<()> {
        let path = std::path::absolute(last).context("the plan's folder")?;
        let folder = match path.is_dir() {
            true => Some(path.as_path()),
            false => path.parent(),
        };
        let run = folder.filter(|folder| ledger::is_run(folder));
        run.map_or(Ok(()), |run| Self::open(run)?.check_arm(simulated))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rehearsal_is_known_before_and_after_its_throw() {
        for (summary, is_simulated) in [
            (r#"{"simulated": true, "truth": null}"#, true),
            (r#"{"truth": {"rope": {}}}"#, true),
            (r#"{"simulated": false, "truth": null}"#, false),
            (r#"{"ok": true}"#, false),
        ] {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join(files::SUMMARY), summary).unwrap();
            let run = Run::open(folder.path()).unwrap();
            assert_eq!(run.is_simulated().unwrap(), is_simulated, "{summary}");
            assert!(run.check_arm(true).is_ok());
            let plan = folder.path().join(files::PLAN);
            for path in [folder.path(), &plan] {
                let refused = Run::check_arm_of_throw(path, false).is_err();
                assert_eq!(refused, is_simulated, "{}", path.display());
            }
            assert_eq!(run.check_arm(false).is_err(), is_simulated, "{summary}");
        }
        // One that was killed has no summary.
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("config")).unwrap();
        let controller = folder.path().join(files::CONTROLLER);
        std::fs::write(controller, "simulated = true\n").unwrap();
        assert!(Run::open(folder.path()).unwrap().check_arm(false).is_err());
    }
}
