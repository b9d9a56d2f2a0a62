//! The record of a study: where its figures come from, then its rows, one JSON object a line.

use super::study::{Program, STUDIES, Study};
use anyhow::{Context, bail, ensure};
use run_log::files;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Where figures come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Name of the study.
    pub study: String,
    /// What was run, `SEED` for the seed.
    pub command: String,
    /// Of the sources where it was run; `program` tells whether it was built from them.
    pub commit: String,
    /// Version and hash of the program.
    pub program: String,
    /// Processor and its cores.
    pub machine: String,
    /// Day (UTC) on which the record was written.
    pub day: String,
    pub first_seed: u64,
    /// Busy threads beside it.
    pub load: u16,
}

impl Source {
    /// Whether the study is a result of `experiments`, not a run for each seed.
    fn is_one_result(&self) -> bool {
        let of_study = |study: &&Study| study.name == self.study;
        let study = STUDIES.iter().find(of_study);
        study.is_some_and(|study| study.program == Program::Experiments)
    }
}

/// A study's figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub source: Source,
    pub rows: Vec<Value>,
}

impl Record {
    pub fn path(folder: &Path, study: &str) -> PathBuf {
        folder.join(study).with_extension("jsonl")
    }

    pub fn read(folder: &Path, study: &str) -> anyhow::Result<Self> {
        let path = Self::path(folder, study);
        let text = files::read_text(&path)?;
        let fail = |line: usize| format!("line {line} of `{}`", path.display());
        let mut lines = text.lines().enumerate();
        let (_, first) = lines.next().with_context(|| fail(1))?;
        let source = serde_json::from_str(first).with_context(|| fail(1))?;
        let row =
            |(i, line): (usize, &str)| serde_json::from_str(line).with_context(|| fail(i + 1));
        let rows: Vec<Value> = lines.map(row).collect::<Result<_, _>>()?;
        ensure!(!rows.is_empty(), "`{}` has no row", path.display());
        Ok(Self { source, rows })
    }

    pub fn write(&self, folder: &Path) -> anyhow::Result<PathBuf> {
        let path = Self::path(folder, &self.source.study);
        let mut text = serde_json::to_string(&self.source)? + "\n";
        for row in &self.rows {
            text += &(serde_json::to_string(row)? + "\n");
        }
        files::create_folder(folder)?;
        files::write_atomic(&path, text.as_bytes())?;
        Ok(path)
    }

    /// What the document may quote: the source's fields, those of the only row or what many add
    /// up to, by field.
    pub fn numbers(&self) -> anyhow::Result<Value> {
        let mut all = match (self.source.is_one_result(), &*self.rows) {
            (true, [Value::Object(one)]) => one.clone(),
            (true, rows) => bail!("`{}` has {} results", self.source.study, rows.len()),
            (false, rows) => super::numbers::of_rows(rows),
        };
        if let Value::Object(source) = serde_json::to_value(&self.source)? {
            all.extend(source);
        }
        Ok(Value::Object(all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_record_is_read_as_it_was_written_and_what_is_broken_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let record = Record {
            source: Source {
                study: "strike".to_owned(),
                command: "wag demo --seed SEED".to_owned(),
                commit: "c3b4e48".to_owned(),
                program: "0.1.0-1".to_owned(),
                machine: "two cores".to_owned(),
                day: "2026-01-01".to_owned(),
                first_seed: 7,
                load: 0,
            },
            rows: vec![json!({"miss_m": 0.1}), json!({"miss_m": 0.3})],
        };
        let path = record.write(dir.path()).unwrap();
        assert_eq!(Record::read(dir.path(), "strike").unwrap(), record);
        let numbers = record.numbers().unwrap();
        assert_eq!(numbers["n"], 2);
        assert_eq!(numbers["miss_m"]["max"], 0.3);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("0.3", "much")).unwrap();
        let error = format!("{:#}", Record::read(dir.path(), "strike").unwrap_err());
        assert!(
            error.contains("line 3 of") && error.contains("strike.jsonl"),
            "{error}"
        );
    }
}
