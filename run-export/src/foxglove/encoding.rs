//! From the JSON messages of a recording to the SDK's types, and these in Protobuf.
//!
//! The SDK reads JSON, too, but not quite as Foxglove's published JSON schemas have it: it wants
//! the names of enumerators where those have numbers, small letters in a camera's calibration,
//! and every list.

use ::foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransforms, ImageAnnotations, JointStates, Log,
    SceneUpdate, line_primitive, log, points_annotation, scene_entity_deletion,
};
use ::foxglove::{Encode, Schema};
use anyhow::{Context, Result, anyhow};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::borrow::Cow;

/// A type of messages that is written in Protobuf.
#[derive(Clone, Copy)]
pub(super) struct Encoding {
    schema: fn() -> Option<Schema>,
    encode: fn(&[u8]) -> Result<Vec<u8>>,
}

/// How messages of a schema of the recording are encoded; `None` for those that are no Foxglove
/// messages, or none that a recording has.
pub(super) fn of_schema(name: &str) -> Option<Encoding> {
    Some(match name {
        "foxglove.JointStates" => Encoding::of::<JointStates>(),
        "foxglove.FrameTransforms" => Encoding::of::<FrameTransforms>(),
        "foxglove.SceneUpdate" => Encoding::of::<SceneUpdate>(),
        "foxglove.CompressedImage" => Encoding::of::<CompressedImage>(),
        "foxglove.CameraCalibration" => Encoding::of::<CameraCalibration>(),
        "foxglove.ImageAnnotations" => Encoding::of::<ImageAnnotations>(),
        "foxglove.Log" => Encoding::of::<Log>(),
        _ => return None,
    })
}

impl Encoding {
    fn of<T: Message>() -> Self {
        Self {
            schema: T::get_schema,
            encode: |json| {
                let mut message = serde_json::from_slice(json)?;
                T::adapt(&mut message)?;
                let message: T = serde_json::from_value(message)?;
                let mut bytes = Vec::new();
                let encoded = message.encode(&mut bytes);
                encoded.map_err(|error| anyhow!("it cannot be encoded: {error}"))?;
                Ok(bytes)
            },
        }
    }

    /// Name, encoding and descriptors of its schema.
    pub(super) fn schema(&self) -> Result<(String, String, Cow<'static, [u8]>)> {
        let schema = (self.schema)().context("a message of the SDK without a schema")?;
        Ok((schema.name, schema.encoding, schema.data))
    }

    /// A JSON message of the recording in Protobuf.
    ///
    /// # Errors
    /// It is not as the schema has it.
    pub(super) fn encode(&self, json: &[u8]) -> Result<Vec<u8>> {
        (self.encode)(json)
    }
}

/// A type of the SDK.
trait Message: Encode + DeserializeOwned {
    /// Puts a message of the recording into the words in which the SDK reads it.
    fn adapt(_message: &mut Value) -> Result<()> {
        Ok(())
    }
}

impl Message for JointStates {}
impl Message for FrameTransforms {}
impl Message for CompressedImage {}

impl Message for SceneUpdate {
    fn adapt(message: &mut Value) -> Result<()> {
        enumerator(message, &["deletions", "type"], |number| {
            Some(
                scene_entity_deletion::Type::try_from(number)
                    .ok()?
                    .as_str_name(),
            )
        })?;
        enumerator(message, &["entities", "lines", "type"], |number| {
            Some(line_primitive::Type::try_from(number).ok()?.as_str_name())
        })
    }
}

impl Message for CameraCalibration {
    fn adapt(message: &mut Value) -> Result<()> {
        if let Some(fields) = message.as_object_mut() {
            for (ours, theirs) in [("D", "d"), ("K", "k"), ("R", "r"), ("P", "p")] {
                let numbers = fields.remove(ours);
                fields.extend(numbers.map(|numbers| (theirs.to_owned(), numbers)));
            }
        }
        Ok(())
    }
}

impl Message for ImageAnnotations {
    fn adapt(message: &mut Value) -> Result<()> {
        // Newer than the schema of the recording.
        if let Some(fields) = message.as_object_mut() {
            fields.entry("metadata").or_insert_with(|| json!([]));
        }
        enumerator(message, &["points", "type"], |number| {
            Some(
                points_annotation::Type::try_from(number)
                    .ok()?
                    .as_str_name(),
            )
        })
    }
}

impl Message for Log {
    fn adapt(message: &mut Value) -> Result<()> {
        enumerator(message, &["level"], |number| {
            Some(log::Level::try_from(number).ok()?.as_str_name())
        })
    }
}

/// Puts its name in the place of each number at the end of a path, which goes through all
/// elements of a list. What is not there is for the SDK to miss.
fn enumerator(
    value: &mut Value,
    path: &[&str],
    name: fn(i32) -> Option<&'static str>,
) -> Result<()> {
    match (&mut *value, path) {
        (Value::Array(values), _) => values
            .iter_mut()
            .try_for_each(|value| enumerator(value, path, name)),
        (Value::Object(fields), [field, rest @ ..]) => match fields.get_mut(*field) {
            Some(value) => {
                enumerator(value, rest, name).with_context(|| format!("field `{field}`"))
            }
            None => Ok(()),
        },
        (_, []) => {
            let number = value.as_i64().and_then(|n| i32::try_from(n).ok());
            let named = number.and_then(name);
            let named = named.with_context(|| format!("{value} is none of its values"))?;
            *value = named.into();
            Ok(())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::foxglove::Decode;
    use ::foxglove::messages::Timestamp;

    fn encoded(schema: &str, message: &Value) -> Result<Vec<u8>> {
        of_schema(schema)
            .unwrap()
            .encode(message.to_string().as_bytes())
    }

    #[test]
    fn numbers_of_enumerators_stay_the_same_numbers() {
        let message = json!({
            "timestamp": { "sec": 4_000_000_000_u32, "nsec": 7 }, "level": 4, "message": "m",
            "name": "n", "file": "", "line": 3,
        });
        let bytes = encoded("foxglove.Log", &message).unwrap();
        let expected = Log {
            timestamp: Some(Timestamp::new(4_000_000_000, 7)),
            level: log::Level::Error as i32,
            message: "m".to_owned(),
            name: "n".to_owned(),
            file: String::new(),
            line: 3,
        };
        assert_eq!(Log::decode(&bytes[..]).unwrap(), expected);
        for wrong in [json!(6), json!("INFO"), json!(2.5), json!(1_u64 << 40)] {
            let message = json!({ "level": wrong });
            let error = format!("{:#}", encoded("foxglove.Log", &message).unwrap_err());
            assert!(
                error.contains(&format!("field `level`: {wrong}")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_calibration_keeps_its_matrices_apart() {
        let message = json!({
            "frame_id": "camera_left", "width": 640, "height": 360,
            "distortion_model": "plumb_bob", "D": [0.5], "K": [1], "R": [2.0], "P": [3.0],
        });
        let bytes = encoded("foxglove.CameraCalibration", &message).unwrap();
        let found = CameraCalibration::decode(&bytes[..]).unwrap();
        assert_eq!((found.width, found.height), (640, 360));
        assert_eq!(
            [found.d, found.k, found.r, found.p],
            [[0.5], [1.0], [2.0], [3.0]]
        );
        let error = encoded("foxglove.CameraCalibration", &json!([])).unwrap_err();
        assert!(!error.to_string().is_empty());
    }
}
