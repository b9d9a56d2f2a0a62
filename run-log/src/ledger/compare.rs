//! Two runs, value by value.

use super::Entry;
use anyhow::Result;
use serde::Serialize;
use serde_json::Value;

/// A value in which two runs differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Where, as `rope.length_m`.
    pub what: String,
    /// In the first run.
    pub first: Value,
    /// In the second run.
    pub second: Value,
    /// Second minus first, of two numbers.
    pub by: Option<f64>,
}

/// All differences of two runs but their folders and times.
pub fn compare(first: &Entry, second: &Entry) -> Result<Vec<Difference>> {
    let (a, b) = (serde_json::to_value(first)?, serde_json::to_value(second)?);
    let mut found = Vec::new();
    collect("", &a, &b, &mut found);
    found.retain(|d| !["run", "started"].contains(&d.what.as_str()));
    Ok(found)
}

fn collect(at: &str, a: &Value, b: &Value, found: &mut Vec<Difference>) {
    if let (Some(x), Some(y)) = (a.as_object(), b.as_object()) {
        let nothing = Value::Null;
        let more = y.keys().filter(|key| !x.contains_key(*key));
        for key in x.keys().chain(more) {
            let path = if at.is_empty() {
                key.clone()
            } else {
                format!("{at}.{key}")
            };
            collect(
                &path,
                x.get(key).unwrap_or(&nothing),
                y.get(key).unwrap_or(&nothing),
                found,
            );
        }
    } else if a != b {
        found.push(Difference {
            what: at.to_owned(),
            first: a.clone(),
            second: b.clone(),
            by: a.as_f64().zip(b.as_f64()).map(|(a, b)| b - a),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_compared_by_their_place() {
        let mut found = Vec::new();
        let a = json!({ "seed": 1, "rope": { "length_m": 0.5, "links": 20 }, "task": "strike" });
        let b = json!({ "seed": 1, "rope": { "length_m": 0.75, "links": 20 }, "task": null });
        collect("", &a, &b, &mut found);
        let seen: Vec<_> = found.iter().map(|d| (d.what.as_str(), d.by)).collect();
        assert_eq!(seen, [("rope.length_m", Some(0.25)), ("task", None)]);
    }
}
