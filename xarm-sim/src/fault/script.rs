//! Scripts: which fault, when, and for how long; from TOML and back.

use super::kind::{FaultKind, Lasts, Range};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Times in a script (s).
const TIME: Range = Range::Number(0.0, 1e6);
/// Motions in a script.
const COUNT: Range = Range::Whole(1, u32::MAX as i64);
const TRIGGERS: &str =
    "\"first_setpoint\", \"setpoint:N\", \"motion:PERCENT\", \"speed:RAD_PER_S\"";

/// Why a fault script is refused.
#[derive(Debug, thiserror::Error)]
pub enum FaultScriptError {
    /// The file cannot be read.
    #[error("cannot read the fault script {path}", path = .path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something about one file.
    #[error("fault script {path}: {error}", path = .path.display())]
    InFile {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: Box<FaultScriptError>,
    },
    /// No list of `[[fault]]` in TOML.
    #[error("not valid TOML, or more than a list of [[fault]]: {0}")]
    Toml(String),
    /// An entry makes no fault.
    #[error("fault {entry}: {what}")]
    Entry {
        /// Entry, from 1.
        entry: usize,
        /// The field, and what is allowed there.
        what: String,
    },
}

/// When a fault begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trigger {
    /// At a time since the arm was switched on (s): `at_s = 2.5`.
    At(f64),
    /// With the N-th motion command, setpoint or velocity, that the arm takes
    /// up: `on = "first_setpoint"`, `on = "setpoint:250"`.
    Setpoint(u64),
    /// When a motion has run for a part of its length:
    /// `on = "motion:50"`, `motion_s = 1.6`, `motion = 2`.
    Motion {
        /// Part of the length (0 to 1).
        part: f64,
        /// Length of the motion (s); the arm cannot know it.
        length_s: f64,
        /// Which motion since the arm was switched on, from 1.
        number: u32,
    },
    /// When a joint is asked to move faster than this (rad/s):
    /// `on = "speed:1.5"`.
    Speed(f64),
}

/// A fault to inject.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// When it begins.
    pub trigger: Trigger,
    /// How long it lasts (s); `None` is for ever, or a moment.
    pub duration_s: Option<f64>,
    /// What happens.
    pub kind: FaultKind,
}

/// The faults of a run; none by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<Table>", into = "Vec<Table>")]
pub struct FaultScript {
    /// In the order of the file.
    pub faults: Vec<Fault>,
}

impl FaultScript {
    /// Reads a script.
    ///
    /// # Errors
    /// [`FaultScriptError`], which names file, entry, field and allowed values.
    pub fn read(path: &Path) -> Result<Self, FaultScriptError> {
        let text = std::fs::read_to_string(path).map_err(|source| FaultScriptError::Read {
            path: path.to_owned(),
            source,
        })?;
        text.parse().map_err(|error| FaultScriptError::InFile {
            path: path.to_owned(),
            error: Box::new(error),
        })
    }
}

impl core::str::FromStr for FaultScript {
    type Err = FaultScriptError;

    /// Parses the text of a script.
    fn from_str(text: &str) -> Result<Self, FaultScriptError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            #[serde(default)]
            fault: Vec<Table>,
        }
        let file: File =
            toml::from_str(text).map_err(|error| FaultScriptError::Toml(error.to_string()))?;
        file.fault.try_into()
    }
}

impl TryFrom<Vec<Table>> for FaultScript {
    type Error = FaultScriptError;

    fn try_from(tables: Vec<Table>) -> Result<Self, FaultScriptError> {
        let faults = (1..).zip(tables).map(|(entry, table)| {
            Fault::from_table(table).map_err(|what| FaultScriptError::Entry { entry, what })
        });
        let faults = faults.collect::<Result<_, _>>()?;
        Ok(Self { faults })
    }
}

impl From<FaultScript> for Vec<Table> {
    fn from(script: FaultScript) -> Self {
        script.faults.into_iter().map(Fault::to_table).collect()
    }
}

impl Fault {
    /// The fault of an entry, or what is wrong with the entry.
    fn from_table(mut table: Table) -> Result<Self, String> {
        let name = match table.remove("kind") {
            Some(Value::String(name)) => name,
            Some(found) => return Err(format!("`kind` is {found}; allowed is {}", kinds())),
            None => return Err(format!("`kind` is missing; give {}", kinds())),
        };
        let trigger = Trigger::take(&mut table)?;
        let duration_s = take(&mut table, "duration_s", TIME)?;
        let kind = kind_of(name.clone(), table)?;
        match (kind.lasts(), duration_s) {
            (Lasts::Moment, Some(_)) => Err(format!("`duration_s` means nothing for `{name}`")),
            (Lasts::Span, None) => Err(missing("duration_s", TIME)),
            _ => Ok(Self {
                trigger,
                duration_s,
                kind,
            }),
        }
    }

