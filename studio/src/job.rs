//! What a page may have done, and the command that does it.

use anyhow::{Context, bail, ensure};
use shared_types::Task;
use shared_types::rope::RANGES;
use std::path::{Path, PathBuf};
use viewer::live::Asked;

/// Where a run begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum From {
    /// With the wiggle; all the way.
    Wiggle,
    /// With the wiggle, and no throw.
    WiggleAlone,
    /// With the rope of an earlier run.
    Plan,
    /// With the throw of an earlier run, corrected by its miss.
    Again,
}

/// One run to make.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Job {
    pub(crate) from: From,
    task: Task,
    target_m: Option<[f64; 3]>,
    /// The earlier run.
    run: Option<PathBuf>,
    length_m: Option<f64>,
    lead_mass_kg: Option<f64>,
    /// Somebody knows why the controller has stopped.
    acknowledges: bool,
}

/// A number of the query.
fn number(asked: &Asked<'_>, key: &str) -> anyhow::Result<Option<f64>> {
    let Some(text) = asked.value(key).filter(|text| !text.is_empty()) else {
        return Ok(None);
    };
    let number: f64 = text
        .parse()
        .ok()
        .filter(|n: &f64| n.is_finite())
        .with_context(|| format!("`{key}` is a number, not `{text}`"))?;
    Ok(Some(number))
}

/// The task of a query; a strike where it names none.
pub(crate) fn task(asked: &Asked<'_>) -> anyhow::Result<Task> {
    let name = asked.value("task").unwrap_or(Task::Strike.name());
    [Task::Strike, Task::Lob, Task::Drape]
        .into_iter()
        .find(|task| task.name() == name)
        .with_context(|| format!("there is no task `{name}`"))
}

impl Job {
    /// Of a page's request; `runs` is the folder of earlier runs.
    ///
    /// # Errors
    /// What is missing or wrong, in words.
    pub(crate) fn of(asked: &Asked<'_>, runs: &Path) -> anyhow::Result<Self> {
        ensure!(
            asked.value("clear") == Some("yes"),
            "nobody said that the area is clear"
        );
        let from = match asked.value("from") {
            Some("wiggle") => From::Wiggle,
            Some("wiggle-alone") => From::WiggleAlone,
            Some("plan") => From::Plan,
            Some("again") => From::Again,
            _ => bail!("a run begins with wiggle, wiggle-alone, plan or again"),
        };
        let target = [
            number(asked, "x")?,
            number(asked, "y")?,
            number(asked, "z")?,
        ];
        let target_m = match target {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let needs_target = matches!(from, From::Wiggle | From::Plan);
        ensure!(target_m.is_some() || !needs_target, "name the target");
        let run = match asked.value("run").filter(|name| !name.is_empty()) {
            Some(name) => Some(crate::history::folder(runs, name)?),
            None => None,
        };
        let needs_run = matches!(from, From::Plan | From::Again);
        ensure!(run.is_some() || !needs_run, "name an earlier run");
        Ok(Self {
            from,
            task: task(asked)?,
            target_m,
            run,
            length_m: within(number(asked, "length_m")?, "length_m", RANGES[1].max)?,
            lead_mass_kg: number(asked, "lead_mass_kg")?,
            acknowledges: asked.value("acknowledge") == Some("yes"),
        })
    }

    /// The last word of its run folder's name.
    pub(crate) const fn name(&self) -> &'static str {
        match self.from {
            From::WiggleAlone => "wiggle",
            _ => "run",
        }
    }

