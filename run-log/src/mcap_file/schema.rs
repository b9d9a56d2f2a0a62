//! JSON schemas of the messages: Foxglove's well-known ones by their published
//! names, fields and numbers, and our own.

use serde_json::{Map, Value, json};

/// What a field holds.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// Seconds and nanoseconds.
    Time,
    Duration,
    Text,
    /// Bytes in base64.
    Bytes,
    Number,
    /// A number that may be left out.
    MaybeNumber,
    Count,
    Flag,
    /// One of this many numbers from 0.
    Choice(u32),
    Numbers,
    Counts,
    /// Another message.
    Of(&'static str),
    /// A list of another message.
    List(&'static str),
    /// A JSON object whose inside is told by the file it stands for.
    Object,
}

use Kind::{
    Bytes, Choice, Count, Counts, Duration, Flag, List, MaybeNumber, Number, Numbers, Object, Of,
    Text, Time,
};

type Fields = &'static [(&'static str, Kind)];

/// Messages by name. Names, fields and numbers of `foxglove.*` are those of the
/// Foxglove SDK's message definitions.
const MESSAGES: &[(&str, Fields)] = &[
    (
        "foxglove.CompressedImage",
        &[
            ("timestamp", Time),
            ("frame_id", Text),
            ("data", Bytes),
            ("format", Text),
        ],
    ),
    (
        "foxglove.CameraCalibration",
        &[
            ("timestamp", Time),
            ("frame_id", Text),
            ("width", Count),
            ("height", Count),
            ("distortion_model", Text),
            ("D", Numbers),
            ("K", Numbers),
            ("R", Numbers),
            ("P", Numbers),
        ],
    ),
    (
        "foxglove.FrameTransforms",
        &[("transforms", List("foxglove.FrameTransform"))],
    ),
    (
        "foxglove.FrameTransform",
        &[
            ("timestamp", Time),
            ("parent_frame_id", Text),
            ("child_frame_id", Text),
            ("translation", Of("foxglove.Vector3")),
            ("rotation", Of("foxglove.Quaternion")),
        ],
    ),
    (
        "foxglove.JointStates",
        &[("timestamp", Time), ("joints", List("foxglove.JointState"))],
    ),
    (
        "foxglove.JointState",
        &[
            ("name", Text),
            ("position", MaybeNumber),
            ("velocity", MaybeNumber),
            ("acceleration", MaybeNumber),
            ("effort", MaybeNumber),
        ],
    ),
    (
        "foxglove.Log",
        &[
            ("timestamp", Time),
            ("level", Choice(6)),
            ("message", Text),
            ("name", Text),
            ("file", Text),
            ("line", Count),
        ],
    ),
    (
        "foxglove.ImageAnnotations",
        &[
            ("circles", List("foxglove.CircleAnnotation")),
            ("points", List("foxglove.PointsAnnotation")),
            ("texts", List("foxglove.TextAnnotation")),
        ],
    ),
    (
        "foxglove.CircleAnnotation",
        &[
            ("timestamp", Time),
            ("position", Of("foxglove.Point2")),
            ("diameter", Number),
            ("thickness", Number),
            ("fill_color", Of("foxglove.Color")),
            ("outline_color", Of("foxglove.Color")),
            ("metadata", List("foxglove.KeyValuePair")),
        ],
    ),
    (
        "foxglove.PointsAnnotation",
        &[
            ("timestamp", Time),
            ("type", Choice(5)),
            ("points", List("foxglove.Point2")),
            ("outline_color", Of("foxglove.Color")),
            ("outline_colors", List("foxglove.Color")),
            ("fill_color", Of("foxglove.Color")),
            ("thickness", Number),
            ("metadata", List("foxglove.KeyValuePair")),
        ],
    ),
    (
        "foxglove.TextAnnotation",
        &[
            ("timestamp", Time),
            ("position", Of("foxglove.Point2")),
            ("text", Text),
            ("font_size", Number),
            ("text_color", Of("foxglove.Color")),
            ("background_color", Of("foxglove.Color")),
            ("metadata", List("foxglove.KeyValuePair")),
        ],
    ),
    (
        "foxglove.SceneUpdate",
        &[
            ("deletions", List("foxglove.SceneEntityDeletion")),
            ("entities", List("foxglove.SceneEntity")),
        ],
    ),
    (
        "foxglove.SceneEntityDeletion",
        &[("timestamp", Time), ("type", Choice(2)), ("id", Text)],
    ),
    (
        "foxglove.SceneEntity",
        &[
            ("timestamp", Time),
            ("frame_id", Text),
            ("id", Text),
            ("lifetime", Duration),
            ("frame_locked", Flag),
            ("metadata", List("foxglove.KeyValuePair")),
            ("arrows", List("foxglove.ArrowPrimitive")),
            ("cubes", List("foxglove.CubePrimitive")),
            ("spheres", List("foxglove.SpherePrimitive")),
            ("cylinders", List("foxglove.CylinderPrimitive")),
            ("lines", List("foxglove.LinePrimitive")),
            ("triangles", List("foxglove.TriangleListPrimitive")),
            ("texts", List("foxglove.TextPrimitive")),
            ("models", List("foxglove.ModelPrimitive")),
        ],
    ),
    (
        "foxglove.ArrowPrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("shaft_length", Number),
            ("shaft_diameter", Number),
            ("head_length", Number),
            ("head_diameter", Number),
            ("color", Of("foxglove.Color")),
        ],
    ),
    (
        "foxglove.CubePrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("size", Of("foxglove.Vector3")),
            ("color", Of("foxglove.Color")),
        ],
    ),
    (
        "foxglove.SpherePrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("size", Of("foxglove.Vector3")),
            ("color", Of("foxglove.Color")),
        ],
    ),
    (
        "foxglove.CylinderPrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("size", Of("foxglove.Vector3")),
            ("bottom_scale", Number),
            ("top_scale", Number),
            ("color", Of("foxglove.Color")),
        ],
    ),
    (
        "foxglove.LinePrimitive",
        &[
            ("type", Choice(3)),
            ("pose", Of("foxglove.Pose")),
            ("thickness", Number),
            ("scale_invariant", Flag),
            ("points", List("foxglove.Point3")),
            ("color", Of("foxglove.Color")),
            ("colors", List("foxglove.Color")),
            ("indices", Counts),
        ],
    ),
    (
        "foxglove.TriangleListPrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("points", List("foxglove.Point3")),
            ("color", Of("foxglove.Color")),
            ("colors", List("foxglove.Color")),
            ("indices", Counts),
        ],
    ),
    (
        "foxglove.TextPrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("billboard", Flag),
            ("font_size", Number),
            ("scale_invariant", Flag),
            ("color", Of("foxglove.Color")),
            ("text", Text),
        ],
    ),
    (
        "foxglove.ModelPrimitive",
        &[
            ("pose", Of("foxglove.Pose")),
            ("scale", Of("foxglove.Vector3")),
            ("color", Of("foxglove.Color")),
            ("override_color", Flag),
            ("url", Text),
            ("media_type", Text),
            ("data", Bytes),
        ],
    ),
    ("foxglove.KeyValuePair", &[("key", Text), ("value", Text)]),
    (
        "foxglove.Pose",
        &[
            ("position", Of("foxglove.Vector3")),
            ("orientation", Of("foxglove.Quaternion")),
        ],
    ),
    (
        "foxglove.Vector3",
        &[("x", Number), ("y", Number), ("z", Number)],
    ),
    (
        "foxglove.Point3",
        &[("x", Number), ("y", Number), ("z", Number)],
    ),
    ("foxglove.Point2", &[("x", Number), ("y", Number)]),
    (
        "foxglove.Quaternion",
        &[("x", Number), ("y", Number), ("z", Number), ("w", Number)],
    ),
    (
        "foxglove.Color",
        &[("r", Number), ("g", Number), ("b", Number), ("a", Number)],
    ),
    (
        "wag.Cycle",
        &[
            ("timestamp", Time),
            ("cycle", Count),
            ("mode", Text),
            ("fault", Text),
            ("sent", Flag),
            ("wake_late_us", Number),
            ("compute_us", Number),
            ("send_us", Number),
            ("reply_us", Number),
            ("missed", Count),
            ("dropped", Count),
            ("path_rate", Number),
            ("trajectory_s", MaybeNumber),
        ],
    ),
    ("wag.Plan", &[("timestamp", Time), ("plan", Object)]),
    (
        "wag.Parameters",
        &[("timestamp", Time), ("parameters", Object)],
    ),
    ("wag.Summary", &[("timestamp", Time), ("summary", Object)]),
];

