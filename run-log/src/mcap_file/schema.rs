//! JSON schemas of the messages: Foxglove's well-known ones by their published
//! names, fields and numbers, and our own.

use anyhow::Result;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Messages by name with their fields and what each holds: one of the kinds that [`of_kind`]
/// knows, another message, or a list of either (`[]`); `?` may be left out. Names, fields
/// and numbers of `foxglove.*` are those of the Foxglove SDK's message definitions.
const MESSAGES: &str = include_str!("../../assets/messages.json");

/// The messages of a file.
pub(super) struct Schemas(BTreeMap<String, Vec<(String, String)>>);

impl Schemas {
    /// All of them.
    pub(super) fn read() -> Result<Self> {
        Ok(Self(serde_json::from_str(MESSAGES)?))
    }

    /// The schema of a message, other messages in it written out in place.
    pub(super) fn schema(&self, name: &str) -> Value {
        let mut properties = Map::new();
        let mut required = Vec::new();
        for (field, kind) in self.0.get(name).into_iter().flatten() {
            let needed = kind.strip_suffix('?');
            properties.insert(field.clone(), self.of_kind(needed.unwrap_or(kind)));
            if needed.is_none() {
                required.push(field);
            }
        }
        json!({ "title": name, "type": "object", "properties": properties, "required": required })
    }

    fn of_kind(&self, kind: &str) -> Value {
        if let Some(items) = kind.strip_suffix("[]") {
            return json!({ "type": "array", "items": self.of_kind(items) });
        }
        if let Some(choices) = kind.strip_prefix("choice ") {
            let of: u32 = choices.parse().unwrap_or_default();
            let choices: Vec<Value> = (0..of).map(|n| json!({ "const": n })).collect();
            return json!({ "oneOf": choices });
        }
        let whole = json!({ "type": "integer", "minimum": 0 });
        let moment = |sec: Value| {
            json!({
                "type": "object", "title": kind, "properties": {
                    "sec": sec, "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
                },
            })
        };
        match kind {
            "time" => moment(whole),
            "duration" => moment(json!({ "type": "integer" })),
            "text" => json!({ "type": "string" }),
            "bytes" => json!({ "type": "string", "contentEncoding": "base64" }),
            "number" => json!({ "type": "number" }),
            "count" => whole,
            "flag" => json!({ "type": "boolean" }),
            "object" => json!({ "type": "object" }),
            message => self.schema(message),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mcap_file::channel::Channel;

    const KINDS: [&str; 8] = [
        "time", "duration", "text", "bytes", "number", "count", "flag", "object",
    ];

    /// A kind that is neither one of these nor in the table would be an empty schema, which
    /// lets everything pass.
    #[test]
    fn every_kind_is_known_and_every_message_named_is_there() {
        let Schemas(messages) = Schemas::read().unwrap();
        for (name, fields) in &messages {
            assert!(!fields.is_empty(), "{name}");
            for (field, kind) in fields {
                let one = kind.strip_suffix('?').unwrap_or(kind);
                let one = one.trim_end_matches("[]");
                let choice = one.strip_prefix("choice ").map(str::parse::<u32>);
                assert!(
                    KINDS.contains(&one)
                        || messages.contains_key(one)
                        || matches!(choice, Some(Ok(1..))),
                    "{name}.{field}: {kind}"
                );
            }
        }
        for (number, (channel, topic, schema)) in Channel::ALL.into_iter().enumerate() {
            assert_eq!(channel as usize, number, "{topic}");
            assert!(
                schema.is_none_or(|name| messages.contains_key(name)),
                "{topic}"
            );
        }
    }

    #[test]
    fn nested_messages_are_written_out() {
        let schemas = Schemas::read().unwrap();
        let found = schemas.schema("foxglove.SceneUpdate");
        let colour = &found["properties"]["entities"]["items"]["properties"]["lines"]["items"]["properties"]
            ["color"];
        assert_eq!(colour["title"], "foxglove.Color");
        assert_eq!(colour["required"], json!(["r", "g", "b", "a"]));
        let joint = schemas.schema("foxglove.JointState");
        assert_eq!(joint["required"], json!(["name"]));
    }
}
