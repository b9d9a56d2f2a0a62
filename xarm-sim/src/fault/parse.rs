//! Scripts from TOML and back. Every error names entry, field and what is
//! allowed there.

use super::error::FaultScriptError;
use super::kind::FaultKind;
use super::schema::{Field, KINDS, Kind, Lasts, Values, quoted};
use super::script::{Fault, FaultScript, Trigger};
use crate::firmware::Firmware;
use toml::{Table, Value};

/// Longest time in a script (s).
const LONGEST_S: f64 = 1e6;
const TIME: Values = Values::Number(0.0, LONGEST_S);
const COUNT: Values = Values::Whole(1, u32::MAX as i64);
const TRIGGERS: &str =
    "\"first_setpoint\", \"setpoint:N\", \"motion:PERCENT\", \"speed:RAD_PER_S\"";

impl core::str::FromStr for FaultScript {
    type Err = FaultScriptError;

    /// Parses the text of a script.
    fn from_str(text: &str) -> Result<Self, FaultScriptError> {
        script(text)
    }
}

impl TryFrom<Vec<Table>> for FaultScript {
    type Error = FaultScriptError;

    fn try_from(tables: Vec<Table>) -> Result<Self, FaultScriptError> {
        entries(tables)
    }
}

impl From<FaultScript> for Vec<Table> {
    fn from(script: FaultScript) -> Self {
        script.faults.iter().map(to_table).collect()
    }
}

fn script(text: &str) -> Result<FaultScript, FaultScriptError> {
    let mut top: Table =
        toml::from_str(text).map_err(|error| FaultScriptError::Toml(error.to_string()))?;
    let faults = top.remove("fault");
    if let Some(key) = top.keys().next() {
        return Err(FaultScriptError::Top { key: key.clone() });
    }
    let not_a_list = || FaultScriptError::Top {
        key: "fault".to_owned(),
    };
    let list = match faults {
        None => Vec::new(),
        Some(Value::Array(list)) => list,
        Some(_) => return Err(not_a_list()),
    };
    let tables: Option<Vec<Table>> = list
        .into_iter()
        .map(|entry| match entry {
            Value::Table(table) => Some(table),
            _ => None,
        })
        .collect();
    entries(tables.ok_or_else(not_a_list)?)
}

fn entries(tables: Vec<Table>) -> Result<FaultScript, FaultScriptError> {
    let faults = tables
        .into_iter()
        .enumerate()
        .map(|(index, table)| {
            Entry {
                number: index + 1,
                table,
            }
            .parse()
        })
        .collect::<Result<_, _>>()?;
    Ok(FaultScript { faults })
}

/// An entry being taken apart: fields are removed as they are understood.
struct Entry {
    number: usize,
    table: Table,
}

impl Entry {
    fn parse(mut self) -> Result<Fault, FaultScriptError> {
        let kind = self.take_kind()?;
        let trigger = self.take_trigger(kind)?;
        let duration_s = match kind.lasts {
            Lasts::Moment => None,
            Lasts::Span => Some(self.take_number("duration_s", TIME)?),
            Lasts::Open => self
                .table
                .contains_key("duration_s")
                .then(|| self.take_number("duration_s", TIME))
                .transpose()?,
        };
        for field in kind.fields {
            self.check(field)?;
        }
        if let Some(field) = self.table.keys().find(|key| !is_field(kind, key)) {
            return Err(FaultScriptError::Unknown {
                entry: self.number,
                field: field.clone(),
                kind: kind.name,
                allowed: fields_of(kind),
            });
        }
        self.table
            .insert("kind".to_owned(), Value::String(kind.name.to_owned()));
        // The table of kinds has checked all that this could object to.
        let kind = Value::Table(self.table)
            .try_into::<FaultKind>()
            .map_err(|error| FaultScriptError::Toml(error.to_string()))?;
        Ok(Fault {
            trigger,
            duration_s,
            kind,
        })
    }