    /// Arguments of `wag`: `reached_by` names arm and camera; results go to `out`.
    pub(crate) fn arguments(
        &self,
        reached_by: &[String],
        target_rgb: Option<&str>,
        out: &Path,
    ) -> Vec<String> {
        // The operator is the page: it is asked and holds the control, a simulated arm's too.
        let mut words = vec!["--json", "--events", self.name(), "--yes", "--ask"];
        words.push("--hold-to-run");
        let mut words: Vec<String> = words.into_iter().map(str::to_owned).collect();
        let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
        add("--out", out.display().to_string());
        let run = self.run.as_ref().map(|run| run.display().to_string());
        if self.from == From::Again {
            add("--again", run.unwrap_or_default());
        } else if self.from != From::WiggleAlone {
            if let Some([x, y, z]) = self.target_m {
                add("--target", format!("{x},{y},{z}"));
            }
            if let (From::Wiggle, Some(length_m)) = (self.from, self.length_m) {
                add("--length", length_m.to_string());
            }
            if let (From::Wiggle, Some(kg)) = (self.from, self.lead_mass_kg) {
                add("--lead-mass", kg.to_string());
            }
            words.push(self.task.name().to_owned());
            if let (From::Plan, Some(run)) = (self.from, run) {
                words.extend(["--from".to_owned(), "plan".to_owned(), run]);
            }
        }
        words.extend_from_slice(reached_by);
        if self.acknowledges {
            words.push("--acknowledge".to_owned());
        }
        let rgb = target_rgb.filter(|_| self.from != From::WiggleAlone);
        words.extend(
            rgb.iter()
                .flat_map(|rgb| ["--target-rgb", rgb].map(str::to_owned)),
        );
        words
    }
}

/// A length that a rope can have.
fn within(value: Option<f64>, key: &str, most: f64) -> anyhow::Result<Option<f64>> {
    let is_wrong = |v: &f64| *v <= 0.0 || *v > 2.0 * most;
    if let Some(wrong) = value.filter(is_wrong) {
        bail!(
            "`{key}` is {wrong} m; it is above 0 and at most {} m",
            2.0 * most
        );
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(query: &str) -> Asked<'_> {
        Asked {
            method: "POST",
            path: "begin",
            query,
            is_local: true,
        }
    }

    fn refused(query: &str) -> String {
        let dir = tempfile::tempdir().unwrap();
        Job::of(&asked(query), dir.path()).unwrap_err().to_string()
    }

    #[test]
    fn a_page_names_what_a_command_needs() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("old")).unwrap();
        std::fs::write(dir.path().join("old/summary.json"), "{}").unwrap();
        let words = |query: &str| {
            let job = Job::of(&asked(query), dir.path()).unwrap();
            let more = ["--arm".to_owned(), "a".to_owned()];
            job.arguments(&more, Some("1,2,3"), Path::new("new"))
                .join(" ")
        };
        let begin = "--yes --ask --hold-to-run --out new";
        assert_eq!(
            words("from=wiggle&clear=yes&task=lob&x=0.9&y=-0.1&z=0.3&length_m=0.5"),
            format!(
                "--json --events run {begin} --target 0.9,-0.1,0.3 --length 0.5 lob --arm a --target-rgb 1,2,3"
            )
        );
        assert_eq!(
            words("from=wiggle-alone&clear=yes"),
            format!("--json --events wiggle {begin} --arm a")
        );
        assert_eq!(
            words("from=wiggle-alone&clear=yes&acknowledge=yes"),
            format!("--json --events wiggle {begin} --arm a --acknowledge")
        );
        let old = dir.path().join("old");
        let old = old.display();
        assert_eq!(
            words("from=plan&run=old&clear=yes&x=0.9&y=0&z=0"),
            format!(
                "--json --events run {begin} --target 0.9,0,0 strike --from plan {old} --arm a --target-rgb 1,2,3"
            )
        );
        assert_eq!(
            words("from=again&run=old&clear=yes"),
            format!("--json --events run {begin} --again {old} --arm a --target-rgb 1,2,3")
        );
    }

    #[test]
    fn what_is_missing_or_wrong_is_said() {
        for (query, words) in [
            ("from=wiggle&x=1&y=0&z=0", "area is clear"),
            ("from=sleep&clear=yes", "a run begins with"),
            ("from=wiggle&clear=yes&x=1&y=0", "name the target"),
            ("from=wiggle&clear=yes&x=1&y=0&z=inf", "`z` is a number"),
            (
                "from=wiggle&clear=yes&x=1&y=0&z=0&task=nod",
                "no task `nod`",
            ),
            ("from=wiggle&clear=yes&x=1&y=0&z=0&length_m=65", "at most"),
            ("from=plan&clear=yes&x=1&y=0&z=0", "earlier run"),
            ("from=again&clear=yes&run=..", "no run"),
        ] {
            let said = refused(query);
            assert!(said.contains(words), "{query}: {said}");
        }
    }
}
