//! The channels of a file: topic and schema.

use super::schema::Schemas;
use anyhow::Result;

/// One channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Chunks of the exact recording.
    Replay,
    /// Measured joints.
    Measured,
    /// Commanded joints.
    Commanded,
    /// Figures of every control cycle.
    Cycles,
    /// Places of the arm's links, the pole's end and the camera.
    Frames,
    /// What stands in the room: arm, pole, target.
    Scene,
    /// The identified rope, simulated on the measured joints.
    Rope,
    /// The camera's left eye.
    Image,
    /// Its calibration.
    Calibration,
    /// The rope's keypoints in it.
    Keypoints,
    /// Changes of mode, faults, causes of stops.
    Log,
    /// The plan of the throw.
    Plan,
    /// The identified rope.
    Parameters,
    /// Every figure of the run.
    Summary,
}

/// A schema's name, and itself as JSON.
pub type NamedSchema = (&'static str, String);

impl Channel {
    /// All of them in the order of their numbers, each with its topic and the schema of its
    /// messages; none for bytes that only this program reads.
    pub(super) const ALL: [(Self, &'static str, Option<&'static str>); 14] = [
        (Self::Replay, "/wag/replay", None),
        (
            Self::Measured,
            "/arm/measured",
            Some("foxglove.JointStates"),
        ),
        (
            Self::Commanded,
            "/arm/commanded",
            Some("foxglove.JointStates"),
        ),
        (Self::Cycles, "/controller/cycles", Some("wag.Cycle")),
        (Self::Frames, "/tf", Some("foxglove.FrameTransforms")),
        (Self::Scene, "/scene", Some("foxglove.SceneUpdate")),
        (Self::Rope, "/rope/simulated", Some("foxglove.SceneUpdate")),
        (
            Self::Image,
            "/camera/left/image",
            Some("foxglove.CompressedImage"),
        ),
        (
            Self::Calibration,
            "/camera/left/calibration",
            Some("foxglove.CameraCalibration"),
        ),
        (
            Self::Keypoints,
            "/camera/left/keypoints",
            Some("foxglove.ImageAnnotations"),
        ),
        (Self::Log, "/log", Some("foxglove.Log")),
        (Self::Plan, "/wag/plan", Some("wag.Plan")),
        (Self::Parameters, "/wag/parameters", Some("wag.Parameters")),
        (Self::Summary, "/wag/summary", Some("wag.Summary")),
    ];

    /// Topic.
    pub const fn topic(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// All of them, each with name and JSON schema of its messages; none for bytes that only this
    /// program reads.
    ///
    /// # Errors
    /// The schemas cannot be read, which is a flaw of this program.
    pub fn with_schemas() -> Result<Vec<(Self, Option<NamedSchema>)>> {
        let schemas = Schemas::read()?;
        let schema = |name: &'static str| (name, schemas.schema(name).to_string());
        let all = Self::ALL.into_iter();
        Ok(all
            .map(|(channel, _, name)| (channel, name.map(schema)))
            .collect())
    }

    /// The channel of a topic.
    pub(super) fn of_topic(topic: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|(_, name, _)| *name == topic)
            .map(|(channel, ..)| channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// All texts of a value that look like a topic.
    fn topics(value: &Value, found: &mut Vec<String>) {
        let mut text = |text: &str| {
            if let Some(named) = text.strip_prefix('/') {
                let topic = named.split('.').next().unwrap_or_default();
                found.push(format!("/{topic}"));
            }
        };
        match value {
            Value::String(s) => text(s),
            Value::Array(values) => values.iter().for_each(|v| topics(v, found)),
            Value::Object(map) => {
                map.keys().for_each(|key| text(key));
                map.values().for_each(|v| topics(v, found));
            }
            _ => {}
        }
    }

    #[test]
    fn the_layout_for_foxglove_shows_topics_that_a_run_has() {
        let layout = include_str!("../../../configs/foxglove/wag.json");
        let layout: Value = serde_json::from_str(layout).unwrap();
        let mut shown = Vec::new();
        topics(&layout, &mut shown);
        assert!(shown.len() > 10, "{shown:?}");
        for topic in shown {
            let mut known = Channel::ALL.iter().map(|(_, known, _)| *known);
            assert!(known.any(|known| known == topic), "{topic}");
        }
    }
}