    /// An entry as it would be written in a file.
    fn to_table(self) -> Table {
        let (name, mut table) = match Value::try_from(self.kind) {
            Ok(Value::Table(kind)) => kind
                .into_iter()
                .find_map(|(name, fields)| Some((name, fields.as_table()?.clone())))
                .unwrap_or_default(),
            Ok(name) => (name.as_str().unwrap_or_default().to_owned(), Table::new()),
            // Words, numbers and a version can always be written.
            Err(_) => Default::default(),
        };
        let mut put = |key: &str, value: Value| table.insert(key.to_owned(), value);
        put("kind", name.into());
        match self.trigger {
            Trigger::At(at_s) => put("at_s", at_s.into()),
            Trigger::Setpoint(count) => put("on", format!("setpoint:{count}").into()),
            Trigger::Speed(speed) => put("on", format!("speed:{speed}").into()),
            Trigger::Motion {
                part,
                length_s,
                number,
            } => {
                put("motion_s", length_s.into());
                put("motion", i64::from(number).into());
                put("on", format!("motion:{}", part * 100.0).into())
            }
        };
        if let Some(duration_s) = self.duration_s {
            put("duration_s", duration_s.into());
        }
        table
    }
}

impl Trigger {
    /// Takes the fields that say when a fault begins.
    fn take(table: &mut Table) -> Result<Self, String> {
        match (take(table, "at_s", TIME)?, table.remove("on")) {
            (Some(at_s), None) => Ok(Self::At(at_s)),
            (None, Some(on)) => Self::of(&on, table),
            (None, None) => Err(format!(
                "`at_s` is missing; give it, or `on` with one of {TRIGGERS}"
            )),
            (Some(_), Some(_)) => Err("give either `at_s` or `on`, not both".to_owned()),
        }
    }

    /// The trigger that `on` means.
    fn of(on: &Value, table: &mut Table) -> Result<Self, String> {
        let bad = || format!("`on` is {on}; allowed is one of {TRIGGERS}");
        let on = on.as_str().ok_or_else(bad)?;
        if on == "first_setpoint" {
            return Ok(Self::Setpoint(1));
        }
        let (word, value) = on.split_once(':').ok_or_else(bad)?;
        let number: f64 = value.parse().map_err(|_wrong| bad())?;
        match word {
            "setpoint" => match value.parse() {
                Ok(count) if count >= 1 => Ok(Self::Setpoint(count)),
                _ => Err(bad()),
            },
            "motion" if (0.0..=100.0).contains(&number) => Ok(Self::Motion {
                part: number / 100.0,
                length_s: take(table, "motion_s", TIME)?
                    .ok_or_else(|| missing("motion_s", TIME))?,
                number: take(table, "motion", COUNT)?.map_or(1, |number| number as u32),
            }),
            "speed" if number > 0.0 && number.is_finite() => Ok(Self::Speed(number)),
            _ => Err(bad()),
        }
    }
}

/// The kind of a name with its fields, each within its range.
fn kind_of(name: String, fields: Table) -> Result<FaultKind, String> {
    let alone = Value::from(name.as_str()).try_into();
    match (alone, fields.keys().next()) {
        (Ok(kind), None) => return Ok(kind),
        (Ok(_), Some(field)) => return Err(format!("`{field}` means nothing for `{name}`")),
        (Err(_), _) => {}
    }
    for (field, found) in &fields {
        if let Some(range) = Range::of(&name, field) {
            range.number(field, found)?;
        }
    }
    let whole = Table::from_iter([(name.clone(), Value::Table(fields))]);
    Value::Table(whole).try_into().map_err(|error| {
        let said = one_line(&error);
        let field = said
            .split_once("missing field `")
            .and_then(|(_, rest)| rest.split('`').next());
        field
            .and_then(|field| Some(missing(field, Range::of(&name, field)?)))
            .unwrap_or_else(|| format!("`kind` and its fields: {said}"))
    })
}

/// The kinds that there are, as the parser lists them.
fn kinds() -> String {
    let unknown = Value::from("").try_into::<FaultKind>();
    let said = unknown.map_or_else(|error| one_line(&error), |_| String::new());
    said.replacen("unknown variant ``, expected ", "", 1)
}

/// Takes a number, if it is there.
fn take(table: &mut Table, field: &str, range: Range) -> Result<Option<f64>, String> {
    let found = table.remove(field);
    found.map(|found| range.number(field, &found)).transpose()
}

fn missing(field: &str, range: Range) -> String {
    format!("`{field}` is missing; give {range}")
}

fn one_line(error: &toml::de::Error) -> String {
    error.to_string().trim_end().replace('\n', " ")
}

#[cfg(test)]
mod tests;