/// The schema of a message, other messages in it written out in place.
pub(super) fn schema(name: &str) -> Value {
    let fields = MESSAGES
        .iter()
        .find(|(n, _)| *n == name)
        .map_or(&[][..], |(_, f)| f);
    let mut properties = Map::new();
    let mut required = Vec::new();
    for (field, kind) in fields {
        properties.insert((*field).to_owned(), of_kind(*kind));
        if !matches!(kind, MaybeNumber) {
            required.push(*field);
        }
    }
    json!({ "title": name, "type": "object", "properties": properties, "required": required })
}

fn of_kind(kind: Kind) -> Value {
    let whole = json!({ "type": "integer", "minimum": 0 });
    let list = |items: Value| json!({ "type": "array", "items": items });
    let moment = |title: &str, sec: Value| {
        json!({
            "type": "object", "title": title, "properties": {
                "sec": sec, "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
            },
        })
    };
    match kind {
        Time => moment("time", whole),
        Duration => moment("duration", json!({ "type": "integer" })),
        Text => json!({ "type": "string" }),
        Bytes => json!({ "type": "string", "contentEncoding": "base64" }),
        Number | MaybeNumber => json!({ "type": "number" }),
        Count => whole,
        Flag => json!({ "type": "boolean" }),
        Choice(of) => {
            json!({ "oneOf": (0..of).map(|n| json!({ "const": n })).collect::<Vec<_>>() })
        }
        Numbers => list(json!({ "type": "number" })),
        Counts => list(whole),
        Of(name) => schema(name),
        List(name) => list(schema(name)),
        Object => json!({ "type": "object" }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name that is not in the table would be an empty schema, which lets
    /// everything pass.
    #[test]
    fn every_message_named_is_there() {
        for (name, fields) in MESSAGES {
            assert!(!fields.is_empty(), "{name}");
            for (field, kind) in *fields {
                if let Of(other) | List(other) = kind {
                    assert!(
                        MESSAGES.iter().any(|(n, _)| n == other),
                        "{name}.{field}: {other}"
                    );
                }
            }
        }
        for channel in super::super::channel::Channel::ALL {
            if let Some(name) = channel.schema() {
                assert!(MESSAGES.iter().any(|(n, _)| *n == name), "{name}");
            }
        }
    }

    #[test]
    fn nested_messages_are_written_out() {
        let found = schema("foxglove.SceneUpdate");
        let colour = &found["properties"]["entities"]["items"]["properties"]["lines"]["items"]["properties"]
            ["color"];
        assert_eq!(colour["title"], "foxglove.Color");
        assert_eq!(colour["required"], json!(["r", "g", "b", "a"]));
        let joint = schema("foxglove.JointState");
        assert_eq!(joint["required"], json!(["name"]));
    }
}