    fn take_kind(&mut self) -> Result<&'static Kind, FaultScriptError> {
        let names: Vec<_> = KINDS.iter().map(|kind| kind.name).collect();
        let allowed = || format!("one of {}", quoted(&names));
        let Some(found) = self.table.remove("kind") else {
            return Err(self.missing("kind", allowed()));
        };
        found
            .as_str()
            .and_then(|name| KINDS.iter().find(|kind| kind.name == name))
            .ok_or_else(|| self.bad("kind", &found, allowed()))
    }

    fn take_trigger(&mut self, kind: &Kind) -> Result<Trigger, FaultScriptError> {
        match (self.table.contains_key("at_s"), self.table.remove("on")) {
            (true, None) => Ok(Trigger::At(self.take_number("at_s", TIME)?)),
            (false, Some(on)) => self.trigger_of(&on),
            (false, None) => {
                Err(self.missing("at_s", format!("it, or `on` with one of {TRIGGERS}")))
            }
            (true, Some(_)) => Err(FaultScriptError::Unknown {
                entry: self.number,
                field: "on".to_owned(),
                kind: kind.name,
                allowed: "either `at_s` or `on`, not both".to_owned(),
            }),
        }
    }

    fn trigger_of(&mut self, on: &Value) -> Result<Trigger, FaultScriptError> {
        let bad = |entry: &Self| entry.bad("on", on, format!("one of {TRIGGERS}"));
        let text = on.as_str().ok_or_else(|| bad(self))?;
        if text == "first_setpoint" {
            return Ok(Trigger::Setpoint(1));
        }
        let (word, value) = text.split_once(':').ok_or_else(|| bad(self))?;
        let number: f64 = value.parse().map_err(|_wrong| bad(self))?;
        match word {
            "setpoint" => match value.parse() {
                Ok(count) if count >= 1 => Ok(Trigger::Setpoint(count)),
                _ => Err(bad(self)),
            },
            "motion" if (0.0..=100.0).contains(&number) => {
                let length_s = self.take_number("motion_s", TIME)?;
                let number_of = match self.table.remove("motion") {
                    None => 1,
                    Some(found) => found
                        .as_integer()
                        .and_then(|n| u32::try_from(n).ok())
                        .filter(|n| *n >= 1)
                        .ok_or_else(|| self.bad("motion", &found, COUNT.to_string()))?,
                };
                Ok(Trigger::Motion {
                    part: number / 100.0,
                    length_s,
                    number: number_of,
                })
            }
            "speed" if number > 0.0 && number.is_finite() => Ok(Trigger::Speed(number)),
            _ => Err(bad(self)),
        }
    }

    fn take_number(
        &mut self,
        field: &'static str,
        values: Values,
    ) -> Result<f64, FaultScriptError> {
        let Some(found) = self.table.remove(field) else {
            return Err(self.missing(field, values.to_string()));
        };
        number(&found)
            .filter(|_| admits(values, &found))
            .ok_or_else(|| self.bad(field, &found, values.to_string()))
    }

    fn check(&self, field: &Field) -> Result<(), FaultScriptError> {
        match self.table.get(field.name) {
            None if field.required => Err(self.missing(field.name, field.values.to_string())),
            Some(found) if !admits(field.values, found) => {
                Err(self.bad(field.name, found, field.values.to_string()))
            }
            _ => Ok(()),
        }
    }

    fn missing(&self, field: &'static str, allowed: String) -> FaultScriptError {
        FaultScriptError::Missing {
            entry: self.number,
            field,
            allowed,
        }
    }

    fn bad(&self, field: &'static str, found: &Value, allowed: String) -> FaultScriptError {
        FaultScriptError::Value {
            entry: self.number,
            field,
            found: found.to_string(),
            allowed,
        }
    }
}

fn is_field(kind: &Kind, name: &str) -> bool {
    kind.fields.iter().any(|field| field.name == name)
}

fn fields_of(kind: &Kind) -> String {
    let duration = (kind.lasts != Lasts::Moment).then_some("duration_s");
    let fields = kind.fields.iter().map(|field| field.name);
    let all: Vec<_> = ["at_s", "on"]
        .into_iter()
        .chain(duration)
        .chain(fields)
        .collect();
    quoted(&all)
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|n| n as f64))
}

fn admits(values: Values, found: &Value) -> bool {
    match values {
        Values::Number(min, max) => number(found).is_some_and(|v| (min..=max).contains(&v)),
        Values::Whole(min, max) => found.as_integer().is_some_and(|v| (min..=max).contains(&v)),
        Values::Word(words) => found.as_str().is_some_and(|v| words.contains(&v)),
        Values::Version => found
            .as_str()
            .is_some_and(|v| v.parse::<Firmware>().is_ok()),
    }
}

/// An entry as it would be written in a file.
fn to_table(fault: &Fault) -> Table {
    // A plain struct of numbers and words always becomes a table.
    let mut table = Table::try_from(fault.kind).unwrap_or_default();
    let mut put = |key: &str, value: Value| table.insert(key.to_owned(), value);
    match fault.trigger {
        Trigger::At(at_s) => {
            put("at_s", Value::Float(at_s));
        }
        Trigger::Setpoint(count) => {
            put("on", Value::String(format!("setpoint:{count}")));
        }
        Trigger::Motion {
            part,
            length_s,
            number,
        } => {
            put("on", Value::String(format!("motion:{}", part * 100.0)));
            put("motion_s", Value::Float(length_s));
            put("motion", Value::Integer(i64::from(number)));
        }
        Trigger::Speed(speed) => {
            put("on", Value::String(format!("speed:{speed}")));
        }
    }
    if let Some(duration_s) = fault.duration_s {
        put("duration_s", Value::Float(duration_s));
    }
    table
}

#[cfg(test)]
mod tests;
