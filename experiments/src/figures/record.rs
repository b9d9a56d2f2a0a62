//! The record of a study: where its figures come from, then its rows, one JSON object a line.

use anyhow::{Context, ensure};
use run_log::files;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Where figures come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Name of the study.
    pub study: String,
    /// What was run, `SEED` for the seed.
    pub command: String,
    /// Of the sources that the program was built from.
    pub commit: String,
    /// Version and hash of the program.
    pub program: String,
    /// Processor and its cores.
    pub machine: String,
    /// Day (UTC) on which the last row was made.
    pub day: String,
    pub first_seed: u64,
    /// Busy threads beside it.
    pub load: u16,
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
        files::write_atomic(&path, text.as_bytes())?;
        Ok(path)
    }

    /// What the document may quote: the source's fields, those of the only row or what many add
    /// up to, by field.
    pub fn numbers(&self) -> anyhow::Result<Value> {
        let mut all = match serde_json::to_value(&self.source)? {
            Value::Object(fields) => fields,
            _ => Map::new(),
        };
        match &*self.rows {
            [Value::Object(one)] => all.extend(one.clone()),
            rows => {
                let last = self.source.first_seed + rows.len() as u64 - 1;
                all.insert("last_seed".to_owned(), json!(last));
                all.extend(super::numbers::of_rows(rows));
            }
        }
        Ok(Value::Object(all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(
            (&numbers["last_seed"], &numbers["miss_m"]["max"]),
            (&json!(8), &json!(0.3))
        );
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("0.3", "much")).unwrap();
        let error = format!("{:#}", Record::read(dir.path(), "strike").unwrap_err());
        assert!(
            error.contains("line 3 of") && error.contains("strike.jsonl"),
            "{error}"
        );
    }
}
